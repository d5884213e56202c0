"""Access control: the decisions on one request, without I/O."""

from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from dataclasses import dataclass, field, replace
from typing import Any
from urllib.parse import parse_qsl, quote, urlencode

from starlette.types import Scope

from webmap.core.operators import Viewer
from webmap.server.auth import Attempts, Codes, Token, new_token
from webmap.server.origins import LOOPBACK, Hosts, is_loopback, same_origin
from webmap.server.people import Denied, People
from webmap.server.proxy import Proxies, ProxyUsers

_SAFE_METHODS = {"GET", "HEAD", "OPTIONS"}

TOKEN = "token"  # noqa: S105 - the name of a field
CODE = "webmap_code"
"""The fields of a query that sign in: the token, and a one-time code."""

KEY = "webmap-key"
"""The element of a page and the header of a request with the page's key."""

PROTOCOL = "webmap"
"""The subprotocol of all sockets. A page offers it together with its key, as browsers
let a page set no other header of a WebSocket."""

FRAME = "frame"
"""The field of the query of a socket whose page is in a frame."""

_FRAMES = {"iframe", "frame", "embed", "object"}

_SECRET = {TOKEN, CODE}

_FORWARDED = (b"forwarded", b"via", b"x-forwarded", b"x-real-ip")
"""The beginnings of the headers that proxies add."""

NOT_SIGNED_IN = (
    "This browser is not signed in, or WebMap was started again with a new token. Open "
    "the address that WebMap printed at its start."
)

SESSION_ENDED = "You are not signed in any more: load the page again, and sign in."

Authenticate = Callable[
    [MutableMapping[str, Any]], Viewer | Awaitable[Viewer | None] | None
]
"""Takes the ASGI scope of a request; returns its viewer, or None to refuse it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Who may use the application, from where, and how many at once."""

    token: str = field(default_factory=new_token, repr=False)
    """The secret that signs viewers in, of 256 bits or more; generated if not given."""

    authenticate: Authenticate | None = None
    """The host application's authentication, in place of the token."""

    proxy_users: ProxyUsers | None = None
    """People who sign in at a proxy, in place of the token."""

    people: People | None = None
    """The named users, in place of the token; their secret is then the token."""

    proxies: Proxies = field(default_factory=Proxies)
    """The proxies in front, and the address that browsers see."""

    embed_from: frozenset[str] = frozenset()
    """Origins whose pages may show WebMap in a frame."""

    embed_driving: bool = False
    """Whether robots may be driven there."""

    @property
    def has_token(self) -> bool:
        """Whether the token signs viewers in."""
        return not (self.authenticate or self.people or self.proxy_users)

    @property
    def lasts(self) -> Callable[[str], object] | None:
        """Return whether a viewer is still signed in; None if that never ends."""
        if self.people is not None:
            return self.people.viewer
        return None if self.proxy_users is None else self.proxy_users.lasts

    hosts: Hosts = field(default_factory=Hosts)
    """The accepted names of the server."""

    origins: frozenset[str] = frozenset()
    """Origins that may open sockets in addition to the server's own, such as that of a
    proxy that ends TLS. Made with :func:`webmap.server.origins.checked_origin`."""

    max_pages: int = 100
    """The greatest number of open pages."""


