"""The names of types, times and headers in ROS 1 and ROS 2."""

from dataclasses import dataclass, field
from typing import Any, Literal

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
        """Whether this is the dialect of ROS 2."""
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
