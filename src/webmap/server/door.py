"""Who may come in: the decisions on one request, without I/O."""

from dataclasses import dataclass
from urllib.parse import quote

from webmap.server.auth import Attempts, Token
from webmap.server.origins import same_origin
from webmap.server.request import Request
from webmap.server.settings import Settings
from webmap.server.viewer import Viewer


@dataclass(frozen=True, slots=True)
class Refusal:
    """A request that is turned away."""

    status: int
    text: str
    """What a person reads; never anything that the request said."""

    retry_after: int = 0
    """Seconds, for status 429."""


@dataclass(frozen=True, slots=True)
class SignedIn:
    """A token that came in a URL: the browser goes on without it."""

    location: str
    cookie: str | None
    """The whole Set-Cookie header, None if the browser has its cookie already."""


class Door:
    """Decides on every request before anything else sees it."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._token = Token(settings.token)
        self._attempts = Attempts()

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

    def identify(self, request: Request, now: float) -> Viewer | SignedIn | Refusal:
        """Tell by cookie or token who makes a request.

        Args:
            request: One that :meth:`check_address` let pass.
            now: Seconds, monotonic.

        """
        viewer = self._viewer(request)
        tokens = request.tokens() if request.reads else []
        if not tokens:
            return viewer or Refusal(401, "Sign in first.")
        if viewer is not None:
            # An old link in a browser that has signed in is not an attempt.
            return SignedIn(request.clean_url(), None)
        wait = self._attempts.wait(request.address, now)
        if wait:
            return Refusal(
                429,
                f"Too many wrong tokens came from your address. Wait {wait} s.",
                retry_after=wait,
            )
        if not any(self._token.matches(token) for token in tokens):
            self._attempts.failed(request.address, now)
            return Refusal(
                401,
                "That is not the token of this server. Unless it was given one, WebMap "
                "makes a new token each time it starts.",
            )
        return SignedIn(request.clean_url(), _set_cookie(request, self._token.issue()))

    def _is_own_origin(self, request: Request) -> bool:
        return request.origin in self._settings.origins or same_origin(
            request.origin, secure=request.secure, host=request.host
        )

    def _viewer(self, request: Request) -> Viewer | None:
        for value in request.cookie(_name(request)):
            session = self._token.session(value)
            if session is not None:
                return Viewer(session, f"operator {session[:4]}")
        return None


def _name(request: Request) -> str:
    # Cookies know no ports: two servers on one machine would share a name.
    return f"webmap_{request.port}"


def _set_cookie(request: Request, value: str) -> str:
    secure = "; Secure" if request.secure else ""
    path = quote(request.root) + "/"
    return f"{_name(request)}={value}; Path={path}; HttpOnly; SameSite=Strict{secure}"
