"""Zeros for a moment, then silence (S20)."""

PERIOD = 0.05
"""Seconds between two zeros."""

LENGTH = 0.5
"""Seconds from the first zero to silence."""


class Burst:
    """When the zeros that stop a machine are due."""

    def __init__(self) -> None:
        self.running = False
        self.started_at = float("-inf")
        self._due = float("-inf")

    def start(self, now: float) -> None:
        """Begin, or begin again; the first zero is due at once."""
        self.running = True
        self.started_at = self._due = now

    def end(self) -> None:
        """Stop sending zeros."""
        self.running = False

    def zero_due(self, now: float) -> bool:
        """Return whether a zero is to be written at ``now``, and count on it."""
        if self.running and now >= self.started_at + LENGTH:
            self.running = False
        if not self.running or now < self._due:
            return False
        # Zeros that a sleeping process missed are not made up for.
        self._due = max(self._due + PERIOD, now + PERIOD / 2)
        return True
