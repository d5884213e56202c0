import base64
import gzip
import hashlib
import logging
import re
import zlib
from urllib.parse import urljoin

import pytest
from starlette.applications import Starlette
from starlette.routing import Mount, WebSocketRoute
from starlette.websockets import WebSocketDisconnect

from equipment.server_fakes import TOKEN, FakePage, key_in
from webmap.core.operators import Viewer
from webmap.core.pictures import pictures
from webmap.core.shift_log import shift_log
from webmap.server.access import Settings
from webmap.server.app import RouteFor, WebApp
from webmap.server.auth import Token
from webmap.server.own_files import own_files
from webmap.server.security import CONTENT_SECURITY_POLICY, policy_with

ORIGIN = {"origin": "http://127.0.0.1:8000"}
PAGE_JS = 'src="{}_webmap/v-[0-9a-f]{{16}}/web/page.js"'
PNG = b"\x89PNG\r\n\x1a\n"


def socket_url(name, **query):
    text = "&".join(f"{key}={value}" for key, value in query.items())
    return f"ws://127.0.0.1:8000/_webmap/{name}?{text}"


def refused(client, url, headers, protocols=None):
    """Return the HTTP status that refuses a socket before the upgrade."""
    with (
        pytest.raises(WebSocketDisconnect) as caught,
        client.websocket_connect(url, protocols, headers=dict(headers)),
    ):
        pass
    return getattr(caught.value, "status_code", None)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "index.html").write_text("<head></head><p>Grüße", encoding="utf-8")
    (tmp_path / "style.css").write_text("a{}")
    (tmp_path / "main.py").write_text("secret")
    return tmp_path


@pytest.fixture
def with_page(app, rooms, folder, client):
    """A client of an application with a user's page at /own/page."""
    page = FakePage("/own/page", folder / "index.html", folder)
    rooms.site.pages["/own/page"] = page
    return client


def every_path(app):
    """Return a path for every route of the application, found by looking at them."""
    paths = [
        route.path.replace("{name:path}", "x.js")
        .replace("{tag}", "x")
        .replace("{path:path}", "x")
        for route in app.routes
    ]
    return [*paths, "/", "/lab/", "/_webmap/web/page.js", "/_webmap/made_page.css"]


def test_every_route_needs_a_sign_in(app, stranger):
    assert {type(route) for route in app.routes} == {RouteFor, WebSocketRoute}
    paths = every_path(app)
    assert len(paths) == len(app.routes) + 4
    paths.remove("/healthz")
    for path in paths:
        for method in ("GET", "HEAD", "OPTIONS"):
            assert stranger.request(method, path).status_code == 401, (method, path)
        for method in ("POST", "PUT", "DELETE", "PATCH"):
            assert stranger.request(method, path).status_code == 403, (method, path)
            answer = stranger.request(method, path, headers=ORIGIN)
            assert answer.status_code == 401, (method, path)


def test_every_socket_needs_a_sign_in_and_the_origin_before_the_upgrade(
    app, stranger, client
):
    sockets = [route for route in app.routes if isinstance(route, WebSocketRoute)]
    assert len(sockets) == 3
    for route in sockets:
        name = route.path.removeprefix("/_webmap/").replace("{tag}", "x")
        url = socket_url(name, id="p")
        assert refused(stranger, url, ORIGIN) == 401
        assert refused(client, url, {}) == 403
        assert refused(client, url, {"origin": "http://127.0.0.1:9000"}) == 403


def test_every_answer_has_all_security_headers(app, client, stranger):
    answers = [client.get(path) for path in every_path(app)]
    answers += [client.post("/", headers=ORIGIN), client.post("/")]
    answers += [stranger.get("/"), stranger.get("/", headers={"host": "evil.com"})]
    answers += [stranger.get(f"/?token={TOKEN}"), stranger.get("/?token=wrong")]
    assert {answer.status_code for answer in answers} == {
        200, 303, 401, 403, 404, 405, 421, 503,
    }  # fmt: skip
    opening = own_files.opening()
    for answer in answers:
        headers = answer.headers
        policy = headers["content-security-policy"]
        if opening in answer.text:
            assert policy == policy_with(opening)
        else:
            assert policy.startswith(CONTENT_SECURITY_POLICY)
        assert "unsafe" not in policy
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["referrer-policy"] == "no-referrer"
        assert headers["cross-origin-opener-policy"] == "same-origin"
        assert headers["cross-origin-resource-policy"] == "same-origin"
        assert "cache-control" in headers
        assert "server" not in headers


