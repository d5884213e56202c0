"""The bytes of the few messages that the gate exchanges with Foxglove. No I/O.

They are in CDR (ROS 2) or in the serialization of ROS 1. The layouts are fixed here: a
bridge sends the definitions of its types too, which may be anything, and the gate reads
none of them.
"""

import math
import struct
from collections.abc import Iterator, Mapping
from functools import lru_cache
from typing import Any, Literal

from webmap.base.errors import ProtocolError
from webmap.base.geometry import Twist
from webmap.gate.events import Scan
from webmap.gate.lanes.rosbridge import velocity_message
from webmap.gate.lanes.scans import FRAME_NAME
from webmap.gate.rules.scan_geometry import folded, too_long
from webmap.ros.names import split_type

Encoding = Literal["cdr", "ros1"]

MOST_KEPT = 4096
"""How many velocities are kept, because zeros repeat."""

MOST_GOALS = 1000
"""The most goals of a status that are read."""

MOST_TEXT = 1 << 16
"""The longest text that is read, in bytes."""

_BEFORE_TWIST = {
    "geometry_msgs/Twist": "",
    "geometry_msgs/TwistStamped": "h",
    "geometry_msgs/TwistWithCovarianceStamped": "h",
    "nav_msgs/Odometry": "hsp",
}
"""What comes before the velocity: a header, a text, a pose with its covariance."""


class Reader:
    """Reads the fields of one message, one after the other.

    Args:
        data: The message.
        at: Where it begins.
        encoding: Its encoding.

    Raises:
        ProtocolError: If the message is too short or in another form of CDR; from each
            method.

    """

    def __init__(self, data: bytes, at: int, encoding: Encoding) -> None:
        self._data = data
        self._cdr = encoding == "cdr"
        self._order = "<"
        if self._cdr:
            if data[at : at + 2] not in (b"\0\0", b"\0\1"):
                raise ProtocolError("a message in another form than plain CDR")
            self._order = "<" if data[at + 1] else ">"
            at += 4
        self._begin = self._at = at

    def numbers(self, code: str, count: int = 1) -> tuple[Any, ...]:
        """Return numbers of one type, by its code in :mod:`struct`."""
        self._align(struct.calcsize(f"={code}"))
        layout = f"{self._order}{count}{code}"
        at, self._at = self._at, self._at + struct.calcsize(layout)
        self._check()
        return struct.unpack_from(layout, self._data, at)

    def text(self) -> str:
        """Return a text."""
        (size,) = self.numbers("I")
        if size > MOST_TEXT:
            raise ProtocolError(f"a text of {size} bytes in a message")
        at, self._at = self._at, self._at + size
        self._check()
        return self._data[at : self._at].rstrip(b"\0").decode(errors="replace")

    def header(self) -> str:
        """Read a header and return the name of its frame."""
        self.numbers("I", 2 if self._cdr else 3)
        return self.text()

    def has(self, size: int) -> bool:
        """Return whether a number of ``size`` bytes follows."""
        self._align(size)
        return self._at + size <= len(self._data)

    def _align(self, size: int) -> None:
        if self._cdr:
            self._at += (self._begin - self._at) % size

    def _check(self) -> None:
        if self._at > len(self._data):
            raise ProtocolError(f"a message of {len(self._data)} bytes is too short")


def velocity_in(data: bytes, at: int, type: str, encoding: Encoding) -> Twist | None:
    """Return the velocity in a message, if its type has one and it is finite.

    The message begins at ``at``.

    Raises:
        ProtocolError: If it is too short or in another form of CDR.

    """
    before = _BEFORE_TWIST.get(str(split_type(type)))
    if before is None:
        return None
    reader = Reader(data, at, encoding)
    for part in before:
        if part == "h":
            reader.header()
        elif part == "s":
            reader.text()
        else:
            reader.numbers("d", 7 + 36)
    vx, vy, vz, wx, wy, wz = reader.numbers("d", 6)
    if not all(map(math.isfinite, (vx, vy, wz))):
        return None
    return Twist(vx, vy, wz, vz, wx, wy)


def scan_in(data: bytes, at: int, encoding: Encoding, now: float) -> Scan:
    """Return the scan in a message, folded; a ``refused`` one has no ranges.

    Args:
        data: The bytes that contain the message.
        at: Where the message begins.
        encoding: Its encoding.
        now: When it counts as received.

    Raises:
        ProtocolError: If it is too short or in another form of CDR.

    """
    reader = Reader(data, at, encoding)
    frame = reader.header()
    least, _, step, _, _, near, far = reader.numbers("f", 7)
    (count,) = reader.numbers("I")
    refused = too_long(count)
    ranges = () if refused else reader.numbers("f", count)
    name = frame[:FRAME_NAME].removeprefix("/")
    return folded(
        Scan(least, step, near, far, ranges, now, refused=refused, frame=name)
    )


