import pytest

from equipment.server_fakes import TOKEN
from webmap.base.errors import ConfigError
from webmap.core.operators import Viewer
from webmap.server.access import (
    AccessControl,
    AccessRefusal,
    Redirect,
    RequestHead,
    Settings,
    SignedIn,
    redact,
)
from webmap.server.origins import Hosts, checked_origin

HOST = "127.0.0.1:8080"


def scope(
    *,
    host=(HOST,),
    origin=(),
    cookie=(),
    path="/",
    query="",
    type="http",
    method="GET",
    scheme="http",
    root="",
    keys=(),
):
    headers = [(b"host", one.encode("latin-1")) for one in host]
    headers += [(b"origin", one.encode("latin-1")) for one in origin]
    headers += [(b"cookie", one.encode("latin-1")) for one in cookie]
    made = {
        "type": type,
        "path": path,
        "root_path": root,
        "scheme": scheme,
        "query_string": query.encode(),
        "headers": headers,
        "client": ("127.0.0.1", 5000),
    }
    if type == "http":
        headers += [(b"webmap-key", one.encode("latin-1")) for one in keys]
        return {**made, "method": method}
    return {**made, "subprotocols": list(keys)}


def status(access, **kwargs):
    refusal = access.check_address(RequestHead.of(scope(**kwargs)))
    return None if refusal is None else refusal.status


@pytest.fixture
def access():
    return AccessControl(Settings(token=TOKEN))


# The table of origins. The page is http://127.0.0.1:8080.
ORIGINS = [
    (["http://127.0.0.1:8080"], None),
    ([], 403),
    (["null"], 403),
    ([""], 403),
    (["http://127.0.0.1:8080", "http://127.0.0.1:8080"], 403),
    (["http://127.0.0.1:8081"], 403),
    (["http://127.0.0.1"], 403),
    (["https://127.0.0.1:8080"], 403),
    (["ws://127.0.0.1:8080"], 403),
    (["http://localhost:8080"], 403),
    (["http://[::1]:8080"], 403),
    (["http://2130706433:8080"], 403),
    (["http://127.0.0.1:8080.evil.com"], 403),
    (["http://evil.127.0.0.1:8080"], 403),
    (["http://127.0.0.1:8080/"], 403),
    (["http://127.0.0.1:8080@evil.com"], 403),
    (["http://user@127.0.0.1:8080"], 403),
    (["http://127.0.0.1:8080 http://evil.com"], 403),
    (["HTTP://127.0.0.1:8080"], 403),
    (["file://"], 403),
    (["http://192.168.1.5:8080"], 403),
    (["http://evil.com"], 403),
]


@pytest.mark.parametrize(("origin", "expected"), ORIGINS)
@pytest.mark.parametrize("opening", [{"type": "websocket"}, {"method": "POST"}])
def test_only_the_exact_origin_can_open_sockets_and_send_post_requests(
    access, origin, expected, opening
):
    assert status(access, origin=origin, **opening) == expected


@pytest.mark.parametrize("method", ["GET", "HEAD", "OPTIONS"])
def test_get_head_and_options_need_no_origin(access, method):
    assert status(access, method=method) is None


@pytest.mark.parametrize("method", ["POST", "PUT", "PATCH", "DELETE", "FOO", "get"])
def test_every_other_method_needs_an_origin(access, method):
    assert status(access, method=method) == 403


@pytest.mark.parametrize(
    ("host", "origin", "scheme", "expected"),
    [
        ("localhost:8080", "http://localhost:8080", "ws", None),
        ("LOCALHOST:8080", "http://localhost:8080", "ws", None),
        ("localhost:8080", "http://sub.localhost:8080", "ws", 403),
        ("[::1]:8080", "http://[::1]:8080", "ws", None),
        ("localhost", "http://localhost", "ws", None),
        ("localhost:80", "http://localhost", "ws", None),
        ("localhost", "https://localhost", "wss", None),
        ("localhost:443", "https://localhost", "wss", None),
        ("localhost", "http://localhost", "wss", 403),
        ("localhost", "https://localhost", "ws", 403),
    ],
)
def test_the_allowed_origin_follows_the_scheme_the_host_and_the_port(
    access, host, origin, scheme, expected
):
    got = status(access, host=[host], origin=[origin], scheme=scheme, type="websocket")
    assert got == expected


def test_a_configured_origin_can_open_sockets():
    origin = checked_origin("https://Robots.example.com:443")
    access = AccessControl(Settings(token=TOKEN, origins=frozenset({origin})))
    good, bad = "https://robots.example.com", "https://x.robots.example.com"
    assert status(access, origin=[good], type="websocket") is None
    assert status(access, origin=[bad], type="websocket") == 403


