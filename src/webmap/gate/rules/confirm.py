"""Whether a machine has stopped after STOP: confirmed, not confirmed, not known yet."""

from webmap.base.geometry import Twist
from webmap.gate.rules.standstill import (
    GAP,
    STILL_FOR,
    STILL_V,
    STILL_W,
    Standstill,
    moves,
)

PATIENCE = 2.0
"""Seconds after STOP until "not known yet" becomes "not confirmed"."""


class Confirmation:
    """Looks at odometry from a STOP on for standstill, and on for motion. No I/O.

    What was confirmed is so as long as odometry goes on to say it.
    """

    def __init__(self) -> None:
        self.confirmed: bool | None = None
        self.why = ""
        """The reason in words; empty while it is not known yet."""
        self.since = float("-inf")
        self._still = Standstill()
        self._stood = False

    def begin(self, now: float) -> None:
        """Look (again) from ``now`` on: what was seen before proves nothing."""
        self.confirmed, self.why, self.since = None, "", now
        self._stood = False
        self._still.begin()

    def saw(self, twist: Twist | None, now: float) -> None:
        """Take in a message of odometry; one that moves again is not confirmed."""
        self._still.saw(twist, now)
        if self.confirmed and twist is not None and moves(twist):
            self.confirmed, self.why = False, self._moving()

    def judge(self, trouble: str | None, delivered: bool, now: float) -> None:
        """Decide anew.

        Args:
            trouble: Why nothing can be known at all now, in words.
            delivered: Whether the robot's bridge answered since STOP.
            now: The time.

        """
        silent = now - self._still.heard_at > PATIENCE
        if trouble is not None:
            self.confirmed, self.why = False, self._since_then(trouble)
        elif self._still.reached and delivered and not silent:
            self.confirmed, self.why = True, "stopped, confirmed by odometry"
            self._stood = True
        elif self.confirmed and not silent:
            pass  # odometry had a gap, which is no motion
        elif now - self.since < PATIENCE:
            self.confirmed, self.why = None, ""
        else:
            self.confirmed, self.why = False, self._reason(delivered, silent, now)

    def _reason(self, delivered: bool, silent: bool, now: float) -> str:
        if not delivered:
            return self._since_then("no answer from the bridge")
        if self._still.speed is None or silent:
            return self._since_then("no odometry")
        if self._still.speed < STILL_V and self._still.turn < STILL_W:
            gap = max(self._still.gap, now - self._still.heard_at)
            if gap > GAP:
                return f"only one odometry message in {gap:.1f} s"
            return f"not yet still for {STILL_FOR:g} s"
        return self._moving()

    def _since_then(self, trouble: str) -> str:
        return f"it stopped, but since then: {trouble}" if self._stood else trouble

    def _moving(self) -> str:
        speed = self._still.speed or 0.0
        if speed < STILL_V:
            return f"still turning at {self._still.turn:.2f} rad/s"
        return f"still moving at {speed:.2f} m/s"
