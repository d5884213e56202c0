"""How rosbridges differ: names of types, times, headers, and deviations of versions."""

from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal

from webmap.base.errors import ConfigError

DialectName = Literal["ros1", "ros2"]
Kind = Literal["msg", "srv", "action"]

_SERVICE_PACKAGES = {"rosapi": "rosapi_msgs"}


@dataclass(slots=True)
class Dialect:
    """One dialect; it numbers the headers of topics, so use one per graph."""

    name: DialectName = "ros1"

    _sequence: dict[str, int] = field(default_factory=dict)

    @property
    def is_ros2(self) -> bool:
        """Whether names of types, times and headers have the form of ROS 2."""
        return self.name == "ros2"

    def spell(self, canonical: str, kind: Kind = "msg") -> str:
        """Return the name of a type in this dialect, from ``pkg/Name``."""
        if not self.is_ros2:
            return canonical
        package, _, name = canonical.partition("/")
        if name.endswith("_FeedbackMessage"):
            kind = "action"
        return f"{_SERVICE_PACKAGES.get(package, package)}/{kind}/{name}"

    def time(self, seconds: float) -> dict[str, int]:
        """Return a stamp or a duration, given in seconds."""
        nanoseconds = round(seconds * 1e9)
        whole, rest = divmod(nanoseconds, 1_000_000_000)
        if self.is_ros2:
            return {"sec": whole, "nanosec": rest}
        return {"secs": whole, "nsecs": rest}

    def header(self, topic: str, stamp: float, frame_id: str) -> dict[str, Any]:
        """Return the next ``std_msgs/Header`` of a topic; ROS 1 numbers them."""
        if self.is_ros2:
            return {"stamp": self.time(stamp), "frame_id": frame_id}
        number = self._sequence.get(topic, 0) + 1
        self._sequence[topic] = number
        return {"seq": number, "stamp": self.time(stamp), "frame_id": frame_id}


def canonical(type_name: str) -> str:
    """Return ``pkg/Name`` for a type's name in either dialect."""
    parts = type_name.strip().strip("/").split("/")
    if len(parts) == 3 and parts[1] in ("msg", "srv", "action"):
        del parts[1]
    if parts[0] == "rosapi_msgs":
        parts[0] = "rosapi"
    return "/".join(parts)


def resolve(name: str) -> str:
    """Return the absolute form of a topic's or a service's name."""
    return "/" + "/".join(part for part in name.split("/") if part)


@dataclass(frozen=True, slots=True)
class Quirks:
    """Differences from the protocol text; without any the server follows it."""

    silent: bool = False
    """A bad request is never answered; the protocol has ``op: status``."""

    bare_nan: bool = False
    """NaN in a fixed array (a covariance) is written as the token ``NaN``."""

    no_fixed_array_cbor: bool = False
    """A message with a fixed array (Odometry) is never sent as CBOR."""

    no_png: bool = False
    """A subscription with compression png gets no messages."""

    no_cbor_fragments: bool = False
    """CBOR with a fragment size is never sent."""

    no_large_cbor: bool = False
    """CBOR above ``max_message_size`` is logged and never sent; JSON comes in parts."""

    float_fragments: bool = False
    """The total of fragments is a float, and publications share the id 0."""

    escaped_slashes: bool = False
    r"""JSON has ``\/`` for every slash, as written by the ujson library."""

    lenient_numbers: bool = False
    """NaN, Infinity and 1e999 from a client reach the robot."""

    blocking_services: bool = False
    """A service call blocks other messages of its connection until it is answered."""

    blocking_goals: bool = False
    """An action goal blocks other messages of its connection until it ends."""

    unanswered_goals: bool = False
    """An action goal that is rejected, or has no server, never gets a result."""

    timed_calls: bool = False
    """A call that is not answered in time fails: ``timeout``, or 5 s without it."""

    typed_publish: bool = False
    """``publish`` with a ``type`` creates a topic that was not advertised."""

    hanging_param_names: bool = False
    """``/rosapi/get_param_names`` never answers; afterwards rosapi never answers."""

    deadly_message_details: bool = False
    """``/rosapi/message_details`` never answers, and rosapi ends."""

    spinning_queue: bool = False
    """The server hangs for ever when certain subscriptions end, in any way.

    These have a ``throttle_rate`` of 0, a ``queue_length`` above 0, and have got a
    message. rosbridge 2.1.0 hangs only if a message is queued at that moment. A test
    cannot time that, so here a message always is.
    """

    hanging_stop: bool = False
    """``/robot_N/stop`` never answers. No real server does this; it is a fault."""


POLITE = Quirks()
_EVERY = Quirks(
    silent=True, no_cbor_fragments=True, escaped_slashes=True, lenient_numbers=True
)
_ROS1 = replace(_EVERY, no_fixed_array_cbor=True, float_fragments=True)
_ROS2 = replace(_EVERY, bare_nan=True, no_large_cbor=True)
_NEWER = replace(_ROS2, timed_calls=True, typed_publish=True)
REAL = {
    "0.11": _ROS1,
    "2.1": replace(
        _ROS2,
        no_fixed_array_cbor=True,
        no_png=True,
        float_fragments=True,
        spinning_queue=True,
        blocking_services=True,
        blocking_goals=True,
        unanswered_goals=True,
        hanging_param_names=True,
        deadly_message_details=True,
    ),
    **dict.fromkeys(("2.7", "3.2", "3.3", "4.1", "4.2"), _NEWER),
}
"""The behaviour of rosbridge by version.

That of 0.11.17 and 2.1.0 was measured, that of the newer versions was read in their
source. Their differences from each other concern races, and options that WebMap does
not use, so they are the same here.
"""

USUAL = {"ros1": "0.11", "ros2": "2.1"}
"""The version that plays a dialect if no version is stated."""


def dialect_of(version: str) -> DialectName:
    """Return the dialect of a version of :data:`REAL`; a dialect is its own.

    Raises:
        ConfigError: If the version is unknown.

    """
    version = USUAL.get(version, version)
    if version not in REAL:
        raise ConfigError(f"rosbridge must be one of {list(REAL)}, got {version!r}")
    return "ros1" if version == USUAL["ros1"] else "ros2"


def parse_quirks(text: str, version: str) -> Quirks:
    """Return the quirks that ``text`` names.

    Args:
        text: ``real`` or ``polite``, then any number of ``,NAME`` to add a quirk or
            ``,-NAME`` to remove one: ``polite,bare_nan`` or ``real,-silent``.
        version: A version of :data:`REAL`, or a dialect for its usual version; selects
            the quirks of ``real``.

    Raises:
        ConfigError: If the text contains another name.

    """
    base, *changes = (part.strip() for part in text.split(","))
    if base not in ("real", "polite"):
        raise ConfigError(f"quirks must begin with 'real' or 'polite', got {text!r}")
    known = [field.name for field in fields(Quirks)]
    quirks = REAL[USUAL.get(version, version)] if base == "real" else POLITE
    for change in changes:
        name = change.removeprefix("-")
        if name not in known:
            raise ConfigError(f"no quirk is called {name!r}; there are {known}")
        quirks = replace(quirks, **{name: not change.startswith("-")})
    return quirks
