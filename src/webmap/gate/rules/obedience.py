"""Whether a machine does what velocity asks of it, zero above all (S19). No I/O."""

import math

from webmap.base.geometry import Twist
from webmap.gate.rules.standstill import Standstill, moves

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

    def wrote(self, twist: Twist, last: Twist, now: float) -> None:
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

    def saw(self, twist: Twist | None, now: float) -> None:
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
        self._calm.saw(twist, now)
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
