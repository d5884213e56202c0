"""Whether those at the other ends are alive: a bridge, the display. No I/O."""

PROOF_LIMIT = 0.3
"""The oldest sign of life with which a moving command is written, in seconds (S11)."""

STALL_LIMIT = 1.0
"""A link that gave no sign of life for so long is cut, in seconds (S11)."""

BEAT_LIMIT = 0.25
"""The longest silence of the display that is not yet taken for its end, in seconds."""


class Health:
    """Whether a link is up and when its far end last answered."""

    def __init__(self) -> None:
        self.up = False
        self._proof_at = float("-inf")

    def opened(self, now: float) -> None:
        """The link is up; its handshake was an answer."""
        self.up = True
        self._proof_at = now

    def closed(self) -> None:
        """The link is down."""
        self.up = False

    def answered(self, now: float) -> None:
        """The far end answered something that was sent a moment ago."""
        self._proof_at = max(self._proof_at, now)

    def answered_since(self, then: float) -> bool:
        """Return whether the far end answered after ``then``."""
        return self.up and self._proof_at > then

    def fresh(self, now: float) -> bool:
        """Return whether something that moves may be written at ``now``."""
        return self.up and now - self._proof_at <= PROOF_LIMIT

    def stalled(self, now: float) -> bool:
        """Return whether the link looks open but carries nothing."""
        return self.up and now - self._proof_at > STALL_LIMIT


class Pulse:
    """Whether the display process, and so everybody behind it, is there."""

    def __init__(self) -> None:
        self.ended: str | None = None
        self._beat_at = float("-inf")

    def beat(self, now: float) -> None:
        """A heartbeat came."""
        self._beat_at = now

    def doubt(self, now: float) -> str | None:
        """Return why nobody behind the display may move anything, if so."""
        if self.ended is not None:
            return self.ended
        if now - self._beat_at > BEAT_LIMIT:
            return "the display process is silent"
        return None
