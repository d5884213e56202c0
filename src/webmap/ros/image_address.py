"""The web address of a camera."""

import base64
from dataclasses import dataclass
from urllib.parse import unquote, urlsplit

from webmap.base.errors import ConfigError

EXAMPLE = "http://robot.local:8080/stream?topic=/camera/image_raw&type=mjpeg"


@dataclass(frozen=True, slots=True)
class Address:
    """A checked address: where to connect, and what to request."""

    host: str
    port: int
    tls: bool
    target: str
    """The path and the query, as in a request."""
    shown: str
    """The address as shown to people: without the parts that may be secret."""
    authorization: str = ""
    """The value of the ``Authorization`` header, if a user was given."""

    @property
    def request(self) -> bytes:
        """The HTTP request for the address.

        The request is HTTP/1.0, so no server answers in chunks.
        """
        name = f"[{self.host}]" if ":" in self.host else self.host
        lines = [
            f"GET {self.target} HTTP/1.0",
            f"Host: {name}:{self.port}",
            "Accept: multipart/x-mixed-replace, image/*",
            "User-Agent: WebMap",
            "Connection: close",
        ]
        if self.authorization:
            lines.append(f"Authorization: {self.authorization}")
        return "\r\n".join([*lines, "", ""]).encode("ascii")


def parse_address(text: str) -> Address:
    """Return the parsed address of a camera.

    Args:
        text: ``http://`` or ``https://``, a host, and a path; a user and a password may
            precede the host.

    Raises:
        ConfigError: If the text is not such an address.

    """
    if not isinstance(text, str) or not text.isascii() or not text.isprintable():
        raise ConfigError(
            f"{_MEANT}; encode characters outside of ASCII with %, got {text!r}"
        )
    try:
        parts = urlsplit(text)
        port = parts.port
    except ValueError:
        raise ConfigError(f"{_MEANT}, got {_without_user(text)!r}") from None
    tls = parts.scheme == "https"
    if parts.scheme not in ("http", "https") or not parts.hostname or " " in text:
        raise ConfigError(f"{_MEANT}, got {_without_user(text)!r}")
    target = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    authorization = ""
    if parts.username is not None:
        pair = f"{unquote(parts.username)}:{unquote(parts.password or '')}"
        authorization = f"Basic {base64.b64encode(pair.encode()).decode()}"
    return Address(
        parts.hostname,
        port if port is not None else (443 if tls else 80),
        tls,
        target,
        _without_user(text).partition("?")[0].partition("#")[0],
        authorization,
    )


_MEANT = f"the address of a camera begins with http:// or https://, as {EXAMPLE}"


def _without_user(text: str) -> str:
    scheme, slashes, rest = text.partition("://")
    host, slash, path = rest.partition("/")
    return scheme + slashes + host.rpartition("@")[2] + slash + path
