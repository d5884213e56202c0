"""Whether a machine obeys the gate (S19), and only the gate. No I/O."""

import math
from collections import deque
from itertools import product

from webmap.base.geometry import Twist
from webmap.gate.rules.health import Standstill, moves

GRACE = 1.0
"""Seconds after zero until a machine that still moves does not obey."""

MOVES = 0.05
"""Metres per second above which a machine still moves."""

TURNS = 0.1
"""Radians per second above which a machine still turns."""

SENT = 0.1
"""Metres per second sent from which a machine that does not move is blocked."""

BLOCKED_AFTER = 1.0
"""Seconds without motion after which a driven machine is blocked."""

LASTING = 60.0
"""Seconds without odometry for which the alarm about a disobeying machine lasts."""


class Obedience:
    """Watches a machine from the zero that stops it until a lasting standstill.

    Motion after that has another cause. One odometry message without motion proves
    nothing: coarse encoders send such messages while the machine moves. Silence proves
    nothing either: for a machine that did not obey, or while STOP is active, standstill
    stays expected until odometry shows it.
    """

    def __init__(self) -> None:
        self._zero_at: float | None = None
        self._firm = False
        # Standstill counts its limits as motion; MOVES and TURNS themselves are none.
        self._calm = Standstill(math.nextafter(MOVES, 1), math.nextafter(TURNS, 1))
        self._moving: Twist | None = None
        self._moving_at = self._seen_at = float("-inf")
        self._driven = False
        self._contested = False
        self._stuck: tuple[float, float] | None = None
        """When odometry first and last showed standstill of a driven machine."""

    def on_written(self, twist: Twist, last: Twist, now: float) -> None:
        """Note that ``twist`` was written after ``last``."""
        self._driven = moves(twist, SENT, TURNS)
        if not self._driven:
            self._stuck = None
        if not twist.is_zero:
            self.excuse()
        elif not last.is_zero:
            self.expect(now)

    def expect(self, now: float, *, firmly: bool = False) -> None:
        """Expect standstill from ``now`` on, if it is not expected yet.

        Args:
            now: The time.
            firmly: Whether standstill stays expected over a gap in odometry.

        """
        if self._zero_at is None:
            self._zero_at, self._moving, self._firm = now, None, False
            self._calm.begin()
        self._firm |= firmly

    def excuse(self) -> None:
        """Expect standstill no longer: the machine is driven or has a goal."""
        self._zero_at = self._moving = None
        self._firm = False

    def observe(
        self, twist: Twist | None, now: float, *, contested: bool = False
    ) -> None:
        """Process an odometry message.

        While the gate writes zeros and another program velocities (``contested``), a
        standstill proves nothing: the machine may move on after the last zero.
        """
        if twist is None:
            return
        if moves(twist):
            self._stuck = None
        elif self._driven:
            self._stuck = (self._stuck[0] if self._stuck else now, now)
        if self._zero_at is None:
            return
        if not self._firm and not self.watching(now):
            self.excuse()  # no odometry for a while: others may drive it
            return
        self._seen_at = now
        if contested != self._contested:
            self._contested = contested
            self._calm.begin()
        self._calm.observe(twist, now)
        if self._calm.reached and contested:
            self._moving = None
        elif self._calm.reached:
            self.excuse()
        elif self._calm.since is None:
            self._moving, self._moving_at = twist, now
            self._firm |= now - self._zero_at >= GRACE
        elif self._moving_at < self._zero_at + GRACE:
            self._moving = None  # it stopped in time, unless it moves again

    def blocked(self, now: float) -> bool:
        """Return whether the machine does not move although a velocity was sent.

        :data:`BLOCKED_AFTER` leaves it time to speed up.
        """
        if self._stuck is None:
            return False
        first, last = self._stuck
        return last - first >= BLOCKED_AFTER and now - last <= GRACE

    def watching(self, now: float) -> bool:
        """Return whether standstill is expected and odometry is recent enough."""
        if self._zero_at is None:
            return False
        patience = LASTING if self._firm else GRACE
        return now - max(self._zero_at, self._seen_at) <= patience

    def alarm(self, now: float) -> str | None:
        """Return that the machine does not obey, as text, or ``None``."""
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
"""Echoes explained by one velocity: two subscriptions may deliver it twice."""

