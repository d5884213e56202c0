"""Whether a machine has stopped after STOP: confirmed, not confirmed, not known yet."""

from webmap.gate.rules.standstill import STILL_V, Standstill
from webmap.geometry import Twist

PATIENCE = 2.0
"""Seconds after STOP until "not known yet" becomes "not confirmed"."""


class Confirmation:
    """Looks at odometry from a STOP on for standstill, and on for motion. No I/O."""

    def __init__(self) -> None:
        self.confirmed: bool | None = None
        self.why = ""
        """The reason in words; empty while it is not known yet."""
        self.since = float("-inf")
        self._still = Standstill()

    def begin(self, now: float) -> None:
        """Look (again) from ``now`` on: what was seen before proves nothing."""
        self.confirmed, self.why, self.since = None, "", now
        self._still.begin()

    def saw(self, twist: Twist | None, now: float) -> None:
        """Take in a message of odometry; one that moves again is not confirmed."""
        self._still.saw(twist, now)
        if self.confirmed and not self._still.reached:
            self.confirmed, self.why = False, self._moving()

    def judge(self, trouble: str | None, delivered: bool, now: float) -> None:
        """Decide anew.

        Args:
            trouble: Why nothing can be known at all now, in words.
            delivered: Whether the robot's bridge answered since STOP.
            now: The time.

        """
        if trouble is not None:
            self.confirmed, self.why = False, trouble
        elif self._still.reached and delivered:
            self.confirmed, self.why = True, "stopped, confirmed by odometry"
        elif now - self.since < PATIENCE:
            self.confirmed, self.why = None, ""
        else:
            self.confirmed, self.why = False, self._reason(delivered, now)

    def _reason(self, delivered: bool, now: float) -> str:
        if not delivered:
            return "its bridge does not answer"
        if self._still.speed is None or now - self._still.heard_at > PATIENCE:
            return "no odometry"
        return self._moving()

    def _moving(self) -> str:
        speed = self._still.speed or 0.0
        if speed < STILL_V:
            return f"still turning at {self._still.turn:.2f} rad/s"
        return f"still moving at {speed:.2f} m/s"