def test_the_policy_of_a_page_with_a_script_allows_this_script_only(client, with_page):
    made = client.get("/lab/")
    script = re.search(r"<script data-from=[^>]*>(.*?)</script>", made.text, re.S)[1]
    assert script == own_files.opening()
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    sources = f"script-src 'self' 'sha256-{digest}'"
    policy = made.headers["content-security-policy"]
    assert policy == CONTENT_SECURITY_POLICY.replace("script-src 'self'", sources)
    assert "</" not in script
    assert "<!--" not in script
    own = with_page.get("/own/page")
    assert own.headers["content-security-policy"] == CONTENT_SECURITY_POLICY


def test_the_answer_of_a_failing_page_has_the_content_security_policy(
    app, rooms, make_client
):
    class Broken:
        @property
        def pages(self):
            raise RuntimeError("broken")

    app = WebApp(Broken(), rooms.model, rooms.gate, Settings(token=TOKEN))
    client = make_client(app, raise_server_exceptions=False)
    client.cookies["webmap_8000"] = Token(TOKEN).issue()
    answer = client.get("/")
    assert answer.status_code == 500
    assert answer.headers["content-security-policy"] == CONTENT_SECURITY_POLICY
    assert "broken" not in answer.text


def test_a_browser_gets_a_sign_in_form_and_other_programs_get_plain_text(stranger):
    page = stranger.get("/", headers={"accept": "text/html,*/*"})
    assert page.status_code == 401
    assert '<input name="token"' in page.text
    assert "<script" not in page.text
    assert stranger.get("/").headers["content-type"].startswith("text/plain")


def test_signing_in_opens_the_page_and_the_token_is_in_no_answer_and_no_log(
    stranger, caplog
):
    with caplog.at_level(logging.DEBUG):
        answer = stranger.get(f"/lab/?token={TOKEN}")
        location = answer.headers["location"]
        assert location.startswith("./../lab/?webmap_code=")
        assert answer.headers["cache-control"] == "no-store"
        location = urljoin("/lab/", location)
        page = stranger.get(location)
        assert page.headers["cache-control"] == "no-store"
        assert stranger.get(location).headers["location"] == "./../lab/"
        wrong = stranger.get("/?token=not-the-token", headers={"host": "x"})
    assert page.status_code == 200
    for text in (str(answer.headers), page.text, str(page.headers), wrong.text):
        assert TOKEN not in text
        assert "not-the-token" not in text
    ours = [one for one in caplog.records if one.name.startswith("webmap")]
    assert ours
    assert not any("oken" in one.getMessage() for one in ours)


def test_a_made_page_is_served(client):
    answer = client.get("/lab/")
    assert answer.headers["content-type"] == "text/html; charset=utf-8"
    assert "<title>The &lt;lab&gt;</title>" in answer.text
    assert re.search(PAGE_JS.format("./../"), answer.text)


def test_a_missing_or_additional_slash_redirects_to_the_page(client, with_page):
    assert client.get("/lab").headers["location"] == "./lab/"
    assert client.get("/own/page/").headers["location"] == "./../../own/page"


def test_an_html_page_of_the_user_is_served_with_the_files_of_its_folder(with_page):
    page = with_page.get("/own/page")
    assert "Grüße" in page.text
    assert re.search(PAGE_JS.format("./../"), page.text)
    sheet = with_page.get("/own/style.css")
    assert (sheet.status_code, sheet.text) == (200, "a{}")
    assert sheet.headers["content-type"] == "text/css; charset=utf-8"
    for path in (
        "/own/main.py",
        "/own/index.html",
        "/style.css",
        "/own/page/style.css",
    ):
        assert with_page.get(path).status_code == 404


def test_a_made_page_serves_no_files_of_its_folder(rooms, folder, client):
    rooms.site.pages["/"] = FakePage("/", None, folder)
    assert client.get("/style.css").status_code == 404


def test_an_unreadable_html_file_is_an_error_that_does_not_show_its_folder(
    with_page, folder, caplog
):
    (folder / "index.html").write_bytes(b"\xff\xfe\xfa")
    answer = with_page.get("/own/page")
    assert answer.status_code == 500
    assert str(folder) not in answer.text
    assert "index.html" in caplog.text


def test_content_blocked_by_the_policy_is_logged_once(with_page, folder, caplog):
    (folder / "index.html").write_text("<head></head>\n<script>x()</script>")
    for _ in range(3):
        with_page.get("/own/page")
    assert caplog.text.count("line 2: an inline script is blocked") == 1


