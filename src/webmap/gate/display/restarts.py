"""When a gate that has ended is started again, and what is said of it. No I/O."""

FIRST_PAUSE = 0.25
"""Seconds until a gate that has ended twice in a row is started again."""

LONGEST_PAUSE = 4.0
"""Seconds between the end of a gate and the next one at most."""

LIVED = 10.0
"""Seconds that a gate must have lived for its end to be the first in a row."""


class Restarts:
    """The starts and ends of the gates of one display."""

    def __init__(self) -> None:
        self.failing = False
        """Whether one gate after the other ended soon."""
        self._pause = 0.0
        self._due = float("-inf")
        self._started_at = float("-inf")

    def due(self, now: float) -> bool:
        """Return whether it is time to start one."""
        return now >= self._due

    def started(self, now: float) -> None:
        """Note that one was started, or that this was tried."""
        self._started_at = now

    def ended(self, now: float) -> None:
        """Note that it has ended.

        The next one is started at once, because what the robots do now nobody knows;
        if that one ends soon as well, after a pause that doubles.
        """
        lived = now - self._started_at >= LIVED
        self.failing = self._pause > 0.0 and not lived
        if lived:
            self._pause = 0.0
        self._due = now + self._pause
        self._pause = min(max(2 * self._pause, FIRST_PAUSE), LONGEST_PAUSE)

    def lives(self, now: float) -> None:
        """Note that it runs still."""
        if self.failing and now - self._started_at >= LIVED:
            self.failing = False


def in_words(epitaph: str, *, spoke: bool) -> str:
    """Return what is to be said of gates that end one after the other.

    Args:
        epitaph: What the last one ended of.
        spoke: Whether it had come to run.

    """
    what = "ended repeatedly" if spoke else "does not start"
    return (
        f"The gate {what}: {epitaph}. WebMap starts it again. Until then no robot "
        "can be driven from here; a STOP is kept and sent then."
    )
