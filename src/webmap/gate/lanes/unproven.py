"""What was written on a link and may still lie somewhere on its way (S11). No I/O.

A link that stalls keeps what TCP has taken and delivers it when it goes on, late. How
much that can be is bounded here, whatever the link's latency: no more moving velocities
are written than may lie on the way, and what has arrived is known by two proofs.

- The robot's ROS says a velocity back (an echo). It proves the oldest one of that value
  that is not proven yet, and all before it.
- The bridge answers a ping. That proves what was written before the ping: a bridge
  takes what comes on one socket in order.
"""

from collections import deque

from webmap.geometry import Twist

MOST = 6
"""Moving velocities that may be on their way to one robot at once.

At 20 Hz that is a link of 300 ms, beyond which nothing moves anyway.
"""

REMEMBERED = 16
"""Velocities whose echo is known for an answer to ours, proven or not."""


class Unproven:
    """The velocities of one link that nobody knows to have arrived."""

    def __init__(self) -> None:
        self._written = 0
        self._on_the_way: dict[str, deque[tuple[int, Twist]]] = {}
        self._said: dict[str, deque[Twist]] = {}
        self._pings: deque[tuple[int, int]] = deque()

    def room(self, topic: str) -> bool:
        """Return whether one more moving velocity may be written."""
        waiting = self._on_the_way.get(topic, ())
        return sum(not twist.is_zero for _, twist in waiting) < MOST

    def wrote(self, topic: str, twist: Twist) -> None:
        """Note a velocity that went out."""
        self._written += 1
        self._said.setdefault(topic, deque(maxlen=REMEMBERED)).append(twist)
        self._on_the_way.setdefault(topic, deque()).append((self._written, twist))

    def pinged(self, number: int) -> None:
        """Note that a ping went out; their numbers grow."""
        self._pings.append((number, self._written))

    def ponged(self, number: int) -> None:
        """Note that a ping was answered, and so all before it."""
        written = 0
        while self._pings and self._pings[0][0] <= number:
            written = self._pings.popleft()[1]
        for waiting in self._on_the_way.values():
            while waiting and waiting[0][0] <= written:
                waiting.popleft()

    def echoed(self, topic: str, twist: Twist) -> bool:
        """Return whether what is said on a topic is an echo of ours, and note that."""
        waiting = self._on_the_way.get(topic, deque())
        if any(sent == twist for _, sent in waiting):
            while waiting.popleft()[1] != twist:
                pass
            return True
        return twist in self._said.get(topic, ())

    def begin(self) -> None:
        """Begin anew: the link was cut, and what it held with it."""
        self._on_the_way.clear()
        self._said.clear()
        self._pings.clear()
