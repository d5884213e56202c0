"""Whether a machine stands, as its odometry tells. No I/O."""

from webmap.base.geometry import Twist

STILL_V = 0.02
"""Metres per second below which a machine stands (S5)."""

STILL_W = 0.05
"""Radians per second below which a machine stands (S5)."""

STILL_FOR = 0.3
"""Seconds for which odometry must say so without a gap (S5)."""

GAP = 0.5
"""Seconds between two messages that are too many to know what was between."""


def moves(twist: Twist, still_v: float = STILL_V, still_w: float = STILL_W) -> bool:
    """Return whether a machine of that velocity does not stand.

    Args:
        twist: What its odometry tells.
        still_v: Metres per second from which on it moves.
        still_w: Radians per second from which on it turns.

    """
    return twist.speed >= still_v or twist.turn >= still_w


class Standstill:
    """Listens to odometry from a moment on, until the machine has stood for long.

    Args:
        still_v: Metres per second from which on it moves.
        still_w: Radians per second from which on it turns.

    """

    def __init__(self, still_v: float = STILL_V, still_w: float = STILL_W) -> None:
        self._still_v, self._still_w = still_v, still_w
        self.speed: float | None = None
        """The newest speed in m/s; ``None`` before the first."""
        self.turn = 0.0
        """The newest speed of turning in rad/s, whatever the axis."""
        self.heard_at = float("-inf")
        """When odometry last told a velocity."""
        self.gap = 0.0
        """Seconds between the newest two messages; 0 before there are two."""
        self.since: float | None = None
        """When it was first seen to stand, if it has been seen so ever since."""

    def begin(self) -> None:
        """Forget what was heard before."""
        self.speed, self.heard_at, self.since = None, float("-inf"), None
        self.gap = 0.0

    def saw(self, twist: Twist | None, now: float) -> None:
        """Take in a message of odometry; ``None`` is one without a velocity."""
        if twist is None:
            return
        if self.speed is not None:
            self.gap = now - self.heard_at
        if self.gap > GAP:
            self.since = None
        self.speed, self.turn, self.heard_at = twist.speed, twist.turn, now
        if moves(twist, self._still_v, self._still_w):
            self.since = None
        elif self.since is None:
            self.since = now

    @property
    def reached(self) -> bool:
        """Whether the machine has stood for :data:`STILL_FOR`."""
        return self.since is not None and self.heard_at - self.since >= STILL_FOR
