"""The control lane: the socket of one bridge for velocity.

A link that stalls keeps the bytes that TCP has accepted and delivers them late, when it
goes on. The control lane limits how many these can be, whatever the link's latency: it
writes no more than :data:`MOST` moving velocities that are not known to have arrived.
Two things prove arrival.

- The bridge answers a ping. That proves everything written before the ping, because a
  bridge processes the messages of one socket in order. With a bridge that answers pings
  apart from its messages, it proves nothing (``rules/delivery``).
- The velocity comes back from the robot's ROS (an echo). That proves the oldest
  velocity of this value that has no echo yet, and all before it. But an echo looks the
  same as a velocity from another publisher, and others publish zero as well. So an echo
  only makes room, an echo of zero not even that, and neither proves that the link works
  or that a zero has arrived.
"""

import math
from collections import deque
from collections.abc import Callable, Mapping

from webmap.base.geometry import Twist
from webmap.gate.clock import now
from webmap.gate.events import EchoReceived, Event, Key, LinkDown, LinkUp, PingAnswered
from webmap.gate.lanes.wires import wire_to
from webmap.gate.rules.motion import ZERO

MOST = 6
"""Moving velocities to one topic that may be unconfirmed at once.

At 20 Hz that is a link of 300 ms; at a longer latency nothing moves anyway.
"""

REMEMBERED = 16
"""Velocities whose echo is still expected, whether their arrival is proven or not."""


class UnconfirmedWrites:
    """The velocities of one link that are not known to have arrived."""

    def __init__(self) -> None:
        self._written = 0
        self._on_the_way: dict[str, deque[tuple[int, Twist]]] = {}
        self._unechoed: dict[str, deque[tuple[int, Twist]]] = {}
        self._pings: deque[tuple[int, int, float]] = deque()

    def room(self, topic: str) -> bool:
        """Return whether one more moving velocity may be written."""
        return len(self._on_the_way.get(topic, ())) < MOST

    def on_written(self, topic: str, twist: Twist) -> None:
        """Note a velocity that was written; a zero takes no room."""
        if twist.is_zero:
            return
        self._written += 1
        self._on_the_way.setdefault(topic, deque()).append((self._written, twist))
        unechoed = self._unechoed.setdefault(topic, deque(maxlen=REMEMBERED))
        unechoed.append((self._written, twist))

    def on_ping(self, number: int, now: float) -> None:
        """Note that a ping is written at ``now``; the numbers of pings grow."""
        self._pings.append((number, self._written, now))

    def on_pong(self, number: int, *, proves: bool = True) -> float:
        """Note the answer to a ping, which confirms all that was written before it.

        Args:
            number: The number of the ping.
            proves: Whether it confirms anything, see ``rules/delivery``.

        Returns:
            When that ping was written.

        """
        while self._pings[0][0] < number:
            self._pings.popleft()
        _, written, asked_at = self._pings.popleft()
        for waiting in self._on_the_way.values() if proves else ():
            _drop(waiting, written)
        return asked_at

    def echoed(self, topic: str, twist: Twist) -> None:
        """Note a velocity received from a topic, which may be an echo of the gate's."""
        unechoed = self._unechoed.get(topic, deque())
        for written, sent in unechoed:
            if sent == twist:
                _drop(unechoed, written)
                _drop(self._on_the_way[topic], written)
                return

    def begin(self) -> None:
        """Start again: the link was cut, and the bytes in it are lost."""
        self._on_the_way.clear()
        self._unechoed.clear()
        self._pings.clear()


def _drop(waiting: deque[tuple[int, Twist]], written: int) -> None:
    """Remove the velocities up to number ``written``: they have arrived."""
    while waiting and waiting[0][0] <= written:
        waiting.popleft()


BUSY_PING = 0.05
"""Seconds between pings while a machine behind the lane has a holder."""

IDLE_PING = 0.5
"""Seconds between pings otherwise; well below the time after which a stall is cut."""


ECHO = 20
"""Milliseconds between two echoes at least: as fast as the gate writes, and a limit
for other publishers that write without a pause."""


