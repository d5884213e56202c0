"""Whether another program publishes velocities to a machine. No I/O.

What comes back on the velocity topic is an echo of the gate's own, or another's. An
echo may come late, twice, with its digits rounded, and many at once after a stall. So
each velocity that the gate wrote explains two that are heard, within a minute, and what
none explains is another's.
"""

import math
from collections import deque
from dataclasses import astuple
from itertools import product

from webmap.base.geometry import Twist

ECHOES = 2
"""How many echoes one velocity explains: two subscriptions may say it twice."""

MOST_ECHOES = 32
"""How many echoes all velocities of one value explain. More are never under way."""

REMEMBERED = 60.0
"""Seconds after which an own velocity explains no echo any more."""

DIGITS = 3
"""The decimals to which velocities are compared."""

ROUNDING = 1e-5
"""What an echo may differ by, as bridges write numbers with fewer digits."""

SURE = 2
"""How many velocities of another make sure that there is one."""

WITHIN = 3.0
"""Seconds within which these come, and after the last of which the other is gone."""

GRACE = 2.0
"""Seconds for which velocities of others are expected after a reason for them."""

MOST_NODES = 3
"""How many nodes are named."""

MOST_NAME = 80
"""The longest name of a node, in characters."""


class OtherWriter:
    """Tells another's velocities from the echoes of the gate's own.

    A zero is never another's: it moves nothing, and many programs send it.
    """

    def __init__(self) -> None:
        self.seen: Twist | None = None
        """The newest velocity of another program, while there is one."""
        self.nodes: tuple[str, ...] | None = None
        """The nodes that publish it; empty if it comes over the bridge as well."""
        self._own: dict[tuple[float, ...], tuple[int, float]] = {}
        """By value, oldest first: echoes to come, and when it was written last."""
        self._heard_at: deque[float] = deque(maxlen=SURE)
        self._expected_until = float("-inf")

    def wrote(self, twist: Twist, now: float) -> None:
        """Note a velocity that the gate wrote."""
        if twist.is_zero:
            return
        for value in _rounded(twist):
            left, _ = self._own.pop(value, (0, now))
            self._own[value] = (min(left + ECHOES, MOST_ECHOES), now)
        while now - next(iter(self._own.values()))[1] > REMEMBERED:
            del self._own[next(iter(self._own))]

    def expect(self, until: float) -> None:
        """Note that until then velocities of others are no news."""
        self._expected_until = max(self._expected_until, until)

    def heard(self, twist: Twist, now: float) -> None:
        """Take in a velocity that was heard on the topic."""
        if twist.is_zero:
            return
        for value in _rounded(twist):
            left, at = self._own.get(value, (0, now))
            if left and now - at <= REMEMBERED:
                self._own[value] = (left - 1, at)
                return
        if now < self._expected_until:
            return
        self._heard_at.append(now)
        if len(self._heard_at) == SURE and now - self._heard_at[0] <= WITHIN:
            self.seen = twist

    def named(self, nodes: tuple[str, ...]) -> None:
        """Note which nodes publish to the topic, as the robot's ROS says."""
        if self.seen is not None:
            sound = [name for name in nodes if name.isprintable() and name.strip()]
            self.nodes = tuple(name[:MOST_NAME] for name in sound[:MOST_NODES])

    def step(self, now: float) -> None:
        """Let time pass: one that is not heard any more is gone."""
        if self.seen is not None and now - self._heard_at[-1] > WITHIN:
            self.seen = self.nodes = None

    def words(self, topic: str) -> str | None:
        """Return who publishes what to the machine, in words.

        Args:
            topic: The topic of the machine.

        """
        if self.seen is None:
            return None
        speed = math.copysign(math.hypot(self.seen.vx, self.seen.vy), self.seen.vx)
        v, w = round(speed, 2) + 0.0, round(self.seen.wz, 2) + 0.0
        said = f"another program publishes to {topic} ({v:.2f} m/s, {w:.2f} rad/s)"
        if self.nodes is None:
            return said
        return f"{said}: {', '.join(self.nodes) or 'another client of the bridge'}"


def _rounded(twist: Twist) -> list[tuple[float, ...]]:
    """Return the rounded values that a velocity may have: one, or more at an edge."""
    parts = [
        {round(part - ROUNDING, DIGITS) + 0.0, round(part + ROUNDING, DIGITS) + 0.0}
        for part in astuple(twist)
    ]
    return list(product(*parts))