@pytest.mark.parametrize(
    "text", ["", "robots", "ftp://robots", "https://", "https://r/", "https://u@r"]
)
def test_an_invalid_origin_in_the_configuration_is_refused(text):
    with pytest.raises(ConfigError, match="an origin is"):
        checked_origin(text)


HOSTS = [
    (["127.0.0.1"], None),
    (["127.0.0.1:1"], None),
    (["localhost:8080"], None),
    (["LocalHost"], None),
    (["[::1]:8080"], None),
    ([], 421),
    ([""], 421),
    (["127.0.0.1:8080", "127.0.0.1:8080"], 421),
    (["localhost."], 421),
    (["127.1"], 421),
    (["127.0.0.2"], 421),
    (["0.0.0.0:8080"], 421),
    (["2130706433"], 421),
    (["::1"], 421),
    (["evil.com"], 421),
    (["evil.com:8080"], 421),
    (["localhost.evil.com"], 421),
    (["localhost:8080.evil.com"], 421),
    (["localhost:80:80"], 421),
    (["localhost:"], 421),
    (["localhost:x"], 421),
    (["u@localhost"], 421),
    (["localhost/"], 421),
    (["localhost localhost"], 421),
    (["192.168.1.5"], 421),
    (["lo\xeccalhost"], 421),
]


@pytest.mark.parametrize(("host", "expected"), HOSTS)
@pytest.mark.parametrize("type", ["http", "websocket"])
def test_only_requests_to_known_hosts_are_answered(access, host, expected, type):
    origin = [f"http://{host[0].lower()}"] if host else []
    assert status(access, host=host, origin=origin, type=type) == expected


def test_the_listening_address_and_the_extra_names_are_known_hosts():
    hosts = Hosts.of_binding("192.168.1.5", ["Robots.example.com", "fd00::1"])
    assert hosts.allow("192.168.1.5:8000")
    assert hosts.allow("robots.example.com")
    assert hosts.allow("[fd00::1]:8000")
    assert hosts.allow("localhost")
    assert not hosts.allow("192.168.1.6")


def test_a_server_on_all_addresses_accepts_any_ip_address_but_not_any_name():
    hosts = Hosts.of_binding("0.0.0.0")
    assert hosts.allow("192.168.1.5:8000")
    assert hosts.allow("[fe80::1]")
    assert not hosts.allow("evil.com")


@pytest.mark.parametrize("name", ["", "a b", "http://a", "a:80", "a/b"])
def test_an_invalid_extra_host_name_is_refused(name):
    with pytest.raises(ConfigError, match="a host is"):
        Hosts.of_binding("127.0.0.1", [name])


def cookie_of(signed_in):
    assert isinstance(signed_in, SignedIn)
    assert signed_in.cookie is not None
    return signed_in.cookie.partition(";")[0]


def sign_in(access, *, now=0.0, **kwargs):
    query = f"webmap_code={access.codes.issue(now)}"
    return access.identify(RequestHead.of(scope(query=query, **kwargs)), now)


def offer(access, token, **kwargs):
    return access.identify(RequestHead.of(scope(query=f"token={token}", **kwargs)), 0.0)


def test_the_token_is_exchanged_for_a_code_and_the_code_for_cookie_and_key(access):
    query = f"a=1&token={TOKEN}&b=%2F"
    to = access.identify(RequestHead.of(scope(path="/lab", query=query)), 0.0)
    assert isinstance(to, Redirect)
    assert to.location.startswith("/lab?a=1&b=%2F&webmap_code=")
    query = to.location.partition("?")[2]
    got = access.identify(RequestHead.of(scope(path="/lab", query=query)), 1.0)
    assert isinstance(got, SignedIn)
    assert got.cookie.startswith("webmap_8080=")
    assert got.cookie.endswith("; Path=/; HttpOnly; SameSite=Strict")
    for secret in (to.location, got.cookie, got.key):
        assert TOKEN not in secret
    assert got.key not in got.cookie


def test_a_code_works_once_and_for_two_minutes(access):
    query = f"webmap_code={access.codes.issue(0.0)}"
    assert isinstance(
        access.identify(RequestHead.of(scope(query=query)), 119.9), SignedIn
    )
    assert access.identify(RequestHead.of(scope(query=query)), 119.9).status == 401
    query = f"webmap_code={access.codes.issue(0.0)}"
    assert access.identify(RequestHead.of(scope(query=query)), 120.0).status == 401


@pytest.mark.parametrize("opening", [{"type": "websocket"}, {"method": "POST"}])
def test_the_key_opens_sockets_and_the_cookie_does_not(access, opening):
    got = sign_in(access)
    cookie = [cookie_of(got)]
    with_cookie = RequestHead.of(scope(cookie=cookie, **opening))
    assert access.identify(with_cookie, 0.0).status == 401
    with_key = RequestHead.of(scope(keys=["webmap", got.key], **opening))
    assert access.identify(with_key, 0.0) == got.viewer
    assert access.identify(RequestHead.of(scope(cookie=cookie)), 0.0) == got.viewer