class ControlLane:
    """The socket of one bridge for velocity.

    Args:
        url: The bridge's address.
        emit: Called with each event.

    """

    def __init__(self, url: str, emit: Callable[[Event], None]) -> None:
        self._url = url
        self._emit = emit
        self._attached: dict[str, list[tuple[str, bool]]] = {}
        """For each topic, the declared types and whether each is only assumed."""
        self._types: dict[str, str] = {}
        """The type that each topic is announced with."""
        self._listened: set[str] = set()
        self._unconfirmed = UnconfirmedWrites()
        self._wire = wire_to(
            url,
            up=self._open,
            down=self._lost,
            text=self._on_message,
            pinged=self._ping,
            pong=self._answer,
        )
        self.lane = self._wire.lane
        self.lane.ping_every(IDLE_PING)

    def attach(self, topic: str, type: str, assumed: bool = False) -> None:
        """Announce that velocity will be written to ``topic``.

        Args:
            topic: The topic.
            type: Its type.
            assumed: Whether the type is only assumed: a known type takes precedence.

        """
        self._attached.setdefault(topic, []).append((type, assumed))
        self._announce(topic)

    def detach(self, topic: str, type: str, assumed: bool = False) -> None:
        """Undo one :meth:`attach`."""
        self._attached[topic].remove((type, assumed))
        self._announce(topic)

    def _announce(self, topic: str) -> None:
        """Announce the type of a topic, if it has changed.

        The gate also subscribes to the topic, to notice other publishers before an
        operator drives. It subscribes first: a bridge of ROS 2 that already publishes
        would subscribe with a quality of service that most publishers do not match.
        """
        announced, attached = self._types.get(topic), self._attached[topic]
        known = [type for type, assumed in attached if not assumed]
        types = known or [type for type, _ in attached]
        type = types[-1] if types else None
        if type == announced:
            return
        if announced is not None:
            self._wire.release(f"webmap-gate advertise {topic} {announced}")
            self._wire.release(f"webmap-gate echo {topic} {announced}")
            del self._types[topic]
        if type is not None:
            self._wire.subscribe(f"webmap-gate echo {topic} {type}", topic, type, ECHO)
            self._wire.advertise(f"webmap-gate advertise {topic} {type}", topic, type)
            self._types[topic] = type
        self.lane.budget.topics = len(self._types)

    def listen(self, topic: str) -> None:
        """Ping often from now on: ``topic`` may be written to."""
        self._listened.add(topic)
        self.lane.ping_every(BUSY_PING)

    def ignore(self, topic: str) -> None:
        """Undo :meth:`listen`, if that was called."""
        self._listened.discard(topic)
        if not self._listened:
            self.lane.ping_every(IDLE_PING)

    def write(
        self, topic: str, twist: Twist, until: float = math.inf, frame: str = ""
    ) -> bool:
        """Write a velocity now or drop it; return whether it was written.

        A zero may wait behind other bytes and is never too old. Any other velocity is
        dropped if it would wait, if too many are unconfirmed, or if it is too old.

        Args:
            topic: The velocity topic.
            twist: The velocity.
            until: When it is too old, by the gate's clock.
            frame: The frame of the robot's base, which a stamped velocity names.

        """
        type = self._types.get(topic)
        if type is None or not (twist.is_zero or self._unconfirmed.room(topic)):
            return False
        data = self._wire.velocity(topic, type, twist, frame)
        if data is None:
            return False
        if twist.is_zero:
            until = math.inf
        done = self.lane.write(data, only_if_clear=not twist.is_zero, until=until)
        if done:
            self._unconfirmed.on_written(topic, twist)
        return done

    def write_zeros(self, frames: Mapping[Key, str]) -> list[Key]:
        """Write zeros to machines, given with their frames; return which got one."""
        zeros: dict[Key, bytes] = {}
        for key, frame in frames.items():
            type = self._types.get(key.topic)
            zero = type and self._wire.velocity(key.topic, type, ZERO, frame)
            if zero:
                zeros[key] = zero
        done = self.lane.write(*zeros.values(), only_if_clear=False)
        return list(zeros) if done else []

    def _lost(self) -> None:
        # Here, because the next link may be pinged before the bridge calls it open.
        self._unconfirmed.begin()  # the bytes in the link are lost
        self._emit(LinkDown(self._url, "control"))

    def _open(self) -> None:
        self._emit(LinkUp(self._url, "control", self._wire.only_echoes))

    def _ping(self, number: int) -> None:
        self._unconfirmed.on_ping(number, now())

    def _answer(self, number: int) -> None:
        proves = not self._wire.only_echoes
        asked_at = self._unconfirmed.on_pong(number, proves=proves)
        self._emit(PingAnswered(self._url, asked_at))

    def _on_message(self, data: bytes) -> None:
        message = self._wire.read_velocity(data)
        if message is None:
            return
        topic, twist = message
        if topic not in self._types or twist is None or not twist.is_finite:
            return
        self._unconfirmed.echoed(topic, twist)
        self._emit(EchoReceived(Key(self._url, topic), twist))
