"""The accepted hosts and origins of this server, without I/O.

A page of another site can make a browser send requests here, and a name that its owner
points to 127.0.0.1 (DNS rebinding) makes them look like the server's own. So every
request must name a known host, and a socket or a request that changes something must
come from the exact origin that it is sent to.
"""

import ipaddress
import re
import socket
from collections.abc import Iterable
from dataclasses import dataclass

from webmap.base.errors import ConfigError

LOOPBACK = frozenset({"127.0.0.1", "localhost", "[::1]"})
WILDCARD = frozenset({"", "0.0.0.0", "::"})  # noqa: S104 - to recognise, not to bind

_HOST = re.compile(r"(\[[0-9a-f:.]+\]|[a-z0-9._-]+)(?::([0-9]{1,5}))?", re.IGNORECASE)
_ORIGIN = re.compile(r"https?://[^/?#@\s]+")


@dataclass(frozen=True, slots=True)
class Hosts:
    """The accepted names of a server."""

    names: frozenset[str] = LOOPBACK
    """Host names and addresses, lower-case, IPv6 in brackets, without a port."""

    addresses: bool = False
    """Whether any IP address is accepted; no name can be rebound to one."""

    def allow(self, header: str) -> bool:
        """Return whether a Host header names this server, with any port."""
        match = _HOST.fullmatch(header)
        if match is None:
            return False
        name = match[1].lower()
        return name in self.names or (self.addresses and _is_address(name))

    @classmethod
    def of_binding(cls, host: str, extra: Iterable[str] = ()) -> "Hosts":
        """Return the names of a server that listens on ``host``.

        Args:
            host: The address to listen on; ``"0.0.0.0"`` and ``"::"`` mean all
                addresses.
            extra: More accepted names.

        Raises:
            ConfigError: If an extra name is not a host name or an address.

        """
        names = set(LOOPBACK)
        if host in WILDCARD:
            own = socket.gethostname().lower()
            names |= {own, f"{own}.local"}
        else:
            names.add(_bracketed(host.lower()))
        for name in extra:
            names.add(_checked(name))
        return cls(frozenset(names), addresses=host in WILDCARD)


def is_loopback(host: str) -> bool:
    """Return whether only this machine can reach a server that listens on ``host``."""
    if host.lower() == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def ip_of(text: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """Return the IP address in a text, without its zone; None if it is none.

    An IPv4 address in the form of IPv6 (``::ffff:192.0.2.1``) counts as IPv4.
    """
    try:
        found = ipaddress.ip_address(text.partition("%")[0])
    except ValueError:
        return None
    mapped = found.ipv4_mapped if isinstance(found, ipaddress.IPv6Address) else None
    return mapped or found


def same_origin(origin: str | None, *, secure: bool, host: str) -> bool:
    """Return whether an Origin header is the exact origin that a request was sent to.

    Args:
        origin: The header; None if there is none, and ``"null"`` never matches.
        secure: Whether the request came over TLS.
        host: The request's Host header, with its port if it has one.

    """
    scheme = "https" if secure else "http"
    default = ":443" if secure else ":80"
    # Browsers leave the scheme's default port out of both headers; other clients may
    # not.
    return origin == f"{scheme}://{host.lower().removesuffix(default)}"


def checked_origin(text: str) -> str:
    """Return an origin of the configuration in the form that browsers use.

    Raises:
        ConfigError: If it is not a scheme, a host and an optional port.

    """
    if not _ORIGIN.fullmatch(text):
        raise ConfigError(
            f"an origin is a scheme, a host and perhaps a port, as "
            f"'https://robots.example.com': got {text!r}"
        )
    scheme, _, host = text.lower().partition("://")
    return f"{scheme}://{host.removesuffix(':443' if scheme == 'https' else ':80')}"


def _checked(name: str) -> str:
    match = _HOST.fullmatch(_bracketed(name))
    if match is None or match[2] is not None:
        raise ConfigError(
            f"a host is a name or an address without scheme or port, got {name!r}"
        )
    return match[1].lower()


def _bracketed(host: str) -> str:
    return f"[{host}]" if ":" in host and host[0] != "[" and _is_address(host) else host


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name.removeprefix("[").removesuffix("]"))
    except ValueError:
        return False
    return True
