"""What was written on a link and may still lie somewhere on its way (S11). No I/O.

A link that stalls keeps what TCP has taken and delivers it when it goes on, late. How
much that can be is bounded here, whatever the link's latency: no more moving velocities
are written than may lie on the way, and what has arrived is known by two proofs.

- The bridge answers a ping. That proves what was written before the ping: a bridge
  takes what comes on one socket in order.
- The robot's ROS says a velocity back (an echo). It proves the oldest one of that value
  that was not said back yet, and all before it. Nothing tells it from what another
  says there, and others say zero as well: so an echo only makes room, an echo of zero
  not even that, and neither shows that the link lives or that a zero has arrived.
"""

from collections import deque

from webmap.base.geometry import Twist

MOST = 6
"""Moving velocities that may be on their way to one robot at once.

At 20 Hz that is a link of 300 ms, beyond which nothing moves anyway.
"""

REMEMBERED = 16
"""Velocities whose echo is still waited for, whether they are proven or not."""


class Unproven:
    """The velocities of one link that nobody knows to have arrived."""

    def __init__(self) -> None:
        self._written = 0
        self._on_the_way: dict[str, deque[tuple[int, Twist]]] = {}
        self._unechoed: dict[str, deque[tuple[int, Twist]]] = {}
        self._pings: deque[tuple[int, int, float]] = deque()

    def room(self, topic: str) -> bool:
        """Return whether one more moving velocity may be written."""
        waiting = self._on_the_way.get(topic, ())
        return sum(not twist.is_zero for _, twist in waiting) < MOST

    def wrote(self, topic: str, twist: Twist) -> None:
        """Note a velocity that went out."""
        self._written += 1
        self._on_the_way.setdefault(topic, deque()).append((self._written, twist))
        if not twist.is_zero:
            unechoed = self._unechoed.setdefault(topic, deque(maxlen=REMEMBERED))
            unechoed.append((self._written, twist))

    def pinged(self, number: int, now: float) -> None:
        """Note that a ping goes out at ``now``; their numbers grow."""
        self._pings.append((number, self._written, now))

    def ponged(self, number: int) -> float:
        """Note that a ping was answered, and so all before it.

        Returns:
            When that ping went out.

        """
        while self._pings[0][0] < number:
            self._pings.popleft()
        _, written, asked_at = self._pings.popleft()
        for waiting in self._on_the_way.values():
            _drop(waiting, written)
        return asked_at

    def echoed(self, topic: str, twist: Twist) -> None:
        """Note what is said on a topic, which may be an echo of ours."""
        unechoed = self._unechoed.get(topic, deque())
        for written, sent in unechoed:
            if sent == twist:
                _drop(unechoed, written)
                _drop(self._on_the_way[topic], written)
                return

    def begin(self) -> None:
        """Begin anew: the link was cut, and what it held with it."""
        self._on_the_way.clear()
        self._unechoed.clear()
        self._pings.clear()


def _drop(waiting: deque[tuple[int, Twist]], written: int) -> None:
    """Take what was written up to there for arrived."""
    while waiting and waiting[0][0] <= written:
        waiting.popleft()
