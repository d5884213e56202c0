"""The odometry lane: the socket of one bridge for odometry and scans.

A rosbridge sends scans in CBOR, see ``scans``. A scan of more than 720 beams is folded
before the rules get it.

A message that a link has kept back is old, and nothing in it shows its age: a robot's
clock is not the gate's. But a bridge answers a ping after the messages that it sent
before. So a message that comes after an answer was sent after that ping, not earlier.
"""

from collections.abc import Callable

from webmap.gate.clock import now
from webmap.gate.events import (
    Event,
    Key,
    LinkDown,
    LinkUp,
    OdometryReceived,
    ScanReceived,
)
from webmap.gate.lanes.lane import Lane
from webmap.gate.lanes.wires import wire_to

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
        self._wire = wire_to(
            url,
            up=self._open,
            down=self._lost,
            text=self._on_message,
            pinged=self._ping,
            pong=self._answer,
        )
        self.lane = self._wire.lane

    def watch(self, topic: str, type: str | None, key: Key) -> None:
        """Receive the odometry of the machine ``key``."""
        self._watchers.setdefault(topic, []).append(key)
        self._wire.subscribe(f"webmap-gate odometry {topic}", topic, type, THROTTLE)
        self.ping_often(key, True)

    def unwatch(self, topic: str, key: Key) -> None:
        """Undo one :meth:`watch`."""
        self._watchers[topic].remove(key)
        if not self._watchers[topic]:
            del self._watchers[topic]
        self._wire.release(f"webmap-gate odometry {topic}")
        self.ping_often(key, False)

    def watch_scan(self, topic: str, key: Key) -> None:
        """Receive the scans of the machine ``key``."""
        self._scanners.setdefault(topic, []).append(key)
        self._wire.subscribe_scans(f"webmap-gate scan {topic}", topic)
        self.ping_often(key, True)

    def unwatch_scan(self, topic: str, key: Key) -> None:
        """Undo one :meth:`watch_scan`."""
        self._scanners[topic].remove(key)
        if not self._scanners[topic]:
            del self._scanners[topic]
        self._wire.release(f"webmap-gate scan {topic}")
        self.ping_often(key, False)

    def ping_often(self, key: Key, on: bool) -> None:
        """Ping often for the machine ``key``, or end that."""
        (self._often.add if on else self._often.discard)(key)
        self.lane.ping_every(BUSY_PING if self._often else Lane.PING)
        self.lane.budget.topics = len(self._watchers) + len(self._scanners)

    def _lost(self) -> None:
        self._pings.clear()  # they are not answered any more
        self._emit(LinkDown(self._url, "odometry"))

    def _open(self) -> None:
        self._sent_after = now()
        self._emit(LinkUp(self._url, "odometry"))

    def _ping(self, number: int) -> None:
        self._pings[number] = now()

    def _answer(self, number: int) -> None:
        self._sent_after = self._pings[number]
        self._pings = {n: at for n, at in self._pings.items() if n > number}

    def _on_message(self, data: bytes) -> None:
        if self._scanners and self._wire.is_scan(data):
            self._on_scan(data)
            return
        received = self._wire.read_velocity(data)
        if received is None:
            return
        topic, twist = received
        for key in self._watchers.get(topic, ()):
            self._emit(OdometryReceived(key, twist, self._sent_after))

    def _on_scan(self, data: bytes) -> None:
        # One ping period is added: the next answer often comes together with the scan.
        at = min(self._sent_after + BUSY_PING, now())
        received = self._wire.read_scan(data, at)
        if received is not None:
            topic, scan = received
            for key in self._scanners.get(topic, ()):
                self._emit(ScanReceived(key, topic, scan))
