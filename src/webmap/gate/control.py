"""The control lane: velocity out, its echo back, and nothing else."""

from collections import deque
from collections.abc import Callable

from webmap.gate import words
from webmap.gate.events import Alive, Echoed, Event, Key, LinkDown, LinkUp
from webmap.gate.lanes import Lane
from webmap.geometry import Twist
from webmap.ros import ops

BUSY_PING = 0.1
"""Seconds between pings while somebody holds a lease on a machine behind the lane."""

IDLE_PING = 0.5
"""Seconds between pings otherwise; well below the time after which a stall is cut."""


class ControlLane:
    """The socket of one bridge that velocity goes through.

    Args:
        url: The bridge's address.
        tell: Takes the events.

    """

    def __init__(self, url: str, tell: Callable[[Event], None]) -> None:
        self._url = url
        self._tell = tell
        self._types: dict[str, str] = {}
        self._listened: dict[str, deque[Twist]] = {}
        self.lane = Lane(
            url,
            up=lambda: tell(LinkUp(url, "control")),
            down=lambda: tell(LinkDown(url, "control")),
            text=self._hear,
            pong=lambda: tell(Alive(url)),
        )
        self.lane.hurry(IDLE_PING)

    def attach(self, topic: str, type: str) -> None:
        """Announce that velocity will be written to ``topic``."""
        self._types[topic] = type
        id = f"webmap-gate advertise {topic} {type}"
        self.lane.hold(
            id, ops.advertise(topic, type, id=id), ops.unadvertise(topic, id=id)
        )

    def detach(self, topic: str, type: str) -> None:
        """Undo one :meth:`attach`."""
        self.lane.let_go(f"webmap-gate advertise {topic} {type}")

    def listen(self, topic: str) -> None:
        """Hear what is said on ``topic``, ours and others'."""
        self._listened[topic] = deque(maxlen=16)
        id = f"webmap-gate echo {topic}"
        self.lane.hold(
            id,
            ops.subscribe(topic, id=id, type=self._types[topic]),
            ops.unsubscribe(topic, id=id),
        )
        self.lane.hurry(BUSY_PING)

    def ignore(self, topic: str) -> None:
        """Undo :meth:`listen`."""
        del self._listened[topic]
        self.lane.let_go(f"webmap-gate echo {topic}")
        if not self._listened:
            self.lane.hurry(IDLE_PING)

    def write(self, topic: str, twist: Twist) -> bool:
        """Write a velocity now or drop it; return whether it went out.

        Zero may wait behind other bytes, anything else may not.
        """
        data = words.velocity(topic, self._types[topic], twist)
        done = self.lane.write(data, only_if_clear=not twist.is_zero)
        if done and topic in self._listened:
            self._listened[topic].append(twist)
        return done

    def _hear(self, data: bytes) -> None:
        heard = words.hear(data)
        if heard is None or heard.topic not in self._listened or heard.twist is None:
            return
        if heard.twist in self._listened[heard.topic]:
            self._tell(Alive(self._url))
        self._tell(Echoed(Key(self._url, heard.topic), heard.twist))
