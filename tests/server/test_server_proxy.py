"""WebMap behind reverse proxies: what they state, and from whom it counts."""

import contextlib
import logging

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from equipment.reverse_proxies import PASS, answering, free_port, nginx
from equipment.server_fakes import (
    TOKEN,
    FakeGate,
    FakeModel,
    FakePage,
    FakeSite,
    key_in,
    running,
)
from equipment.waiting import wait_for
from webmap.base.errors import ConfigError
from webmap.server.access import Settings
from webmap.server.app import WebApp
from webmap.server.origins import Hosts
from webmap.server.proxy import (
    LIFE_S,
    MOST_SEEN,
    TRUSTED,
    Grant,
    Proxies,
    ProxyUsers,
)

PUBLIC = "https://example.com/robots"


def scope_of(*headers, client="127.0.0.1", path="/lab/", kind="http"):
    pairs = [(name.encode(), value.encode()) for name, value in headers]
    scheme = "ws" if kind == "websocket" else "http"
    return {
        "type": kind,
        "path": path,
        "scheme": scheme,
        "client": (client, 5),
        "headers": pairs,
    }


@pytest.mark.parametrize(
    "url",
    [
        "example.com",
        "ftp://example.com",
        "https://example.com/a?b",
        "https://example.com/../x",
        "https://u@example.com",
        'https://example.com/a"b',
    ],
)
def test_a_public_url_that_is_not_valid_is_refused(url):
    with pytest.raises(ConfigError, match="the public URL"):
        Proxies.of(url)


@pytest.mark.parametrize("address", ["", "proxy", "10.0.0.1/24", "*"])
def test_a_proxy_is_trusted_by_its_address(address):
    with pytest.raises(ConfigError, match="an address or a network"):
        Proxies.of("", [address])


def test_a_public_url_has_an_origin_and_a_path():
    found = Proxies.of("https://Example.com:443/robots/")
    assert (found.origin, found.base) == ("https://example.com", "/robots")
    assert found.names == ["example.com"]
    assert Proxies.of("http://example.com:8000").names == ["example.com"]
    assert Proxies.of().names == []


@pytest.mark.parametrize("path", ["/lab/", "/robots/lab/"])
@pytest.mark.parametrize(("kind", "scheme"), [("http", "https"), ("websocket", "wss")])
def test_under_the_public_host_a_request_is_as_the_browser_sees_it(path, kind, scheme):
    proxies = Proxies.of(PUBLIC)
    scope = scope_of(("host", "example.com"), path=path, kind=kind)
    seen = proxies.seen(scope)
    assert (seen["path"], seen["root_path"]) == ("/robots/lab/", "/robots")
    assert seen["scheme"] == scheme
    assert scope["path"] == path  # the server's own scope stays as it is


def test_under_another_host_the_public_url_does_not_count():
    seen = Proxies.of(PUBLIC).seen(scope_of(("host", "127.0.0.1:8080")))
    assert (seen["path"], seen["scheme"]) == ("/lab/", "http")
    assert "root_path" not in seen


FORWARDED = (
    ("host", "127.0.0.1:8080"),
    ("x-forwarded-for", "6.6.6.6, 10.0.0.9"),
    ("x-forwarded-proto", "https"),
    ("x-forwarded-host", "example.com"),
)


@pytest.mark.parametrize(
    "prefix", ["x-forwarded-prefix", "x-forwarded-context", "x-proxycontextpath"]
)
def test_forwarded_headers_count_from_a_trusted_proxy_alone(prefix):
    proxies = Proxies.of("", ["10.1.0.0/16", "127.0.0.1"])
    headers = (*FORWARDED, (prefix, "/user/x/proxy/8080/"))
    seen = proxies.seen(scope_of(*headers, client="10.1.2.3"))
    assert seen["client"] == ("10.0.0.9", 0)
    assert seen["scheme"] == "https"
    assert [v for k, v in seen["headers"] if k == b"host"] == [b"example.com"]
    assert seen["path"] == "/user/x/proxy/8080/lab/"
    for client in ("10.2.0.1", "::1", "/run/socket", ""):
        scope = scope_of(*headers, client=client)
        assert proxies.seen(scope) == {**scope, TRUSTED: False}