MOST_ECHOES = 32
"""The most echoes that one value explains; more are never in flight."""

REMEMBERED = 60.0
"""Seconds during which a velocity of the gate explains echoes."""

DIGITS = 3
"""The decimals to which velocities are compared."""

ROUNDING = 1e-5
"""The most that an echo may differ, because bridges write numbers with fewer digits."""

SURE = 2
"""Unexplained velocities after which another program is reported."""

WITHIN = 3.0
"""Seconds within which these arrive; after as long without one the program is gone."""

EXPECTED_FOR = 2.0
"""Seconds for which velocities of others are expected after a cause, such as a goal."""

MOST_NODES = 3
"""The most nodes that the report names."""

MOST_NAME = 80
"""The longest name of a node, in characters."""


class OtherWriter:
    """Finds velocities of other programs among the echoes of the gate's own.

    An echo may come late, twice, with its digits rounded, and many at once after a
    stall. So each velocity that the gate wrote explains two received ones, within a
    minute. An unexplained velocity is from another program. Zeros are ignored: they
    move nothing, and many programs send them.
    """

    def __init__(self) -> None:
        self.seen: Twist | None = None
        """The newest velocity of another program; ``None`` without such a program."""
        self.nodes: tuple[str, ...] | None = None
        """The nodes that publish it; empty if it comes through the bridge too."""
        self._own: dict[tuple[float, ...], tuple[int, float]] = {}
        """By value, oldest first: echoes left, and when it was written last."""
        self._received_at: deque[float] = deque(maxlen=SURE)
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
        """Ignore velocities of others until ``until``: they have a known cause."""
        self._expected_until = max(self._expected_until, until)

    def on_echo(self, twist: Twist, now: float) -> None:
        """Process a velocity received on the topic."""
        if twist.is_zero:
            return
        for value in _rounded(twist):
            left, at = self._own.get(value, (0, now))
            if left and now - at <= REMEMBERED:
                self._own[value] = (left - 1, at)
                return
        if now < self._expected_until:
            return
        self._received_at.append(now)
        if len(self._received_at) == SURE and now - self._received_at[0] <= WITHIN:
            self.seen = twist

    def named(self, nodes: tuple[str, ...]) -> None:
        """Note which nodes publish to the topic, as reported by the robot's ROS."""
        if self.seen is not None:
            sound = [name for name in nodes if name.isprintable() and name.strip()]
            self.nodes = tuple(name[:MOST_NAME] for name in sound[:MOST_NODES])

    def step(self, now: float) -> None:
        """Forget a program that publishes no longer."""
        if self.seen is not None and now - self._received_at[-1] > WITHIN:
            self.seen = self.nodes = None

    def description(self, topic: str) -> str | None:
        """Return who publishes what to ``topic``, as text, or ``None``."""
        if self.seen is None:
            return None
        speed = math.copysign(math.hypot(self.seen.vx, self.seen.vy), self.seen.vx)
        v, w = round(speed, 2) + 0.0, round(self.seen.wz, 2) + 0.0
        text = f"another program publishes to {topic} ({v:.2f} m/s, {w:.2f} rad/s)"
        if self.nodes is None:
            return text
        return f"{text}: {', '.join(self.nodes) or 'another client of the bridge'}"


def _rounded(twist: Twist) -> list[tuple[float, ...]]:
    """Return the rounded values of a velocity: one, or more at a rounding edge."""
    parts = [
        {round(part - ROUNDING, DIGITS) + 0.0, round(part + ROUNDING, DIGITS) + 0.0}
        for part in twist.numbers
    ]
    return list(product(*parts))
