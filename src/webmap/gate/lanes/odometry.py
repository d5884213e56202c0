"""The odometry lane: the socket of one bridge for odometry and scans.

In JSON a bridge writes ``null`` both for "nothing there" and for "broken". So the lane
subscribes to scans in CBOR and ignores a scan in JSON: the robot is then blind. A scan
of more than 720 beams is folded here, once. A scan of far too many beams is refused
before its numbers are read, and the socket accepts no frame of more than a mebibyte.

A message that a link has kept back is old, and nothing in it shows its age: a robot's
clock is not the gate's. But a bridge answers a ping after the messages that it sent
before. So a message that comes after an answer was sent after that ping, not earlier.
"""

import re
from collections.abc import Callable
from typing import Any

from webmap.base.errors import ProtocolError
from webmap.gate.clock import now
from webmap.gate.events import (
    Event,
    Key,
    LinkDown,
    LinkUp,
    OdometryReceived,
    Scan,
    ScanReceived,
)
from webmap.gate.lanes import rosbridge
from webmap.gate.lanes.lane import Lane
from webmap.gate.rules.scan_geometry import folded, too_long
from webmap.ros.rosbridge import ops
from webmap.ros.rosbridge.cbor import looks_like_cbor

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


THROTTLE = 50
"""Milliseconds between two messages at least."""

BUSY_PING = 0.05
"""Seconds between pings while a machine is watched that does not rest."""


class OdometryLane:
    """The socket of one bridge for odometry and scans.

    Args:
        url: The bridge's address.
        emit: Called with each event.

    """

    def __init__(self, url: str, emit: Callable[[Event], None]) -> None:
        self._url = url
        self._emit = emit
        self._pings: dict[int, float] = {}
        """When each unanswered ping was sent."""
        self._sent_after = float("-inf")
        """A message that comes now was sent after this time."""
        self._watchers: dict[str, list[Key]] = {}
        self._scanners: dict[str, list[Key]] = {}
        self._often: set[Key] = set()
        """The machines for which pings are needed often."""
        self.lane = Lane(
            url,
            up=self._open,
            down=lambda: emit(LinkDown(url, "odometry")),
            text=self._on_message,
            pinged=self._ping,
            pong=self._answer,
        )

    def watch(self, topic: str, type: str | None, key: Key) -> None:
        """Receive the odometry of the machine ``key``."""
        self._watchers.setdefault(topic, []).append(key)
        id = f"webmap-gate odometry {topic}"
        self.lane.hold(
            id,
            ops.subscribe(topic, id=id, type=type, throttle_rate=THROTTLE),
            ops.unsubscribe(topic, id=id),
        )
        self.ping_often(key, True)

    def unwatch(self, topic: str, key: Key) -> None:
        """Undo one :meth:`watch`."""
        self._watchers[topic].remove(key)
        if not self._watchers[topic]:
            del self._watchers[topic]
        self.lane.release_hold(f"webmap-gate odometry {topic}")
        self.ping_often(key, False)

    def watch_scan(self, topic: str, key: Key) -> None:
        """Receive the scans of the machine ``key``."""
        self._scanners.setdefault(topic, []).append(key)
        id = f"webmap-gate scan {topic}"
        self.lane.hold(id, subscribe(topic, id), ops.unsubscribe(topic, id=id))
        self.ping_often(key, True)

    def unwatch_scan(self, topic: str, key: Key) -> None:
        """Undo one :meth:`watch_scan`."""
        self._scanners[topic].remove(key)
        if not self._scanners[topic]:
            del self._scanners[topic]
        self.lane.release_hold(f"webmap-gate scan {topic}")
        self.ping_often(key, False)

    def ping_often(self, key: Key, on: bool) -> None:
        """Ping often for the machine ``key``, or end that."""
        (self._often.add if on else self._often.discard)(key)
        self.lane.ping_every(BUSY_PING if self._often else Lane.PING)
        self.lane.budget.topics = len(self._watchers) + len(self._scanners)

    def _open(self) -> None:
        self._pings.clear()  # the previous link's pings are not answered any more
        self._sent_after = now()
        self._emit(LinkUp(self._url, "odometry"))

    def _ping(self, number: int) -> None:
        self._pings[number] = now()

    def _answer(self, number: int) -> None:
        self._sent_after = self._pings[number]
        self._pings = {n: at for n, at in self._pings.items() if n > number}

    def _on_message(self, data: bytes) -> None:
        if self._scanners and looks_like_cbor(data):
            self._on_scan(data)
            return
        received = rosbridge.parse(data)
        if received is None or received.op != "publish" or received.topic is None:
            return
        for key in self._watchers.get(received.topic, ()):
            self._emit(OdometryReceived(key, received.twist, self._sent_after))

    def _on_scan(self, data: bytes) -> None:
        # One ping period is added: the next answer often comes together with the scan.
        received = parse_scan(data, min(self._sent_after + BUSY_PING, now()))
        if received is not None:
            topic, scan = received
            for key in self._scanners.get(topic, ()):
                self._emit(ScanReceived(key, topic, scan))