@pytest.mark.parametrize(
    ("path", "media_type"),
    [
        ("/_webmap/made_page.css", "text/css; charset=utf-8"),
        ("/_webmap/icon.svg", "image/svg+xml; charset=utf-8"),
        ("/_webmap/web/drive.js", "text/javascript; charset=utf-8"),
        ("/_webmap/manifest.webmanifest", "application/manifest+json"),
    ],
)
def test_files_of_the_package_are_served_with_their_media_type(
    client, path, media_type
):
    answer = client.get(path)
    assert answer.status_code == 200
    assert answer.headers["content-type"] == media_type
    assert answer.headers["cache-control"] == "no-cache"


def test_a_file_in_the_cache_of_the_browser_is_not_sent_again(client):
    tag = client.get("/_webmap/icon.svg").headers["etag"]
    again = client.get("/_webmap/icon.svg", headers={"if-none-match": tag})
    assert (again.status_code, again.content) == (304, b"")


def versioned(client, name):
    """Return the URL of one of WebMap's own files in the page's HTML."""
    page = client.get("/lab/").text
    return (
        "/"
        + re.search(
            rf'"\./(?:\.\./)*(_webmap/v-[0-9a-f]{{16}}/{re.escape(name)})"', page
        )[1]
    )


@pytest.mark.parametrize("name", ["web/page.js", "web/webmap.css", "icon.svg"])
def test_a_browser_never_asks_again_for_a_file_of_this_version(client, name):
    answer = client.get(versioned(client, name))
    assert answer.status_code == 200
    assert "immutable" in answer.headers["cache-control"]
    assert client.get("/lab/").headers["cache-control"] == "no-cache"


def test_a_page_that_was_opened_before_an_update_gets_the_present_files(client):
    url = re.sub(r"v-\w+", f"v-{'0' * 16}", versioned(client, "web/page.js"))
    answer = client.get(url)
    assert answer.content == client.get(versioned(client, "web/page.js")).content
    assert answer.headers["cache-control"] == "no-cache"


def test_without_a_version_a_module_is_that_of_the_present_version(client):
    version = versioned(client, "web/page.js").split("/")[2]
    page = client.get("/_webmap/web/page.js")
    assert page.text == f'export * from "../{version}/web/page.js";\n'
    part = client.get("/_webmap/features/drive/teleop.js")
    address = f"../../{version}/features/drive/teleop.js"
    assert part.text == (
        f'export * from "{address}";\nexport {{ default }} from "{address}";\n'
    )


def test_every_text_is_compressed_for_browsers_that_read_gzip(
    client, with_page, folder
):
    (folder / "style.css").write_text("a{}" * 500)
    (folder / "picture.png").write_bytes(PNG + bytes(1000))
    for path, compressed in (
        ("/lab/", True),
        ("/own/page", True),
        (versioned(client, "web/page.js"), True),
        (versioned(client, "web/webmap.css"), True),
        (versioned(client, "web/page.js") + ".map", True),
        ("/own/style.css", True),
        ("/own/picture.png", False),
    ):
        packed = client.get(path, headers={"accept-encoding": "br, gzip;q=0.5"})
        assert packed.status_code == 200, path
        found = packed.headers.get("content-encoding")
        assert found == ("gzip" if compressed else None), path
        if not compressed:
            continue
        assert packed.headers["vary"] == "accept-encoding"
        for accepted in ("", "br", "gzip;q=0"):
            plain = client.get(path, headers={"accept-encoding": accepted})
            assert "content-encoding" not in plain.headers, path
            assert plain.headers["vary"] == "accept-encoding"
            assert plain.content == packed.content, path
            assert plain.headers.get("etag") == packed.headers.get("etag"), path


def test_a_file_is_compressed_once_and_again_only_when_it_changes(
    client, with_page, folder, monkeypatch
):
    compressed = []

    def compress(data, **options):
        compressed.append(data)
        return zlib.compress(data, wbits=31)

    monkeypatch.setattr(gzip, "compress", compress)
    (folder / "style.css").write_text("a{}" * 500)
    page_js = versioned(client, "web/page.js")
    for _ in range(3):
        for path in ("/lab/", "/own/page", "/own/style.css", page_js):
            assert client.get(path).headers["content-encoding"] == "gzip"
    assert len(compressed) == len(set(compressed)) == 4
    (folder / "style.css").write_text("b{}" * 600)
    assert client.get("/own/style.css").text == "b{}" * 600
    assert len(compressed) == 5