def actionlib_in(data: bytes, at: int, type: str, encoding: Encoding) -> Any:
    """Return the fields that matter of a message about a goal of move_base.

    The message begins at ``at``. One of another type gives ``None``.

    Raises:
        ProtocolError: If it is too short or in another form of CDR.

    """
    reader, name = Reader(data, at, encoding), split_type(type).name
    if name not in (
        "GoalStatusArray",
        "MoveBaseActionFeedback",
        "MoveBaseActionResult",
    ):
        return None
    reader.header()
    if name == "GoalStatusArray":
        (count,) = reader.numbers("I")
        return {"status_list": [_status(reader) for _ in range(min(count, MOST_GOALS))]}
    status = _status(reader)
    if name == "MoveBaseActionResult":
        return {"status": status}
    header = {"frame_id": reader.header()}
    x, y, _ = reader.numbers("d", 3)
    position = {"header": header, "pose": {"position": {"x": x, "y": y}}}
    return {"status": status, "feedback": {"base_position": position}}


def _status(reader: Reader) -> dict[str, Any]:
    reader.numbers("I", 2)
    id = {"id": reader.text()}
    (status,) = reader.numbers("B")
    return {"goal_id": id, "status": status, "text": reader.text()}


def accepted(data: bytes) -> bool:
    """Return whether an action accepted a goal, by its answer in CDR.

    Raises:
        ProtocolError: If it is too short or in another form of CDR.

    """
    return bool(Reader(data, 0, "cdr").numbers("B")[0])


def action_feedback(data: bytes, at: int) -> tuple[bytes, dict[str, Any]]:
    """Return the identifier of a goal and the fields of its feedback that matter.

    The message of ``NavigateToPose`` begins at ``at`` and is in CDR.

    Raises:
        ProtocolError: If it is too short or in another form of CDR.

    """
    reader = Reader(data, at, "cdr")
    id = bytes(reader.numbers("B", 16))
    reader.header()
    reader.numbers("d", 7)  # the pose
    begun, rest = _duration(reader), _duration(reader)
    (recoveries,) = reader.numbers("h")
    (left,) = reader.numbers("f")
    return id, {
        "navigation_time": begun,
        "estimated_time_remaining": rest,
        "number_of_recoveries": recoveries,
        "distance_remaining": left,
    }


def _duration(reader: Reader) -> dict[str, Any]:
    (seconds,), (nanoseconds,) = reader.numbers("i"), reader.numbers("I")
    return {"sec": seconds, "nanosec": nanoseconds}


def action_result(data: bytes) -> tuple[int, dict[str, Any]]:
    """Return the status of a goal that has ended, and the fields of its result.

    Nav2 has an error code since Iron, and a text since Kilted.

    Raises:
        ProtocolError: If it is too short or in another form of CDR.

    """
    reader, fields = Reader(data, 0, "cdr"), {}
    (status,) = reader.numbers("b")
    if reader.has(2):
        fields["error_code"] = reader.numbers("H")[0]
    if reader.has(4):
        fields["error_msg"] = reader.text()
    return status, fields


def trigger_result(data: bytes, encoding: Encoding) -> tuple[bool, str]:
    """Return the answer of a service of type Trigger: success, and a text.

    Raises:
        ProtocolError: If it is too short or in another form of CDR.

    """
    reader = Reader(data, 0, encoding)
    (success,) = reader.numbers("B")
    return bool(success), reader.text()


def serialized(message: Mapping[str, Any], encoding: Encoding) -> bytes:
    """Return the bytes of a message that has all its fields, in their order.

    Args:
        message: Its fields: float64, 32-bit integers, texts, booleans, bytes, arrays of
            these of a fixed size, and messages. A header has no ``seq``.
        encoding: The encoding.

    """
    cdr = encoding == "cdr"
    data = bytearray(b"\0\1\0\0" if cdr else b"")
    for value in _values(message, cdr):
        if isinstance(value, bool):
            data.append(value)
        elif isinstance(value, bytes):
            data += value
        elif isinstance(value, float):
            data += bytes((4 - len(data)) % 8 if cdr else 0) + struct.pack("<d", value)
        elif isinstance(value, str):
            text = value.encode() + (b"\0" if cdr else b"")
            data += bytes(-len(data) % 4 if cdr else 0)
            data += struct.pack("<I", len(text)) + text
        else:
            data += bytes(-len(data) % 4 if cdr else 0) + struct.pack("<i", value)
    return bytes(data)


def _values(message: Mapping[str, Any], cdr: bool) -> Iterator[Any]:
    for name, value in message.items():
        if name == "header" and not cdr:
            yield 0  # seq
        if isinstance(value, Mapping):
            yield from _values(value, cdr)
        elif isinstance(value, list):
            yield from value
        else:
            yield value


@lru_cache(maxsize=MOST_KEPT)
def velocity(type: str, twist: Twist, frame: str, encoding: Encoding) -> bytes:
    """Return the bytes of a velocity, in the frame of the base."""
    floats = Twist(*map(float, twist.numbers))
    return serialized(velocity_message(type, floats, frame), encoding)
