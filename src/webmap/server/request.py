"""What the door looks at in a request, taken out of its ASGI scope."""

from dataclasses import dataclass
from urllib.parse import parse_qsl, quote, urlencode

from starlette.types import Scope

_SAFE_METHODS = {"GET", "HEAD", "OPTIONS"}

TOKEN = "token"  # noqa: S105 - the name of a field
CODE = "webmap_code"
"""The fields of a query that sign in: the token, and a one-time code."""

PROTOCOL = "webmap"
"""The subprotocol of both sockets. A page offers it together with its key, as a browser
lets a page set no other header of a WebSocket."""


@dataclass(frozen=True, slots=True)
class Request:
    """One request or one opening of a socket, before anything is believed."""

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
    """What it offers as the key of a page."""

    address: str
    """Where it came from, as the server says."""

    wants_html: bool

    @classmethod
    def of(cls, scope: Scope) -> "Request":
        """Read an ``http`` or ``websocket`` scope."""
        method = scope.get("method", "")
        is_socket = scope["type"] == "websocket"
        return cls(
            path=scope["path"],
            root=scope.get("root_path", "").rstrip("/"),
            changes=is_socket or method not in _SAFE_METHODS,
            reads=not is_socket and method in {"GET", "HEAD"},
            secure=scope.get("scheme") in {"https", "wss"},
            hosts=_headers(scope, b"host"),
            origins=_headers(scope, b"origin"),
            cookies=_headers(scope, b"cookie"),
            query=tuple(
                parse_qsl(
                    scope.get("query_string", b"").decode("latin-1"),
                    keep_blank_values=True,
                )
            ),
            keys=(
                *(name for name in scope.get("subprotocols", ()) if name != PROTOCOL),
                *_headers(scope, b"webmap-key"),
            )[:4],
            address=(scope.get("client") or ("",))[0],
            wants_html=any("text/html" in one for one in _headers(scope, b"accept")),
        )

    @property
    def host(self) -> str:
        """The one Host header, empty if there is none or more than one."""
        return self.hosts[0] if len(self.hosts) == 1 else ""

    @property
    def origin(self) -> str | None:
        """The one Origin header, if there is exactly one."""
        return self.origins[0] if len(self.origins) == 1 else None

    @property
    def port(self) -> str:
        """The port that the browser sees."""
        port = self.host.rpartition(":")[2]
        return port if port.isdecimal() else ("443" if self.secure else "80")

    def tokens(self) -> list[str]:
        """Return every ``?token=`` of the query."""
        return [value for name, value in self.query if name == TOKEN]

    def codes(self) -> list[str]:
        """Return every one-time code of the query."""
        return [value for name, value in self.query if name == CODE]

    def cookie(self, name: str) -> list[str]:
        """Return every value of a cookie; nested paths may each have one."""
        pairs = (
            pair.strip().partition("=")
            for header in self.cookies
            for pair in header.split(";")
        )
        return [value for key, _, value in pairs if key == name]

    def clean_url(self, code: str | None = None) -> str:
        """Return this URL without what signs in, as a path on the same origin.

        Args:
            code: A one-time code that the URL carries in place of the token.

        """
        # Two slashes at the start would be another host.
        path = "/" + quote(self.path.lstrip("/\\"), safe="/~!$&'()*+,;=:@-._")
        kept = [(name, value) for name, value in self.query if name not in _SECRET]
        if code is not None:
            kept.append((CODE, code))
        return f"{path}?{urlencode(kept)}" if kept else path


_SECRET = {TOKEN, CODE}


def redact(scope: Scope) -> None:
    """Take what signs in out of a scope, from which servers write access logs."""
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
