"""The witness lane: odometry in, of which only the velocity is read, and scans."""

from collections.abc import Callable

from webmap.gate.clock import now
from webmap.gate.events import Event, Key, LinkDown, LinkUp, Measured, Scanned
from webmap.gate.lanes import scans, words
from webmap.gate.lanes.lane import Lane
from webmap.ros import ops
from webmap.ros.cbor import looks_like_cbor

THROTTLE = 50
"""Milliseconds between two messages at least."""


class WitnessLane:
    """The socket of one bridge that odometry comes through.

    Args:
        url: The bridge's address.
        tell: Takes the events.

    """

    def __init__(self, url: str, tell: Callable[[Event], None]) -> None:
        self._tell = tell
        self._watchers: dict[str, list[Key]] = {}
        self._scanners: dict[str, list[Key]] = {}
        self.lane = Lane(
            url,
            up=lambda: tell(LinkUp(url, "witness")),
            down=lambda: tell(LinkDown(url, "witness")),
            text=self._hear,
        )

    def watch(self, topic: str, type: str | None, key: Key) -> None:
        """Hear how the machine ``key`` moves."""
        self._watchers.setdefault(topic, []).append(key)
        id = f"webmap-gate odometry {topic}"
        self.lane.hold(
            id,
            ops.subscribe(topic, id=id, type=type, throttle_rate=THROTTLE),
            ops.unsubscribe(topic, id=id),
        )

    def unwatch(self, topic: str, key: Key) -> None:
        """Undo one :meth:`watch`."""
        self._watchers[topic].remove(key)
        if not self._watchers[topic]:
            del self._watchers[topic]
        self.lane.let_go(f"webmap-gate odometry {topic}")

    def watch_scan(self, topic: str, key: Key) -> None:
        """Hear what the scanner of the machine ``key`` sees."""
        self._scanners.setdefault(topic, []).append(key)
        id = f"webmap-gate scan {topic}"
        self.lane.hold(id, scans.subscribe(topic, id), ops.unsubscribe(topic, id=id))

    def unwatch_scan(self, topic: str, key: Key) -> None:
        """Undo one :meth:`watch_scan`."""
        self._scanners[topic].remove(key)
        if not self._scanners[topic]:
            del self._scanners[topic]
        self.lane.let_go(f"webmap-gate scan {topic}")

    def _hear(self, data: bytes) -> None:
        if self._scanners and looks_like_cbor(data):
            self._hear_scan(data)
            return
        heard = words.hear(data)
        if heard is None or heard.op != "publish" or heard.topic is None:
            return
        for key in self._watchers.get(heard.topic, ()):
            self._tell(Measured(key, heard.twist))

    def _hear_scan(self, data: bytes) -> None:
        heard = scans.hear_scan(data, now())
        if heard is not None:
            topic, sweep = heard
            for key in self._scanners.get(topic, ()):
                self._tell(Scanned(key, topic, sweep))