def test_the_client_is_the_last_hop_that_is_no_trusted_proxy():
    proxies = Proxies.of("", ["10.1.0.0/16"])

    def client(*values):
        headers = [("x-forwarded-for", value) for value in values]
        return proxies.seen(scope_of(*headers, client="::ffff:10.1.0.1"))["client"][0]

    assert client("1.1.1.1, 2.2.2.2, 10.1.0.5") == "2.2.2.2"
    assert client("1.1.1.1", "2.2.2.2") == "2.2.2.2"
    assert client("10.1.0.5") == client("nonsense") == client() == "::ffff:10.1.0.1"


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("x-forwarded-proto", ["https", "http"]),
        ("x-forwarded-proto", ["https, http"]),
        ("x-forwarded-proto", ["javascript"]),
        ("x-forwarded-host", ["a.example", "b.example"]),
        ("x-forwarded-prefix", ["/a", "/b"]),
        ("x-forwarded-prefix", ["/a/../b"]),
        ("x-forwarded-prefix", ["//evil.example"]),
        ("x-forwarded-prefix", ['/a"><script>']),
        ("x-forwarded-prefix", ["evil"]),
    ],
)
def test_a_header_that_is_not_clear_does_not_count(name, values):
    proxies = Proxies.of("", ["127.0.0.1"])
    scope = scope_of(("host", "localhost"), *((name, value) for value in values))
    assert proxies.seen(scope) == {**scope, TRUSTED: True}


# People who have signed in at the proxy.

GRANTS = ("robot-admins=admin", "drivers=operator:bay2/*,tag:lift", "staff=viewer")
USER, GROUPS = "X-Forwarded-User", "X-Forwarded-Groups"


def make_users(grants=GRANTS, **more):
    return ProxyUsers(USER, tuple(map(Grant.read, grants)), GROUPS, **more)


def asked(users, *headers, trusted=True):
    return users({**scope_of(*headers), TRUSTED: trusted})


def signed(user="ana", groups="drivers"):
    return (("x-forwarded-user", user), ("x-forwarded-groups", groups))


@pytest.mark.parametrize("text", ["drivers", "=admin", "a=boss", "a=operator:", "a="])
def test_a_role_of_a_group_that_is_not_valid_is_refused(text):
    with pytest.raises(ConfigError):
        Grant.read(text)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"user_header": "a b"}, "a header has letters"),
        ({"user_header": "a_b"}, "a header has letters"),
        ({"grants": ()}, "nobody could sign in"),
        ({"sign_out_url": "javascript:alert(1)"}, "begins with https"),
    ],
)
def test_a_sign_in_at_a_proxy_that_is_not_valid_is_refused(more, words):
    given = {"user_header": USER, "grants": (Grant("*", "viewer"),), **more}
    with pytest.raises(ConfigError, match=words):
        ProxyUsers(**given)


@pytest.mark.parametrize(
    ("groups", "role", "robots"),
    [
        ("robot-admins, drivers", "admin", ("*",)),
        ("staff,drivers", "operator", ("bay2/*", "tag:lift")),
        ("staff", "viewer", ("*",)),
    ],
)
def test_the_first_role_of_a_persons_groups_counts(groups, role, robots):
    viewer = asked(make_users(), *signed("ana@example.com", groups))
    assert (viewer.name, viewer.role) == ("ana@example.com", role)
    assert viewer.robots == robots
    assert not viewer.signs_out


def test_people_without_a_group_or_a_name_have_no_access():
    users = make_users()
    assert asked(users, *signed(groups="others")) is None
    assert asked(users, ("x-forwarded-user", "ana")) is None
    assert asked(users) is None
    everybody = make_users(["*=viewer"])
    assert asked(everybody, ("x-forwarded-user", "ana")).role == "viewer"


SPOOFED = [
    [*signed(), ("x-forwarded-user", "root")],
    [*signed(), ("x_forwarded_user", "root")],
    [("x_forwarded_user", "ana"), ("x-forwarded-groups", "drivers")],
    [*signed(), ("x-forwarded-groups", "robot-admins")],
    [*signed(), ("x-forwarded_groups", "robot-admins")],
    [*signed("")],
    [*signed("you")],
    [*signed("WebMap")],
    [*signed("a" * 300)],
]


@pytest.mark.parametrize("headers", SPOOFED)
def test_headers_that_are_not_clear_sign_nobody_in(headers, caplog):
    assert asked(make_users(), *headers) is None
    assert "refused a sign-in header from 127.0.0.1" in caplog.text