def test_head_is_answered_like_get_without_the_body(client):
    answer = client.head("/_webmap/icon.svg")
    assert answer.status_code == 200
    assert answer.content == b""
    assert int(answer.headers["content-length"]) > 0


@pytest.mark.parametrize(
    "path",
    [
        "/_webmap/",
        "/_webmap/nothing.js",
        "/_webmap/..%2f__init__.py",
        "/_webmap/%2e%2e/__init__.py",
        "/_webmap/..%5capp.py",
        "/_webmap//etc/passwd",
        "/_webmap/icon.svg%00.js",
        "/_webmap/files/x/y.js",
        "/_webmap/images/x",
        "/nothing",
    ],
)
def test_every_other_path_is_not_found(client, path):
    answer = client.get(path)
    assert answer.status_code == 404
    assert answer.text.startswith("404 Not Found\n\nThere is nothing")


def test_published_files_and_images_are_served(app, client, folder):
    sheet = client.get(app.published.publish_file(folder / "style.css"))
    assert (sheet.text, sheet.headers["cache-control"]) == ("a{}", "no-cache")
    url = app.published.publish_image(PNG, "image/png")
    image = client.get(url)
    assert image.content == PNG
    assert image.headers["content-type"] == "image/png"
    assert "immutable" in image.headers["cache-control"]
    assert image.headers["content-security-policy"].endswith("; sandbox")
    app.published.withdraw_image(url)
    assert client.get(url).status_code == 404


def test_camera_pictures_are_not_stored_by_the_browser(client):
    url = pictures.publish(PNG + b"seen", "image/png", fleeting=True)
    assert client.get(url).headers["cache-control"] == "no-store"
    pictures.withdraw(url)
    assert client.get(url).status_code == 404


def test_a_published_file_can_have_any_name(app, client, folder):
    odd = folder / "50% of #1 ü?.css"
    odd.write_text("odd{}")
    assert client.get(app.published.publish_file(odd)).text == "odd{}"


def test_wrong_tokens_delay_only_further_wrong_tokens(stranger):
    for _ in range(10):
        assert stranger.get("/?token=wrong").status_code == 401
    answer = stranger.get("/?token=wrong")
    assert answer.status_code == 429
    assert 0 < int(answer.headers["retry-after"]) <= 60
    page = stranger.get(f"/?token={TOKEN}", follow_redirects=True)
    assert page.status_code == 200
    assert key_in(page.text)


def test_a_sign_in_code_works_once_and_for_one_browser(app, make_client):
    first, second = make_client(app), make_client(app)
    address = f"/lab/?a=1&webmap_code={app.new_code()}"
    page = first.get(address)
    assert page.status_code == 200
    assert key_in(page.text)
    assert page.headers["set-cookie"].startswith("webmap_8000=")
    assert first.get("/lab/").status_code == 200
    late = second.get(address)
    assert late.status_code == 401
    assert "works once" in late.text
    assert "set-cookie" not in late.headers
    # In the browser that used the address, the address still redirects.
    assert first.get(address).headers["location"] == "./../lab/?a=1"


def test_only_the_page_of_the_sign_in_contains_the_key(client, with_page):
    assert 'name="webmap-key"' not in client.get("/lab/").text
    assert 'name="webmap-key"' not in with_page.get("/own/page").text
    own = with_page.get(f"/own/page?token={TOKEN}", follow_redirects=True)
    assert own.text.index(key_in(own.text)) < own.text.index("</head>")


def test_a_signed_in_browser_gets_the_same_key_with_the_token(client):
    key = client.headers["webmap-key"]
    page = client.get(f"/?token={TOKEN}", follow_redirects=True)
    assert key_in(page.text) == key
    assert "set-cookie" not in page.headers


@pytest.mark.parametrize("name", ["scene", "drive"])
def test_the_cookie_cannot_open_a_socket(app, client, make_client, name, rooms):
    """Another server on this host receives the cookie: cookies ignore the port."""
    key = client.headers.pop("webmap-key")
    url = socket_url(name, id="p")
    assert refused(client, url, ORIGIN) == 401
    for wrong in (client.cookies["webmap_8000"], TOKEN, key[:-1], key + "0"):
        assert refused(client, url, ORIGIN, ["webmap", wrong]) == 401
    other = make_client(app)
    with other.websocket_connect(url, ["webmap", key], headers=dict(ORIGIN)) as socket:
        assert socket.accepted_subprotocol == "webmap"
        socket.close()
    assert len(rooms.model.scenes) + len(rooms.gate.connections) == 1


