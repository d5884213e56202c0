"""What a bridge says of a laser scan, in CBOR, for scan assist. No I/O.

Over JSON a bridge writes ``null`` for "nothing there" and for "broken" alike, so scans
are asked for in CBOR, and one that comes in JSON is no scan here: the robot is blind.
"""

from webmap.errors import ProtocolError
from webmap.gate.events import Sweep
from webmap.ros import ops

THROTTLE = 100
"""Milliseconds between two scans at least."""

TYPE = "sensor_msgs/LaserScan"

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
    """Return the topic and the scan of a frame; None if it is anything else."""
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
    ranges = message.get("ranges")
    if not all(isinstance(number, float | int) for number in numbers):
        return None
    try:
        values = [float(reach) for reach in ranges or ()]
    except (TypeError, ValueError):
        return None
    least, step, near, far = (float(number) for number in numbers if number is not None)
    return topic, Sweep(least, step, near, far, values, now)
