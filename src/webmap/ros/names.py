"""Names of topics, types and bridges, and their comparison."""

import re
from typing import NamedTuple
from urllib.parse import urlsplit, urlunsplit

from webmap.base.errors import ConfigError

_TOPIC = re.compile(r"/(?:[A-Za-z_~][A-Za-z0-9_]*)(?:/[A-Za-z0-9_]+)*\Z")
_TYPE = re.compile(
    r"(?P<package>[A-Za-z][A-Za-z0-9_]*)"
    r"(?:/(?P<kind>msg|srv|action))?"
    r"/(?P<name>[A-Za-z][A-Za-z0-9_]*)\Z"
)
_HOST = re.compile(r"(?:[A-Za-z0-9.-]+|\[[0-9A-Fa-f:.]+\])(?::\d{1,5})?(?:/[^\s]*)?")

DEFAULT_PORTS = {"ws": 80, "wss": 443, "foxglove": 8765, "foxgloves": 8765}
DEFAULT_PORTS |= {"zenoh": 7447, "zenohs": 7447, "zenoh-ros2": 7447}
"""The port of an address without one, by the scheme: those of all kinds of links."""

PICTURES = ("sensor_msgs/CompressedImage", "sensor_msgs/Image")
"""The types of pictures."""

VIDEO = ("foxglove_msgs/CompressedVideo", "ffmpeg_image_transport_msgs/FFMPEGPacket")
"""The types of video: a message refers to earlier ones, so each of them counts."""

_AGENTS = ("zenoh", "zenohs")
_ROSBRIDGE = ("ws", "wss")
_FOXGLOVE = {"foxglove": "ws", "foxgloves": "wss"}
_WITH_GATE = (*_ROSBRIDGE, *_FOXGLOVE, *_AGENTS)
_MAX_NAME = 255
_THIS_COMPUTER = ("localhost", "127.0.0.1", "[::1]")


class TypeName(NamedTuple):
    """A type's name without its dialect."""

    package: str
    name: str

    def __str__(self) -> str:
        """The name in the form of ROS 1."""
        return f"{self.package}/{self.name}"


def normalise_topic(topic: str) -> str:
    """Return the resolved name of ``topic``: absolute, single slashes, none at the end.

    A relative name is resolved from the root, as in rosbridge, unless rosbridge runs in
    a namespace.

    Raises:
        ConfigError: If the text cannot be the name of a topic or a service.

    """
    if not isinstance(topic, str):
        raise ConfigError(f"a topic is a text such as '/odom', got {topic!r}")
    name = "/" + "/".join(part for part in topic.strip().split("/") if part)
    if len(name) > _MAX_NAME or not _TOPIC.match(name):
        raise ConfigError(
            f"{topic!r} is not the name of a topic: expected letters, digits and "
            f"underscores between slashes, such as '/robot_0/odom'"
        )
    return name


def is_topic(topic: str) -> bool:
    """Return whether :func:`normalise_topic` accepts ``topic``."""
    try:
        normalise_topic(topic)
    except ConfigError:
        return False
    return True


def split_type(type: str) -> TypeName:
    """Return package and name of a type in either dialect.

    ``nav_msgs/Odometry`` (ROS 1) and ``nav_msgs/msg/Odometry`` (ROS 2) give the same
    value.

    Raises:
        ConfigError: If the text is not the name of a type.

    """
    match = _TYPE.match(type.strip()) if isinstance(type, str) else None
    if match is None:
        raise ConfigError(
            f"{type!r} is not the name of a type: expected one such as "
            f"'nav_msgs/Odometry' or 'nav_msgs/msg/Odometry'"
        )
    return TypeName(match["package"], match["name"])


def same_type(one: str, other: str) -> bool:
    """Return whether two names mean one type, in any dialects.

    Text that is not the name of a type equals nothing.
    """
    try:
        return split_type(one) == split_type(other)
    except ConfigError:
        return False


def is_type(type: str, *names: str) -> bool:
    """Return whether ``type`` is one of ``names``, in any dialects."""
    return any(same_type(type, name) for name in names)


def ros2_type(type: str) -> str:
    """Return the name of a message type in the form of ROS 2, with ``/msg/``.

    Raises:
        ConfigError: If the text is not the name of a type.

    """
    package, name = split_type(type)
    return f"{package}/msg/{name}"


def _scheme(url: str) -> str:
    return url.partition("://")[0].strip().lower()


def is_agent_url(url: str) -> bool:
    """Return whether an address is one of a router with agents, or of an agent."""
    return _scheme(url) in _AGENTS


def has_gate(url: str) -> bool:
    """Return whether a gate can move the robots behind a bridge with this address."""
    return _scheme(url) in _WITH_GATE


def is_rosbridge_url(url: str) -> bool:
    """Return whether an address is one of a rosbridge."""
    return _scheme(url) in _ROSBRIDGE


def is_foxglove_url(url: str) -> bool:
    """Return whether an address is one of a ``foxglove_bridge``."""
    return _scheme(url) in _FOXGLOVE


def web_socket_url(url: str) -> str:
    """Return the ``ws`` or ``wss`` address of a normalised address of any bridge."""
    parts = urlsplit(url)
    if parts.scheme not in _FOXGLOVE:
        return url
    place = parts.netloc
    if parts.port is None:
        place = f"{place}:{DEFAULT_PORTS[parts.scheme]}"
    return urlunsplit(parts._replace(scheme=_FOXGLOVE[parts.scheme], netloc=place))


def agent_named(url: str) -> str:
    """Return the agent in an address; empty if it is no address of an agent."""
    return urlsplit(url).path.strip("/") if is_agent_url(url) else ""


def normalise_url(url: str) -> str:
    """Return the normalised address of a bridge.

    Scheme and host become lower case; the default port of the scheme and a slash at the
    end are removed. So two spellings of one address compare equal.

    Raises:
        ConfigError: If the text is not the address of a bridge.

    """
    hint = "expected one such as 'ws://localhost:9090' or 'foxglove://robot:8765'"
    if not isinstance(url, str) or any(c.isspace() or c < " " for c in url.strip()):
        raise ConfigError(f"{url!r} is not the address of a bridge: {hint}")
    try:
        parts = urlsplit(url.strip())
        host, port = parts.hostname, parts.port
    except ValueError as error:
        raise ConfigError(
            f"{url!r} is not the address of a bridge ({error}): {hint}"
        ) from None
    if "://" not in url and _HOST.fullmatch(url.strip()):
        hint = f"did you mean 'ws://{url.strip()}'?"
    if parts.scheme not in DEFAULT_PORTS or not host or port == 0:
        raise ConfigError(f"{url!r} is not the address of a bridge: {hint}")
    if parts.username is not None or parts.fragment:
        raise ConfigError(
            f"the address of a bridge holds no user name and no fragment: {hint}"
        )
    place = f"[{host}]" if ":" in host else host
    if port is not None and port != DEFAULT_PORTS[parts.scheme]:
        place = f"{place}:{port}"
    path = parts.path.rstrip("/")
    return urlunsplit((parts.scheme, place, path, parts.query, ""))


def spellings_of(url: str) -> list[str]:
    """Return a normalised address and its other spellings; the given one is first.

    Only an address of this computer has other spellings.
    """
    parts = urlsplit(url)
    host, port = parts.netloc, ""
    if parts.port is not None:
        host, _, port = host.rpartition(":")
        port = f":{port}"
    if host not in _THIS_COMPUTER:
        return [url]
    return [urlunsplit(parts._replace(netloc=h + port)) for h in _THIS_COMPUTER]
