"""Zeros for a moment, then silence (S20)."""

PERIOD = 0.05
"""Seconds between two zeros."""

LENGTH = 0.5
"""Seconds from the first zero to silence."""

NEW_LINK_LENGTH = 3.0
"""The same on a link that is new, where a zero is owed.

A bridge that was only just started has yet to find the robot, and loses what it is told
until then: up to 1.6 s were seen.
"""


HELD_PERIOD = 0.1
"""Seconds between two zeros while STOP stands (S8)."""

HELD_LENGTH = 600.0
"""Seconds for which they go on.

Longer than anybody needs to get to the robot, and not for ever: a STOP that was
forgotten over night should not fill its topic, or a robot's battery, until Monday.
They begin anew with another STOP and with every new link.
"""


class Burst:
    """When the zeros that stop a machine are due.

    Args:
        period: Seconds between two zeros.
        length: Seconds from the first zero to silence.

    """

    def __init__(self, period: float = PERIOD, length: float = LENGTH) -> None:
        self._period = period
        self._length = self._usual = length
        self.running = False
        self.started_at = float("-inf")
        self._due = float("-inf")

    def start(self, now: float, length: float | None = None) -> None:
        """Begin, or begin again; the first zero is due at once.

        Silence never comes earlier by that than it would have come without.

        Args:
            now: Seconds, monotonic.
            length: Seconds from here to silence, in place of the usual ones.

        """
        length = self._usual if length is None else length
        left = self.started_at + self._length - now if self.running else 0.0
        self._length = max(length, left)
        self.running = True
        self.started_at = self._due = now

    def end(self) -> None:
        """Stop sending zeros."""
        self.running = False

    def zero_due(self, now: float) -> bool:
        """Return whether a zero is to be written at ``now``, and count on it."""
        if self.running and now >= self.started_at + self._length:
            self.running = False
        if not self.running or now < self._due:
            return False
        # Zeros that a sleeping process missed are not made up for.
        self._due = max(self._due + self._period, now + self._period / 2)
        return True
