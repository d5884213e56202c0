"""Whether a machine obeys the gate (S19), and only the gate. No I/O.

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
from webmap.gate.rules.health import Standstill, moves

GRACE = 1.0
"""Seconds after zero until a machine that moves on is said not to obey."""

MOVES = 0.05
"""Metres per second above which a machine is said to move on."""

TURNS = 0.1
"""Radians per second above which it is said to turn on."""

BLOCKED_AFTER = 1.0
"""Seconds without motion after which a machine that should move counts as blocked."""

LASTING = 60.0
"""Seconds without odometry for which the alarm goes on about a machine that was seen
not to obey."""


class Obedience:
    """Watches a machine from the zero that stops it until it has stood for a while.

    Once it has, what moves it afterwards is somebody else's business. One message that
    says it stands proves nothing: coarse encoders send those while it goes on. Nor does
    silence: a machine that did not obey, or that STOP stands for, is expected to stand
    until it was seen to.
    """

    def __init__(self) -> None:
        self._zero_at: float | None = None
        self._firm = False
        # Only above these it moves on, and a standstill ends at its own.
        self._calm = Standstill(math.nextafter(MOVES, 1), math.nextafter(TURNS, 1))
        self._moving: Twist | None = None
        self._moving_at = self._seen_at = float("-inf")
        self._told_to_move = False
        self._stuck: tuple[float, float] | None = None
        """When odometry first and last showed a standstill that no zero asked for."""

    def on_written(self, twist: Twist, last: Twist, now: float) -> None:
        """Note that ``twist`` went out after ``last``."""
        self._told_to_move = moves(twist, MOVES, TURNS)
        if not self._told_to_move:
            self._stuck = None
        if not twist.is_zero:
            self.excuse()
        elif not last.is_zero:
            self.expect(now)

    def expect(self, now: float, *, firmly: bool = False) -> None:
        """Expect standstill from here on, unless that is expected already.

        Args:
            now: The time.
            firmly: Whether it is expected also if nobody looks for a while.

        """
        if self._zero_at is None:
            self._zero_at, self._moving, self._firm = now, None, False
            self._calm.begin()
        self._firm |= firmly

    def excuse(self) -> None:
        """Note that it may move: somebody drives it, or it has a goal."""
        self._zero_at = self._moving = None
        self._firm = False

    def observe(self, twist: Twist | None, now: float) -> None:
        """Take in a message of odometry."""
        if twist is None:
            return
        if moves(twist):
            self._stuck = None
        elif self._told_to_move:
            self._stuck = (self._stuck[0] if self._stuck else now, now)
        if self._zero_at is None:
            return
        if not self._firm and not self.watching(now):
            self.excuse()  # nobody looked for a while: it may be driven by others
            return
        self._seen_at = now
        self._calm.observe(twist, now)
        if self._calm.reached:
            self.excuse()
        elif self._calm.since is None:
            self._moving, self._moving_at = twist, now
            self._firm |= now - self._zero_at >= GRACE
        elif self._moving_at < self._zero_at + GRACE:
            self._moving = None  # it braked in time, unless it moves again

    def blocked(self, now: float) -> bool:
        """Return whether the machine does not move although a velocity was sent.

        It may take :data:`BLOCKED_AFTER` to speed up.
        """
        if self._stuck is None:
            return False
        first, last = self._stuck
        return last - first >= BLOCKED_AFTER and now - last <= GRACE

    def watching(self, now: float) -> bool:
        """Return whether odometry could still tell something."""
        if self._zero_at is None:
            return False
        patience = LASTING if self._firm else GRACE
        return now - max(self._zero_at, self._seen_at) <= patience

    def alarm(self, now: float) -> str | None:
        """Return what is wrong at ``now``, in words."""
        if self._zero_at is None or self._moving is None:
            return None
        if now - self._zero_at < GRACE or not self.watching(now):
            return None
        silent = now - self._seen_at > GRACE
        until = ", then odometry ended" if silent else ""
        speed, turn = self._moving.speed, self._moving.turn
        if speed > MOVES:
            return f"zero sent, still moving at {speed:.2f} m/s{until}"
        return f"zero sent, still turning at {turn:.2f} rad/s{until}"


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

EXPECTED_FOR = 2.0
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

    def on_written(self, twist: Twist, now: float) -> None:
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

    def on_echo(self, twist: Twist, now: float) -> None:
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
