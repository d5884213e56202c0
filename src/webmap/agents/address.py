"""Addresses of agents and routers, and the keys under which both exchange messages."""

import hashlib
import re
from typing import NamedTuple
from urllib.parse import urlsplit

from webmap.base.errors import ConfigError

SCHEMES = {"zenoh": "tcp", "zenohs": "tls"}
"""The transport of a router by the scheme of an address."""

PORT = 7447
"""The port of a Zenoh router, if an address has none."""

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,31}")
"""What an agent, a display or its user may be called: a part of a key."""

_LOCATOR = re.compile(r"(?P<transport>tcp|tls)/(?P<place>[^/\s]+)")


def checked_name(name: str, what: str = "agent") -> str:
    """Return a name that may be part of a key.

    Raises:
        ConfigError: If it may not.

    """
    if not NAME.fullmatch(name):
        raise ConfigError(
            f"got the {what} {name!r}, expected 1 to 32 letters, digits, - and _"
        )
    return name


def locator(router: str) -> str:
    """Return the locator of a router, such as ``tcp/host:7447``.

    Args:
        router: A locator, or an address such as ``zenoh://host`` or ``zenohs://host``.

    Raises:
        ConfigError: If the text is neither.

    """
    match = _LOCATOR.fullmatch(router.strip())
    if match is not None:
        place = match["place"]
        has_port = place.rpartition("]")[2].count(":") == 1
        return f"{match['transport']}/{place if has_port else f'{place}:{PORT}'}"
    try:
        parts = urlsplit(router.strip())
        host, port = parts.hostname, parts.port
    except ValueError:
        host, port = None, None
    if parts.scheme not in SCHEMES or not host:
        raise ConfigError(
            f"got the router {router!r}, expected one such as zenoh://host:{PORT}, "
            f"zenohs://host:{PORT} with TLS, or tls/host:{PORT}"
        )
    place = f"[{host}]" if ":" in host else host
    return f"{SCHEMES[parts.scheme]}/{place}:{port or PORT}"


def url(locator: str) -> str:
    """Return the address of a router for displays, by its locator."""
    transport, _, place = locator.partition("/")
    scheme = next(name for name, kind in SCHEMES.items() if kind == transport)
    return f"{scheme}://{place}"


def agent_in(url: str) -> str | None:
    """Return the agent that an address names; None if it is for all of a router.

    Raises:
        ConfigError: If what it names cannot be an agent.

    """
    name = urlsplit(url).path.strip("/")
    return checked_name(name) if name else None


class Sender(NamedTuple):
    """Who sent a message, by the key on which the router accepted it."""

    user: str
    """The user whom the router let in; ``anyone`` without users."""
    instance: str
    """One process of the user."""
    lane: str = ""
    """One connection of the process."""

    @property
    def display(self) -> str:
        """The name of the display, such as ``anna.5f3c01aa``."""
        return f"{self.user}.{self.instance}"


def sender_of(key: str) -> Sender:
    """Return the sender of a message by its key, of :func:`gate_in` or another."""
    return Sender(*key.split("/")[4:7])


EVERY = "*"

ANYONE = "anyone"
"""The user of a display where the router knows no users."""


def beacon(agent: str) -> str:
    """Return the key of the signs that an agent is there."""
    return f"webmap/{agent}/here"


def about(agent: str) -> str:
    """Return the key under which an agent describes its robots when it is asked."""
    return f"webmap/{agent}/about"


def gate_out(agent: str) -> str:
    """Return the key of the samples of an agent's gate; each copy has one under it."""
    return f"webmap/{agent}/gate/out"


def gate_in(agent: str, user: str, instance: str) -> str:
    """Return the key of a display's samples for a gate; each copy has one under it."""
    return f"webmap/{agent}/gate/in/{user}/{instance}"


def data_in(agent: str, user: str, instance: str, lane: str) -> str:
    """Return the key of the frames of a display for a rosbridge."""
    return f"webmap/{agent}/data/in/{user}/{instance}/{lane}"


def data_out(agent: str, user: str, instance: str, lane: str) -> str:
    """Return the key of the frames for one connection of a display."""
    return f"webmap/{agent}/data/out/{user}/{instance}/{lane}"


def topic_key(agent: str, topic: str) -> str:
    """Return the key of the messages of a topic, for all displays."""
    return f"webmap/{agent}/topics{topic}"


def camera_in(agent: str, user: str, instance: str) -> str:
    """Return the key of the messages of a display about cameras."""
    return f"webmap/{agent}/pictures/in/{user}/{instance}"


def camera_out(agent: str, user: str, instance: str) -> str:
    """Return the key of what an agent answers a display about cameras."""
    return f"webmap/{agent}/pictures/out/{user}/{instance}"


def camera_key(agent: str, robot: str, camera: str) -> str:
    """Return the key of the pictures of a camera, for all displays."""
    name = f"{robot}/{camera}".encode("utf-8", "surrogatepass")
    return f"webmap/{agent}/pictures/of/{hashlib.sha256(name).hexdigest()[:32]}"


def about_picture(agent: str, name: str) -> str:
    """Return the key under which an agent gives the picture of a robot."""
    return f"webmap/{agent}/about/{name}"