def test_the_key_cannot_read_a_page(access):
    got = sign_in(access)
    assert access.identify(RequestHead.of(scope(keys=[got.key])), 0.0).status == 401


def test_the_cookie_is_bound_to_the_prefix_the_port_and_tls(access):
    got = sign_in(access, host=["localhost"], scheme="https", root="/robots", path="/x")
    assert got.cookie.startswith("webmap_443=")
    assert got.cookie.endswith("; Path=/robots/; HttpOnly; SameSite=Strict; Secure")


def test_the_cookie_identifies_the_viewer(access):
    cookie = cookie_of(sign_in(access))
    got = access.identify(RequestHead.of(scope(cookie=[f"a=b; {cookie}; c=d"])), 0.0)
    assert isinstance(got, Viewer)
    assert got.role == "admin"
    again = access.identify(RequestHead.of(scope(cookie=["x=y", cookie])), 9.0)
    assert again == got


def test_an_old_cookie_of_another_path_before_the_valid_one_is_ignored(access):
    cookie = cookie_of(sign_in(access))
    cookies = [f"webmap_8080=old; {cookie}"]
    assert isinstance(
        access.identify(RequestHead.of(scope(cookie=cookies)), 0.0), Viewer
    )


def test_two_browsers_are_two_viewers(access):
    first, second = (
        access.identify(RequestHead.of(scope(cookie=[cookie_of(sign_in(access))])), 0.0)
        for _ in range(2)
    )
    assert first.id != second.id


@pytest.mark.parametrize("cookie", [[], ["webmap_8080="], ["webmap_8080=a.b"], ["="]])
def test_a_request_without_a_valid_cookie_is_refused(access, cookie):
    got = access.identify(RequestHead.of(scope(cookie=cookie)), 0.0)
    assert isinstance(got, AccessRefusal)
    assert got.status == 401


def test_the_token_is_not_a_valid_cookie(access):
    got = access.identify(RequestHead.of(scope(cookie=[f"webmap_8080={TOKEN}"])), 0.0)
    assert got.status == 401


@pytest.mark.parametrize("opening", [{"type": "websocket"}, {"method": "POST"}])
def test_a_token_or_a_code_in_the_url_cannot_open_a_socket_or_sign_in_a_post(
    access, opening
):
    assert offer(access, TOKEN, **opening).status == 401
    assert sign_in(access, **opening).status == 401


def test_wrong_tokens_delay_only_further_wrong_tokens(access):
    for _ in range(10):
        assert offer(access, "wrong").status == 401
    got = offer(access, "wrong")
    assert (got.status, got.retry_after) == (429, 60)
    assert isinstance(offer(access, TOKEN), Redirect)
    assert isinstance(sign_in(access), SignedIn)
    assert offer(access, "wrong").status == 429


def test_wrong_tokens_do_not_delay_a_signed_in_viewer(access):
    cookie = cookie_of(sign_in(access))
    for _ in range(20):
        access.identify(RequestHead.of(scope(query="token=wrong")), 0.0)
    assert isinstance(
        access.identify(RequestHead.of(scope(cookie=[cookie])), 0.0), Viewer
    )


def test_a_wrong_token_of_a_signed_in_browser_does_not_count_as_a_failure(access):
    cookie = cookie_of(sign_in(access))
    for _ in range(20):
        request = RequestHead.of(
            scope(query="token=wrong", cookie=[cookie], path="/lab")
        )
        assert access.identify(request, 0.0) == Redirect("/lab")
    assert offer(access, "wrong").status == 401


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("//evil.com/", "/evil.com/"),
        ("/\\evil.com", "/evil.com"),
        ("/a b\r\nSet-Cookie: x", "/a%20b%0D%0ASet-Cookie:%20x"),
        ("/é?#", "/%C3%A9%3F%23"),
    ],
)
def test_the_redirect_stays_on_this_origin(access, path, expected):
    location = offer(access, TOKEN, path=path).location
    assert location.partition("?webmap_code=")[0] == expected


def test_a_refusal_does_not_repeat_the_wrong_token(access):
    secret = "wrong-but-nearly-right"
    got = access.identify(RequestHead.of(scope(query=f"token={secret}")), 0.0)
    assert secret not in got.text


def test_tokens_and_codes_are_removed_from_the_logged_query():
    one = scope(query=f"a=1&token={TOKEN}&token=x&webmap_code=y")
    redact(one)
    assert one["query_string"] == b"a=1&token=...&token=...&webmap_code=..."


def test_settings_do_not_show_their_token():
    assert TOKEN not in repr(Settings(token=TOKEN))