def test_headers_from_anybody_else_are_refused_with_a_line_in_the_log(caplog):
    assert asked(make_users(), *signed(), trusted=False) is None
    assert "the connection does not come from a trusted proxy" in caplog.text


def test_a_sign_in_ends_with_another_right_and_after_a_time_without_requests():
    now = [100.0]
    users = make_users(now=lambda: now[0])
    ana = asked(users, *signed())
    assert asked(users, *signed()) == ana
    ben = asked(users, *signed("ben", "staff"))
    assert users.lasts(ana.id)
    admin = asked(users, *signed(groups="robot-admins"))
    assert (users.lasts(ana.id), users.lasts(admin.id)) == (False, True)
    assert asked(users, *signed(groups="others")) is None
    assert not users.lasts(admin.id)
    now[0] += LIFE_S - 1
    assert users.lasts(ben.id)
    now[0] += 2
    assert not users.lasts(ben.id)


def test_a_crowd_of_names_needs_no_more_memory():
    users = make_users()
    first = asked(users, *signed())
    for number in range(MOST_SEEN):
        asked(users, *signed(f"person {number}"))
    assert not users.lasts(first.id)
    assert len(users._seen) == MOST_SEEN


# With a real nginx.


@pytest.fixture
def gate():
    return FakeGate()


@contextlib.contextmanager
def served(gate, **settings):
    site = FakeSite(FakePage("/"), FakePage("/lab/"))
    settings = {"token": TOKEN, "hosts": Hosts.of_binding("127.0.0.1"), **settings}
    with running(WebApp(site, FakeModel(), gate, Settings(**settings))) as server:
        yield server


def browse(port, **more):
    return httpx.Client(
        base_url=f"http://127.0.0.1:{port}",
        follow_redirects=True,
        headers={"accept": "text/html", "origin": f"http://127.0.0.1:{port}"},
        **more,
    )


def drive(port, prefix, key=None, **headers):
    return connect(
        f"ws://127.0.0.1:{port}{prefix}/_webmap/drive?id=p",
        origin=f"http://127.0.0.1:{port}",
        subprotocols=["webmap", *([key] if key else [])],
        additional_headers=headers,
    )


@pytest.mark.parametrize("way", ["nothing is stated", "public URL", "header"])
def test_behind_nginx_under_a_prefix_a_page_has_its_files_and_sockets(
    gate, tmp_path, way
):
    port = free_port()
    public = f"http://127.0.0.1:{port}/robots" if way == "public URL" else ""
    strips = way == "nothing is stated"
    with contextlib.ExitStack() as stack:
        proxies = Proxies.of(public, ["127.0.0.1"])
        server = stack.enter_context(served(gate, proxies=proxies))
        to = f"http://127.0.0.1:{server.port}" + ("/" if strips else "")
        states = "proxy_set_header X-Forwarded-Prefix /robots;" * (way == "header")
        location = f"location /robots/ {{ proxy_pass {to}; {PASS} {states} }}"
        stack.enter_context(nginx(tmp_path, location, port))
        browser = stack.enter_context(browse(port))
        page = browser.get("/robots/lab/", params={"token": TOKEN})
        assert page.status_code == 200
        assert str(page.url).startswith(f"http://127.0.0.1:{port}/robots/lab/?webmap")
        [set_cookie] = page.history[0].headers.get_list("set-cookie") or [
            page.headers["set-cookie"]
        ]
        assert f"Path={'/' if strips else '/robots/'};" in set_cookie
        files = page.text.split('href="')[2].partition('"')[0]
        assert browser.get(page.url.join(files)).status_code == 200
        assert browser.get("/robots/lab").url.path == "/robots/lab/"
        with drive(port, "/robots", key_in(page.text)):
            wait_for(lambda: gate.connections)


def provider(request):
    """Answer nginx who somebody is: the cookie ``who`` is believed."""
    cookies = dict(
        pair.strip().partition("=")[::2]
        for pair in request.headers.get("cookie", "").split(";")
    )
    people = {"ana": "drivers", "ben": "robot-admins,staff"}
    groups = people.get(cookies.get("who", ""))
    request.send_response(401 if groups is None else 200)
    if groups is not None:
        request.send_header("X-User", cookies["who"])
        request.send_header("X-Groups", people[cookies["who"]])
    request.send_header("Content-Length", "0")
    request.end_headers()


