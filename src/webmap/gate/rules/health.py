"""Whether those at the other ends are alive: a bridge, the display. No I/O."""

from webmap.gate.rules.ages import Ages

PROOF_LIMIT = 0.3
"""The oldest question whose answer counts when a moving command is written, in seconds:
how long ago it was asked, however lately the answer came (S11)."""

STALL_LIMIT = 1.0
"""A link that gave no sign of life for so long is cut, in seconds (S11)."""

BEAT_LIMIT = 0.25
"""The longest silence of the display that is not yet taken for its end, in seconds."""


class Health:
    """Whether a link is up, and which question its far end last answered.

    An answer tells of the moment when it was asked for, and of nothing after that: it
    may have been under way for long, and what was written meanwhile may lie somewhere.
    """

    def __init__(self) -> None:
        self.up = False
        self.trips = Ages()
        """How long questions and their answers were under way."""
        self._asked_at = float("-inf")
        self._heard_at = float("-inf")

    def opened(self, now: float) -> None:
        """The link is up; nothing that was asked on it is answered yet."""
        self.up = True
        self._asked_at, self._heard_at = float("-inf"), now
        self.trips.clear()

    def closed(self) -> None:
        """The link is down."""
        self.up = False

    def answered(self, asked_at: float, now: float) -> None:
        """The far end answered at ``now`` what it was asked at ``asked_at``."""
        self._asked_at = max(self._asked_at, asked_at)
        self._heard_at = now
        self.trips.add(now - asked_at, now)

    def answered_since(self, then: float) -> bool:
        """Return whether something was answered that was asked after ``then``.

        What was written at ``then`` has arrived if so, as all goes in order.
        """
        return self.up and self._asked_at > then

    def fresh(self, now: float) -> bool:
        """Return whether something that moves may be written at ``now``."""
        return self.up and now - self._asked_at <= PROOF_LIMIT

    def stalled(self, now: float) -> bool:
        """Return whether the link looks open but carries nothing."""
        return self.up and now - self._heard_at > STALL_LIMIT


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
            return "the display process does not respond"
        return None
