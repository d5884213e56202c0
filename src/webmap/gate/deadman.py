"""The dead-man: commands hold for a moment, and nothing resumes by itself."""

DEADMAN = 0.2
"""Seconds for which an accepted command holds (S1)."""

NEUTRAL = 0.2
"""Seconds of released inputs that must be seen before anything moves (S6)."""


class DeadMan:
    """Whether the holder of a lease may move the machine, and until when.

    A new dead-man is disarmed. It arms when every input was seen released for
    ``NEUTRAL`` seconds without a gap, and disarms on any doubt.

    Args:
        needs_neutral: A hand on a stick or a key may be held through an outage, so it
            must be seen released. A program's call is an act of its own each time;
            for it the lease ends on doubt instead.

    """

    def __init__(self, *, needs_neutral: bool = True) -> None:
        self.armed = not needs_neutral
        self._needs_neutral = needs_neutral
        self._neutral_since: float | None = None
        self._accepted_at: float | None = None

    @property
    def expires_at(self) -> float:
        """When the newest accepted command ends; in the past if there is none."""
        return (
            float("-inf")
            if self._accepted_at is None
            else (self._accepted_at + DEADMAN)
        )

    def expired(self, now: float) -> bool:
        """Return whether no accepted command holds at ``now``."""
        return now >= self.expires_at

    def accept(self, neutral: bool, now: float) -> None:
        """Count an accepted command; ``neutral`` says that every input is released."""
        if self.expired(now) and self._needs_neutral:
            self.disarm()
        self._accepted_at = now
        if not neutral:
            self._neutral_since = None
        elif self._neutral_since is None:
            self._neutral_since = now
        elif now - self._neutral_since >= NEUTRAL:
            self.armed = True

    def disarm(self) -> None:
        """Ask for released inputs before anything moves again."""
        self.armed = not self._needs_neutral
        self._neutral_since = None