AUTH = """
    location = /auth {{
      internal; proxy_pass http://127.0.0.1:{provider}/;
      proxy_pass_request_body off; proxy_set_header Content-Length "";
    }}
    location / {{
      auth_request /auth;
      auth_request_set $user $upstream_http_x_user;
      auth_request_set $groups $upstream_http_x_groups;
      proxy_set_header X-Forwarded-User $user;
      proxy_set_header X-Forwarded-Groups $groups;
      proxy_pass http://127.0.0.1:{webmap};
      {more}
    }}
"""


@pytest.fixture
def company(gate, tmp_path):
    """Yield the ports of nginx and of WebMap behind it, and the users."""
    users = make_users(sign_out_url="/oauth2/sign_out")
    with contextlib.ExitStack() as stack:
        proxies = Proxies.of("", ["127.0.0.1"])
        server = stack.enter_context(served(gate, proxies=proxies, proxy_users=users))
        who = stack.enter_context(answering(provider))
        conf = AUTH.format(provider=who, webmap=server.port, more=PASS)
        yield stack.enter_context(nginx(tmp_path, conf)), server.port, users


def test_a_company_signs_people_in_at_its_nginx(company, gate):
    port, _, _ = company
    with browse(port) as stranger:
        assert stranger.get("/").status_code == 401
        assert stranger.get("/", params={"token": TOKEN}).status_code == 401
    with browse(port, cookies={"who": "ana"}) as browser:
        page = browser.get("/")
        assert page.status_code == 200
        assert '<meta name="webmap-ask">' in page.text
        out = browser.post("/_webmap/sign-out")
        assert (out.status_code, out.text) == (200, "/oauth2/sign_out")
    with drive(port, "", cookie="who=ana"):
        wait_for(lambda: gate.connections)
    [page] = gate.connections
    assert (page.name, page.role, page.identity.verified) == ("ana", "operator", True)
    assert page.may_drive is not None


@pytest.mark.parametrize(
    "headers",
    [
        [("X-Forwarded-User", "ben"), ("X-Forwarded-Groups", "robot-admins")],
        [("x-forwarded-user", "ben"), ("x-forwarded-groups", "robot-admins")],
        [("X_Forwarded_User", "ben"), ("X_Forwarded_Groups", "robot-admins")],
        [("X-Forwarded-User", "ben"), ("X-Forwarded-User", "ben")],
        [("X-Forwarded-Groups", "robot-admins"), ("X-Forwarded-For", "127.0.0.1")],
    ],
)
def test_nobody_chooses_a_name_or_a_group_through_nginx(company, gate, headers):
    port, _, _ = company
    with browse(port) as stranger:
        assert stranger.get("/", headers=headers).status_code == 401
    with connect(
        f"ws://127.0.0.1:{port}/_webmap/drive?id=p",
        origin=f"http://127.0.0.1:{port}",
        additional_headers=[("Cookie", "who=ana"), *headers],
    ):
        wait_for(lambda: gate.connections)
    assert [(one.name, one.role) for one in gate.connections] == [("ana", "operator")]


def test_a_direct_connection_from_another_address_signs_nobody_in(gate, caplog):
    users = make_users()
    proxies = Proxies.of("", ["10.9.9.9"])
    with (
        caplog.at_level(logging.WARNING),
        served(gate, proxies=proxies, proxy_users=users) as server,
        browse(server.port) as browser,
    ):
        headers = {"x-forwarded-user": "ana", "x-forwarded-groups": "robot-admins"}
        assert browser.get("/", headers=headers).status_code == 403
        assert browser.get("/").status_code == 403
        with pytest.raises(InvalidStatus, match="403"):
            drive(server.port, "", **headers)
    assert "does not come from a trusted proxy" in caplog.text
    assert gate.connections == []


def test_another_group_ends_the_sockets_of_the_person_at_the_next_request(
    company, gate
):
    _, direct, _ = company  # as from nginx, whose provider has changed its mind
    headers = dict(signed())
    with drive(direct, "", **headers) as socket, browse(direct) as browser:
        wait_for(lambda: gate.connections)
        headers["x-forwarded-groups"] = "staff"
        assert browser.post("/_webmap/key", headers=headers).status_code == 204
        with pytest.raises(ConnectionClosed, match="not signed in any more"):
            socket.recv(timeout=20)
