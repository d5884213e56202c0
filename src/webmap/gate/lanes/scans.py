"""Scans in the CBOR of a rosbridge. No I/O.

In JSON a bridge writes ``null`` both for "nothing there" and for "broken". So the
odometry lane subscribes to scans in CBOR and ignores a scan in JSON: the robot is then
blind. A scan of far too many beams is refused before its numbers are read, and the
socket accepts no frame of more than a mebibyte.
"""

import re
from typing import Any

from webmap.base.errors import ProtocolError
from webmap.gate.events import Scan
from webmap.gate.rules.scan_geometry import folded, too_long
from webmap.ros.rosbridge import ops

SCAN_THROTTLE = 100
"""Milliseconds between two scans at least."""

SCAN_TYPE = "sensor_msgs/LaserScan"

FRAME_NAME = 80
"""The longest name of a frame that is kept, in characters."""

MOST_PARTS = 1000
"""The most maps, lists, texts and typed arrays in the message of a scan, which has
about 40."""

MOST_NUMBERS = 250_000
"""The most numbers in its lists and maps: enough for two lists of the longest scan."""

# A run of integers, floats and simple values in CBOR (RFC 8949, 3.1), with their heads.
_NUMBERS = re.compile(
    rb"(?:[\x00-\x17\x20-\x37\xf4-\xf7]*+(?:\xfb.{8})*+(?:\xfa.{4})*+"
    rb"(?:[\x19\x39\xf9]..)*+(?:[\x18\x38].)*+(?:[\x1a\x3a].{4})*+"
    rb"(?:[\x1b\x3b].{8})*+)*+",
    re.DOTALL,
)
_FURTHER = {24: 1, 25: 2, 26: 4, 27: 8}
"""By the low bits of a head, how many further bytes contain its number."""
_STRINGS, _LISTS_AND_MAPS = (2, 3), (4, 5)
_ENDLESS = 31
"""The low bits of a head of indefinite length."""

_FIELDS = ("angle_min", "angle_increment", "range_min", "range_max")


def subscribe(topic: str, id: str) -> bytes:
    """Return the operation that subscribes to the scans of a topic."""
    return ops.subscribe(
        topic,
        id=id,
        type=SCAN_TYPE,
        throttle_rate=SCAN_THROTTLE,
        queue_length=1,
        compression="cbor",
    )


def check_parts(frame: bytes) -> None:
    """Check that CBOR contains little besides numbers.

    A mebibyte of empty lists takes 0.6 s to decode, one of numbers 10 ms. So everything
    else is counted first, which takes at most a millisecond.

    Raises:
        ProtocolError: If it contains too much else, or too many numbers in lists.

    """
    at = parts = numbers = 0
    while (at := _NUMBERS.match(frame, at).end()) < len(frame):  # type: ignore[union-attr]
        kind, low = frame[at] >> 5, frame[at] & 31
        further = _FURTHER.get(low, 0)
        at += 1 + further
        size = int.from_bytes(frame[at - further : at], "big") if further else low
        parts += 1
        if kind in _STRINGS:
            at = min(at + size, len(frame))  # it may claim 2**64 bytes
        elif kind in _LISTS_AND_MAPS:
            numbers += size
        if parts > MOST_PARTS or numbers > MOST_NUMBERS or low == _ENDLESS:
            raise ProtocolError(
                f"a scan in CBOR with lists of unknown length, more than {MOST_PARTS} "
                f"lists, maps and texts, or more than {MOST_NUMBERS} numbers"
            )


def parse_scan(frame: bytes, now: float) -> tuple[str, Scan] | None:
    """Return the topic and the scan in a frame; None if the frame has no scan.

    A scan of more than 720 beams is folded; a ``refused`` scan has no ranges.

    Raises:
        ProtocolError: If it is invalid CBOR, nested too deeply, or has too many parts.

    """
    from webmap.ros.rosbridge import cbor

    if not cbor.looks_like_cbor(frame):
        return None
    check_parts(frame)
    operation = cbor.decode(frame)
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
    scan = Scan(least, step, near, far, values, now, refused=refused, frame=frame_id)
    return topic, folded(scan)


def _frame_of(header: Any) -> str:
    frame = header.get("frame_id") if isinstance(header, dict) else None
    return frame[:FRAME_NAME].removeprefix("/") if isinstance(frame, str) else ""
