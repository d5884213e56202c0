"""Who may come in: the decisions on one request, without I/O."""

from collections.abc import Iterable
from dataclasses import dataclass
from urllib.parse import quote

from webmap.server.auth import Attempts, Codes, Token
from webmap.server.origins import same_origin
from webmap.server.request import Request
from webmap.server.settings import Settings
from webmap.server.viewer import Viewer

NOT_SIGNED_IN = (
    "This browser is not signed in, or WebMap was started again with a new token. Open "
    "the address that WebMap printed when it started."
)


@dataclass(frozen=True, slots=True)
class Refusal:
    """A request that is turned away."""

    status: int
    text: str
    """What a person reads; never anything that the request said."""

    retry_after: int = 0
    """Seconds, for status 429."""


@dataclass(frozen=True, slots=True)
class GoOn:
    """A request whose URL holds what must not stay there: the browser goes on."""

    location: str


@dataclass(frozen=True, slots=True)
class SignedIn:
    """A request that used a one-time code up: it is answered, with the new secrets."""

    viewer: Viewer
    key: str
    """What the page that is answered keeps, and opens its sockets with."""

    cookie: str | None
    """The whole Set-Cookie header, None if the browser has its cookie already."""


class Door:
    """Decides on every request before anything else sees it."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._token = Token(settings.token)
        self._attempts = Attempts()
        self.codes = Codes()

    def check_address(self, request: Request) -> Refusal | None:
        """Refuse what names another host, or comes from a page of another origin."""
        if not self._settings.hosts.allow(request.host):
            return Refusal(
                421,
                "This server does not answer to that host name. Open the address that "
                "WebMap printed when it started, or start it with this name among its "
                "hosts.",
            )
        if request.changes and not self._is_own_origin(request):
            return Refusal(
                403,
                "Only WebMap's own pages may do this, and this request does not come "
                "from one of them.",
            )
        return None

    def identify(
        self, request: Request, now: float
    ) -> Viewer | GoOn | SignedIn | Refusal:
        """Tell by cookie, key, token or code who makes a request.

        Sockets, and requests that may change something, need a page's key. For all
        others the cookie is enough.

        Args:
            request: One that :meth:`check_address` let pass.
            now: Seconds, monotonic.

        """
        if request.changes:
            return self._key_holder(request) or Refusal(401, NOT_SIGNED_IN)
        viewer = self._cookie_holder(request)
        if not request.reads:
            return viewer or Refusal(401, "Sign in first.")
        if any(self.codes.use(code, now) for code in request.codes()):
            return self._sign_in(request, viewer)
        tokens = request.tokens()
        if any(self._token.matches(token) for token in tokens):
            return GoOn(request.clean_url(self.codes.issue(now)))
        if viewer is not None:
            # An old link in a browser that has signed in is not an attempt.
            return GoOn(request.clean_url()) if tokens or request.codes() else viewer
        if tokens:
            return self._refuse_token(request, now)
        if request.codes():
            return Refusal(
                401, "This address works once, and soon after WebMap has made it."
            )
        return Refusal(401, "Sign in first.")

    def _refuse_token(self, request: Request, now: float) -> Refusal:
        wait = self._attempts.wait(request.address, now)
        if wait:
            return Refusal(
                429,
                "Too many wrong tokens came from your address. The right one, in the "
                f"address that WebMap printed, works now; a wrong one after {wait} s.",
                retry_after=wait,
            )
        self._attempts.failed(request.address, now)
        return Refusal(
            401,
            "That is not the token of this server. Unless it was given one, WebMap "
            "makes a new token each time it starts.",
        )

    def _sign_in(self, request: Request, viewer: Viewer | None) -> SignedIn:
        if viewer is not None:
            return SignedIn(viewer, self._token.key(viewer.id), None)
        cookie = self._token.issue()
        session = self._token.session(cookie)
        assert session is not None
        return SignedIn(
            _viewer(session), self._token.key(session), _set_cookie(request, cookie)
        )

    def _is_own_origin(self, request: Request) -> bool:
        return request.origin in self._settings.origins or same_origin(
            request.origin, secure=request.secure, host=request.host
        )

    def _cookie_holder(self, request: Request) -> Viewer | None:
        return _first(map(self._token.session, request.cookie(_name(request))))

    def _key_holder(self, request: Request) -> Viewer | None:
        return _first(map(self._token.session_of_key, request.keys))


def _first(sessions: Iterable[str | None]) -> Viewer | None:
    return next((_viewer(session) for session in sessions if session), None)


def _viewer(session: str) -> Viewer:
    return Viewer(session, f"operator {session[:4]}")


def _name(request: Request) -> str:
    # Cookies know no ports: two servers on one machine would share a name.
    return f"webmap_{request.port}"


def _set_cookie(request: Request, value: str) -> str:
    secure = "; Secure" if request.secure else ""
    path = quote(request.root) + "/"
    return f"{_name(request)}={value}; Path={path}; HttpOnly; SameSite=Strict{secure}"