def test_a_page_can_ask_why_its_socket_was_refused(client):
    ask = "/_webmap/key"
    assert client.post(ask, headers=ORIGIN).status_code == 204
    assert client.post(ask).status_code == 403
    client.headers["webmap-key"] = "wrong"
    answer = client.post(ask, headers=ORIGIN)
    assert answer.status_code == 401
    assert "Open the address that WebMap printed" in answer.text


def test_the_shift_log_as_csv_needs_the_key_of_a_page(client, stranger):
    path = "/_webmap/shift-log.csv?since=all&kind=all"
    shift_log.note("note", f"=1+1 {TOKEN}")
    answer = client.post(path, headers=ORIGIN)
    assert answer.headers["content-type"].startswith("text/csv")
    assert "'=1+1" in answer.text
    assert ",sign-in," in answer.text  # of this client, who is an admin
    assert TOKEN not in answer.text
    assert client.get(path).status_code == 404
    del client.headers["webmap-key"]  # another port of this host gets the cookie
    assert client.post(path, headers=ORIGIN).status_code == 401


def test_a_wrong_token_is_noted_without_the_token(stranger):
    before = shift_log.total
    stranger.get("/?token=canary-of-a-token")
    (entry,) = shift_log.since(before)
    assert (entry.kind, entry.facts["status"]) == ("sign-in-failed", 401)
    assert "canary" not in str(entry)


def test_a_request_without_sign_in_cannot_add_its_own_lines_to_the_log(
    stranger, caplog
):
    stranger.get("/a%0Aroot: all is well", headers={"host": "evil.com"})
    assert len(caplog.messages) == 1
    assert "\n" not in caplog.messages[0]


def test_the_application_works_under_a_prefix(app, rooms, make_client, with_page):
    host = Starlette(routes=[Mount("/robots", app)])
    client = make_client(host)
    assert client.get("/robots/").status_code == 401
    answer = client.get(f"/robots/lab/?token={TOKEN}")
    location = urljoin("/robots/lab/", answer.headers["location"])
    assert location.startswith("/robots/lab/?webmap_code=")
    answer = client.get(location)
    assert "Path=/robots/;" in answer.headers["set-cookie"]
    key = key_in(answer.text)
    assert re.search(PAGE_JS.format("./../"), client.get("/robots/lab/").text)
    assert client.get("/robots/lab").headers["location"] == "./lab/"
    assert client.get("/robots/_webmap/icon.svg").status_code == 200
    assert client.get("/robots/own/style.css").text == "a{}"
    url = socket_url("scene", page="lab/", id="p").replace(
        "/_webmap", "/robots/_webmap"
    )
    with client.websocket_connect(url, ["webmap", key], headers=dict(ORIGIN)) as socket:
        socket.send_text("hello")
        socket.close()
    assert rooms.model.scenes[0].path == "/lab/"
    assert rooms.model.scenes[0].received == ["hello"]


@pytest.mark.parametrize("is_async", [False, True])
def test_a_host_application_can_authenticate_viewers(rooms, make_client, is_async):
    def viewer_of(scope):
        known = any(name == b"x-user" for name, _ in scope["headers"])
        return Viewer("1", "Ada", "viewer") if known else None

    async def async_viewer_of(scope):
        return viewer_of(scope)

    settings = Settings(authenticate=async_viewer_of if is_async else viewer_of)
    app = WebApp(rooms.site, rooms.model, rooms.gate, settings)
    client = make_client(app)
    assert client.get(f"/?token={settings.token}").status_code == 403
    headers = {"x-user": "ada"}
    assert client.get("/", headers=headers).status_code == 200
    url = socket_url("drive", id="p")
    assert refused(client, url, headers) == 403
    assert refused(client, url, ORIGIN) == 403
    with client.websocket_connect(url, headers={**headers, **ORIGIN}) as socket:
        socket.close()
    connection = rooms.gate.connections[0]
    assert (connection.name, connection.role) == ("Ada", "viewer")


def test_the_application_uses_the_lifespan_of_its_host(rooms, make_client):
    from contextlib import asynccontextmanager

    events = []

    @asynccontextmanager
    async def life(app):
        events.append("start")
        yield
        events.append("stop")

    app = WebApp(rooms.site, rooms.model, rooms.gate, lifespan=life)
    with make_client(app):
        assert events == ["start"]
    assert events == ["start", "stop"]


def test_a_weak_token_is_refused_at_the_start(rooms):
    with pytest.raises(ValueError, match="43"):
        WebApp(rooms.site, rooms.model, rooms.gate, Settings(token="weak"))
