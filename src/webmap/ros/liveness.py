"""Whether a link still lives, told by the answers to its pings."""

from math import inf


class Liveness:
    """Decide from the times of pings and pongs; all times in monotonic seconds.

    Only one ping is under way at a time. A link that is silent is not dead: a robot
    may have nothing to say. Dead is a link whose ping is not answered.
    """

    LIMIT = 3.0
    """Longest wait for the answer to a ping, in seconds."""

    PERIOD = 0.5
    """Time from one answer to the next ping, in seconds."""

    LONGEST = 60.0
    """Longest wait for the answer while something large is on its way, in seconds."""

    SLOW = 0.25
    """Round trip, in seconds, from which on the next ping follows at once."""

    LATE = 0.75
    """Time between two looks after which the looking itself was held up."""

    def __init__(self, now: float) -> None:
        self._pinged: float | None = None
        self._took = 0.0
        self._ponged = now
        self._looked = now

    def wants_ping(self, now: float) -> bool:
        """Return whether the next ping is due."""
        if self._pinged is not None:
            return False
        return self._took >= self.SLOW or now - self._ponged >= self.PERIOD

    def pinged(self, now: float) -> None:
        """Note that a ping was sent."""
        self._pinged = now

    def ponged(self, now: float) -> None:
        """Note that the ping was answered."""
        if self._pinged is not None:
            self._took = now - self._pinged
        self._pinged = None
        self._ponged = now

    def lag(self, now: float) -> float:
        """Return how many seconds what comes now was under way, about.

        The answer to a ping comes after all that was sent before it. So a link that
        has not answered yet may be as late as the ping is old. What became slow since
        the newest ping is seen by the next one, three quarters of a second later.
        """
        waiting = 0.0 if self._pinged is None else now - self._pinged
        return max(self._took, waiting)

    def is_dead(self, now: float, heard: float = -inf, *, busy: bool = False) -> bool:
        """Return whether the last ping went unanswered for too long.

        A look that comes late judges nothing: where this process stood still, the
        answer may lie unread. The answer comes after all that was sent before it, so a
        large map on a slow link may hold it up for as long as its bytes come.

        Args:
            now: The time of the look.
            heard: When the last bytes came.
            busy: Whether the bridge is known to encode something large.

        """
        late = now - self._looked > self.LATE
        self._looked = now
        if late or self._pinged is None or now - self._pinged <= self.LIMIT:
            return False
        silent = now - heard > self.LIMIT and not busy
        return silent or now - self._pinged > self.LONGEST
