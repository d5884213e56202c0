"""What a WebMap web application is told by whoever makes it."""

from collections.abc import Awaitable, Callable, MutableMapping
from dataclasses import dataclass, field
from typing import Any

from webmap.server.auth import new_token
from webmap.server.origins import Hosts
from webmap.server.viewer import Viewer

Authenticate = Callable[
    [MutableMapping[str, Any]], Viewer | Awaitable[Viewer | None] | None
]
"""Takes the ASGI scope of a request; gives who makes it, or None to refuse it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """Who may use the application, from where, and how many at once."""

    token: str = field(default_factory=new_token, repr=False)
    """The secret that signs viewers in, of 256 bits or more; made if not given."""

    authenticate: Authenticate | None = None
    """How a host application tells who somebody is, in place of the token."""

    hosts: Hosts = field(default_factory=Hosts)
    """The names by which the server may be called."""

    origins: frozenset[str] = frozenset()
    """Origins besides the server's own that may open sockets: that of a proxy which
    ends TLS in front of it. Made with :func:`webmap.server.origins.checked_origin`."""

    max_pages: int = 100
    """How many pages may be open at once."""