@dataclass(frozen=True, slots=True)
class RequestHead:
    """The parts of a request, or of a socket's opening, that decide on access."""

    path: str
    """Decoded, with the prefix under which the application is mounted."""

    root: str
    """The prefix, without a slash at its end."""

    changes: bool
    """Whether it opens a socket or may change something."""

    reads: bool
    """Whether it is a plain GET or HEAD."""

    secure: bool
    hosts: tuple[str, ...]
    origins: tuple[str, ...]
    cookies: tuple[str, ...]
    query: tuple[tuple[str, str], ...]
    keys: tuple[str, ...]
    """The values offered as the key of a page."""

    address: str
    """The address of the client, as the server reports it."""

    wants_html: bool

    framed: bool
    """Whether it is for a page in a frame, or of one."""
    forwarded: bool = False
    """Whether a proxy passed it on, as far as the proxy states that."""

    @classmethod
    def of(cls, scope: Scope) -> "RequestHead":
        """Return the request of an ``http`` or ``websocket`` scope."""
        method = scope.get("method", "")
        is_socket = scope["type"] == "websocket"
        query = scope.get("query_string", b"").decode("latin-1")
        fields = tuple(parse_qsl(query, keep_blank_values=True))
        return cls(
            path=scope["path"],
            root=scope.get("root_path", "").rstrip("/"),
            changes=is_socket or method not in _SAFE_METHODS,
            reads=not is_socket and method in {"GET", "HEAD"},
            secure=scope.get("scheme") in {"https", "wss"},
            hosts=_headers(scope, b"host"),
            origins=_headers(scope, b"origin"),
            cookies=_headers(scope, b"cookie"),
            query=fields,
            keys=(
                *(name for name in scope.get("subprotocols", ()) if name != PROTOCOL),
                *_headers(scope, KEY.encode()),
            )[:4],
            address=(scope.get("client") or ("",))[0],
            wants_html=any("text/html" in one for one in _headers(scope, b"accept")),
            # A browser states where it shows a page; the page states it for sockets.
            framed=FRAME in dict(fields)
            or not _FRAMES.isdisjoint(_headers(scope, b"sec-fetch-dest")),
            forwarded=any(name.startswith(_FORWARDED) for name, _ in scope["headers"]),
        )

    @property
    def host(self) -> str:
        """The only Host header; empty if there is none or more than one."""
        return self.hosts[0] if len(self.hosts) == 1 else ""

    @property
    def origin(self) -> str | None:
        """The only Origin header; None if there is none or more than one."""
        return self.origins[0] if len(self.origins) == 1 else None

    @property
    def port(self) -> str:
        """The port that the browser sees."""
        port = self.host.rpartition(":")[2]
        return port if port.isdecimal() else ("443" if self.secure else "80")

    def tokens(self) -> list[str]:
        """Return the values of ``?token=`` in the query."""
        return [value for name, value in self.query if name == TOKEN]

    def codes(self) -> list[str]:
        """Return the one-time codes of the query."""
        return [value for name, value in self.query if name == CODE]

    def cookie(self, name: str) -> list[str]:
        """Return all values of a cookie; nested paths may each have one."""
        pairs = (
            pair.strip().partition("=")
            for header in self.cookies
            for pair in header.split(";")
        )
        return [value for key, _, value in pairs if key == name]

    def clean_url(self, code: str | None = None) -> str:
        """Return this URL without tokens and codes, as a path on the same origin.

        Args:
            code: A one-time code to add in place of the token.

        """
        # Two slashes at the start would name another host.
        path = "/" + quote(self.path.lstrip("/\\"), safe="/~!$&'()*+,;=:@-._")
        kept = [(name, value) for name, value in self.query if name not in _SECRET]
        if code is not None:
            kept.append((CODE, code))
        return f"{path}?{urlencode(kept)}" if kept else path


def redact(scope: Scope) -> None:
    """Remove tokens and codes from a scope, from which servers write access logs."""
    query = scope.get("query_string", b"").decode("latin-1")
    if any(name in query for name in _SECRET):
        kept = [pair for pair in parse_qsl(query, keep_blank_values=True)]
        scope["query_string"] = urlencode(
            [(name, "..." if name in _SECRET else value) for name, value in kept],
            safe=".",
        ).encode("latin-1")


def _headers(scope: Scope, name: bytes) -> tuple[str, ...]:
    return tuple(
        value.decode("latin-1") for key, value in scope["headers"] if key == name
    )


@dataclass(frozen=True, slots=True)
class AccessRefusal:
    """The HTTP answer to a request that is not allowed."""

    status: int
    text: str
    """The text for people; it never repeats the request."""

    retry_after: int = 0
    """Seconds, for status 429."""


@dataclass(frozen=True, slots=True)
class Redirect:
    """A redirect to a URL without the token or the code."""

    location: str


@dataclass(frozen=True, slots=True)
class SignedIn:
    """A request with a valid one-time code: it is answered, with the new secrets."""

    viewer: Viewer
    key: str
    """The key that the answered page keeps to open its sockets."""

    cookie: str | None
    """The whole Set-Cookie header; None if the browser already has its cookie."""


