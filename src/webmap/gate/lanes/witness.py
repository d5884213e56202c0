"""The witness lane: odometry in, of which only the velocity is read, and scans.

What a link has kept back is as old as that, and nothing in it says so: a robot's clock
is not the gate's. But a bridge answers a ping behind what it has said before. So what
comes after an answer was said after that ping went out, and no earlier.
"""

from collections.abc import Callable

from webmap.gate.clock import now
from webmap.gate.events import Event, Key, LinkDown, LinkUp, Measured, Scanned
from webmap.gate.lanes import scans, words
from webmap.gate.lanes.lane import Lane
from webmap.ros.rosbridge import ops
from webmap.ros.rosbridge.cbor import looks_like_cbor

THROTTLE = 50
"""Milliseconds between two messages at least."""

BUSY_PING = 0.05
"""Seconds between pings while anything is watched."""


class WitnessLane:
    """The socket of one bridge that odometry comes through.

    Args:
        url: The bridge's address.
        tell: Takes the events.

    """

    def __init__(self, url: str, tell: Callable[[Event], None]) -> None:
        self._url = url
        self._tell = tell
        self._pings: dict[int, float] = {}
        """When each ping that is not answered yet went out."""
        self._said_after = float("-inf")
        """What comes now was said after this moment."""
        self._watchers: dict[str, list[Key]] = {}
        self._scanners: dict[str, list[Key]] = {}
        self.lane = Lane(
            url,
            up=self._open,
            down=lambda: tell(LinkDown(url, "witness")),
            text=self._hear,
            pinged=self._ping,
            pong=self._answer,
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
        self._pace()

    def unwatch(self, topic: str, key: Key) -> None:
        """Undo one :meth:`watch`."""
        self._watchers[topic].remove(key)
        if not self._watchers[topic]:
            del self._watchers[topic]
        self.lane.let_go(f"webmap-gate odometry {topic}")
        self._pace()

    def watch_scan(self, topic: str, key: Key) -> None:
        """Hear what the scanner of the machine ``key`` sees."""
        self._scanners.setdefault(topic, []).append(key)
        id = f"webmap-gate scan {topic}"
        self.lane.hold(id, scans.subscribe(topic, id), ops.unsubscribe(topic, id=id))
        self._pace()

    def unwatch_scan(self, topic: str, key: Key) -> None:
        """Undo one :meth:`watch_scan`."""
        self._scanners[topic].remove(key)
        if not self._scanners[topic]:
            del self._scanners[topic]
        self.lane.let_go(f"webmap-gate scan {topic}")
        self._pace()

    def _pace(self) -> None:
        watched = self._watchers or self._scanners
        self.lane.hurry(BUSY_PING if watched else Lane.PING)

    def _open(self) -> None:
        self._pings.clear()  # what the link before held went with it
        self._said_after = now()
        self._tell(LinkUp(self._url, "witness"))

    def _ping(self, number: int) -> None:
        self._pings[number] = now()

    def _answer(self, number: int) -> None:
        self._said_after = self._pings[number]
        self._pings = {n: at for n, at in self._pings.items() if n > number}

    def _hear(self, data: bytes) -> None:
        if self._scanners and looks_like_cbor(data):
            self._hear_scan(data)
            return
        heard = words.hear(data)
        if heard is None or heard.op != "publish" or heard.topic is None:
            return
        for key in self._watchers.get(heard.topic, ()):
            self._tell(Measured(key, heard.twist, self._said_after))

    def _hear_scan(self, data: bytes) -> None:
        # A ping more is granted: the next answer would often have come with the scan.
        heard = scans.hear_scan(data, min(self._said_after + BUSY_PING, now()))
        if heard is not None:
            topic, sweep = heard
            for key in self._scanners.get(topic, ()):
                self._tell(Scanned(key, topic, sweep))
