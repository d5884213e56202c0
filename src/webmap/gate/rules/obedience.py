"""Whether a machine does what it is told when it is told zero (S19). No I/O."""

from webmap.gate.rules.standstill import speed_of
from webmap.geometry import Twist

GRACE = 1.0
"""Seconds after zero until a machine that moves on is said not to obey."""

MOVES = 0.05
"""Metres per second above which a machine is said to move on."""

TURNS = 0.1
"""Radians per second above which it is said to turn on."""


class Obedience:
    """Watches a machine from the zero that stops it until it was seen to slow down.

    Once it has, what moves it afterwards is somebody else's business.
    """

    def __init__(self) -> None:
        self._zero_at: float | None = None
        self._seen: Twist | None = None
        self._seen_at = float("-inf")

    def wrote(self, twist: Twist, last: Twist, now: float) -> None:
        """Note that ``twist`` went out after ``last``."""
        if not twist.is_zero:
            self.excuse()
        elif not last.is_zero:
            self.expect(now)

    def expect(self, now: float) -> None:
        """Expect standstill from here on, unless that is expected already."""
        if self._zero_at is None:
            self._zero_at, self._seen = now, None

    def excuse(self) -> None:
        """Note that it may move: somebody drives it, or it has a goal."""
        self._zero_at = self._seen = None

    def saw(self, twist: Twist | None, now: float) -> None:
        """Take in a message of odometry."""
        if twist is None:
            return
        if not self.watching(now):
            self.excuse()  # nobody looked for a while: it may be driven by others
            return
        self._seen, self._seen_at = twist, now
        if speed_of(twist) <= MOVES and abs(twist.wz) <= TURNS:
            self.excuse()

    def watching(self, now: float) -> bool:
        """Return whether odometry could still tell something."""
        if self._zero_at is None:
            return False
        return now - max(self._zero_at, self._seen_at) <= GRACE

    def alarm(self, now: float) -> str | None:
        """Return what is wrong at ``now``, in words."""
        if self._zero_at is None or self._seen is None:
            return None
        if now - self._zero_at < GRACE or not self.watching(now):
            return None
        speed = speed_of(self._seen)
        if speed > MOVES:
            return f"zero sent, still moving at {speed:.2f} m/s"
        return f"zero sent, still turning at {abs(self._seen.wz):.2f} rad/s"
