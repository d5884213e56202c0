"""What a bridge says of a laser scan, in CBOR, for scan assist. No I/O.

Over JSON a bridge writes ``null`` for "nothing there" and for "broken" alike, so scans
are asked for in CBOR, and one that comes in JSON is no scan here: the robot is blind.
One of many beams is folded to at most 720 here, once; one of far too many is refused
before its numbers are read, and the socket takes no frame of more than a mebibyte.
"""

from typing import Any

from webmap.errors import ProtocolError
from webmap.gate.events import Sweep
from webmap.gate.rules.folding import folded, too_long
from webmap.ros import ops

THROTTLE = 100
"""Milliseconds between two scans at least."""

TYPE = "sensor_msgs/LaserScan"

NAME = 80
"""The longest name of a frame that is kept, in characters."""

_FIELDS = ("angle_min", "angle_increment", "range_min", "range_max")


def subscribe(topic: str, id: str) -> bytes:
    """Return the operation that asks for the scans of a topic."""
    return ops.subscribe(
        topic,
        id=id,
        type=TYPE,
        throttle_rate=THROTTLE,
        queue_length=1,
        compression="cbor",
    )


def hear_scan(frame: bytes, now: float) -> tuple[str, Sweep] | None:
    """Return the topic and the scan of a frame; None if it is anything else.

    A scan of more than 720 beams comes folded; what is ``refused`` has no ranges.
    """
    from webmap.ros import cbor

    if not cbor.looks_like_cbor(frame):
        return None
    try:
        operation = cbor.decode(frame)
    except ProtocolError:
        return None
    topic, message = operation.get("topic"), operation.get("msg")
    if operation.get("op") != "publish" or not isinstance(topic, str):
        return None
    if not isinstance(message, dict):
        return None
    numbers = [message.get(field) for field in _FIELDS]
    ranges = message.get("ranges") or ()
    if not all(isinstance(number, float | int) for number in numbers):
        return None
    try:
        refused = too_long(len(ranges))
        values = [] if refused else [float(reach) for reach in ranges]
        about = [float(number) for number in numbers if number is not None]
    except (TypeError, ValueError, OverflowError):
        return None
    least, step, near, far = about
    frame_id = _frame_of(message.get("header"))
    sweep = Sweep(least, step, near, far, values, now, refused=refused, frame=frame_id)
    return topic, folded(sweep)


def _frame_of(header: Any) -> str:
    frame = header.get("frame_id") if isinstance(header, dict) else None
    return frame[:NAME].removeprefix("/") if isinstance(frame, str) else ""