class AccessControl:
    """Decides on every request before any other code processes it."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._token = Token(settings.token)
        self._viewer_of = settings.people.viewer if settings.people else _nameless
        self._attempts = Attempts()
        self.codes = Codes()

    def check_address(self, request: RequestHead) -> AccessRefusal | None:
        """Refuse a request for another host, or from a page of another origin."""
        if not self._settings.hosts.allow(request.host):
            return AccessRefusal(
                421,
                "WebMap does not accept this host name. Open the address that WebMap "
                "printed at its start, or add this name to the hosts of WebMap.",
            )
        if request.changes and not self._is_own_origin(request):
            return AccessRefusal(
                403,
                "Expected a request from a page of WebMap, got a request from another "
                "origin.",
            )
        return None

    def is_local(self, request: RequestHead) -> bool:
        """Return whether a program of this machine asks, and not a proxy.

        A proxy may hide itself, but then it is configured here by its origin, or signs
        people in.
        """
        return (
            is_loopback(request.address)
            and request.host.lower().removesuffix(f":{request.port}") in LOOPBACK
            and not request.forwarded
            and not self._settings.origins
            and not self._settings.proxies.trusted
            and self._settings.authenticate is None
        )

    def identify(
        self, request: RequestHead, now: float
    ) -> Viewer | Redirect | SignedIn | AccessRefusal:
        """Return who makes a request, by cookie, key, token or code.

        Sockets, and requests that may change something, need a page's key. For all
        others the cookie is enough.

        Args:
            request: A request that :meth:`check_address` accepted.
            now: Seconds, monotonic.

        """
        if request.changes:
            text = SESSION_ENDED if self._settings.people else NOT_SIGNED_IN
            return self._key_holder(request) or AccessRefusal(401, text)
        viewer = self._first(map(self._token.session, request.cookie(_name(request))))
        if not request.reads:
            return viewer or AccessRefusal(401, "Sign in first.")
        sessions = [self.codes.use(code, now) for code in request.codes()]
        if session := next(filter(None, sessions), None):
            return self._sign_in(request, viewer, session)
        # A token has no name.
        tokens = [] if self._settings.people else request.tokens()
        if any(self._token.matches(token) for token in tokens):
            return Redirect(request.clean_url(self.codes.issue(now)))
        if viewer is not None:
            # An old URL in a browser that has signed in is not an attempt.
            return (
                Redirect(request.clean_url()) if tokens or request.codes() else viewer
            )
        if tokens:
            return self._refuse_token(request, now)
        if request.codes():
            return AccessRefusal(
                401,
                "This address has expired: it works once and only for a short time.",
            )
        return AccessRefusal(401, "Sign in first.")

    def _refuse_token(self, request: RequestHead, now: float) -> AccessRefusal:
        wait = self._attempts.wait(request.address, now)
        if wait:
            return AccessRefusal(
                429,
                "Too many wrong tokens from your address. The token in the address "
                f"that WebMap printed works now; try other tokens after {wait} s.",
                retry_after=wait,
            )
        self._attempts.failed(request.address, now)
        return AccessRefusal(
            401,
            "Wrong token. Without a fixed token, WebMap makes a new token at each "
            "start.",
        )

    def sign_in_user(
        self, request: RequestHead, name: str, password: str, path: str, now: float
    ) -> Redirect | AccessRefusal:
        """Sign in a named user; takes a tenth of a second.

        Args:
            request: A request that :meth:`check_address` accepted.
            name: The name of the user.
            password: The password of the user.
            path: The path of the page to open then.
            now: Seconds, monotonic.

        """
        people = self._settings.people
        assert people is not None
        session = people.sign_in(name, password, request.address)
        if isinstance(session, Denied):
            status = 429 if session.wait else 401
            return AccessRefusal(status, session.text, session.wait)
        code = self.codes.issue(now, session)
        return Redirect(replace(request, path=path, query=()).clean_url(code))

    def _sign_in(
        self, request: RequestHead, viewer: Viewer | None, session: str
    ) -> SignedIn | AccessRefusal:
        # Without named users, a browser that is signed in stays the same viewer.
        if self._settings.people is None and viewer is not None:
            return SignedIn(viewer, self._key(viewer.id, request), None)
        signed = self._viewer_of(session)
        if signed is None:
            return AccessRefusal(401, "Sign in first.")
        framed = request.framed and bool(self._settings.embed_from)
        cookie = _set_cookie(request, self._token.issue(session), framed=framed)
        return SignedIn(signed, self._key(session, request), cookie)

    def _key(self, session: str, request: RequestHead) -> str:
        framed = request.framed and not self._settings.embed_driving
        return self._token.key(session, framed=framed)

    def _is_own_origin(self, request: RequestHead) -> bool:
        return request.origin in self._settings.origins or same_origin(
            request.origin, secure=request.secure, host=request.host
        )

    def _key_holder(self, request: RequestHead) -> Viewer | None:
        token = self._token
        viewer = self._first(map(token.session_of_key, request.keys))
        if viewer is not None:
            return viewer
        sessions = (token.session_of_key(key, framed=True) for key in request.keys)
        framed = self._first(sessions)
        return None if framed is None else replace(framed, role="viewer")

    def _first(self, sessions: Iterable[str | None]) -> Viewer | None:
        found = (self._viewer_of(session) for session in sessions if session)
        return next(filter(None, found), None)


def _nameless(session: str) -> Viewer:
    # Whoever knows the token may do everything.
    return Viewer(session, role="admin")


def _name(request: RequestHead) -> str:
    # Cookies ignore ports: two servers on one machine would share a name.
    return f"webmap_{request.port}"


def _set_cookie(request: RequestHead, value: str, *, framed: bool) -> str:
    path = quote(request.root) + "/"
    site = "SameSite=Strict" + "; Secure" * request.secure
    if framed:  # browsers keep it apart for each site that shows the frame
        site = "SameSite=None; Secure; Partitioned"
    return f"{_name(request)}={value}; Path={path}; HttpOnly; {site}"
