"""The dead-man: commands hold for a moment, and nothing resumes by itself."""

DEADMAN = 0.2
"""Seconds for which an accepted command holds (S1)."""

NEUTRAL = 0.2
"""Seconds of released inputs that must be seen before anything moves (S6)."""


class DeadMan:
    """Whether the holder of a lease may move the machine, and until when.

    A new dead-man is disarmed. It arms when every input was seen released for
    ``NEUTRAL`` seconds without a gap, and disarms on any doubt.

    A command holds if it echoes a newer tick than the one before it did. So it is fed
    by the whole loop: a hand that still sends but hears nothing feeds it no longer.

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
        self._tick = -1

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

    def accept(self, neutral: bool, tick: int, now: float) -> None:
        """Count an accepted command.

        Args:
            neutral: Whether every input is released.
            tick: The tick that it echoes.
            now: The time.

        """
        if self.expired(now) and self._needs_neutral:
            self.disarm()
        if tick > self._tick:
            self._tick, self._accepted_at = tick, now
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
