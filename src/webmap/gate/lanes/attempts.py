"""When a link is made again, and which of its losses are worth a line. No I/O."""

FIRST_WAIT = 0.1
"""Seconds until the first attempt to connect again."""

LONGEST_WAIT = 3.0
"""Seconds between attempts at most."""

STEADY = 2.0
"""Only a link that lasted for so long makes the next attempt come soon, in seconds.

That a handshake succeeds is not enough: a bridge that ends each link at once would be
asked ten times a second for ever.
"""

FIRST_FLOOD_WAIT = 1.0
"""Seconds until the attempt after a link that was dropped for what it sent."""

LONGEST_FLOOD_WAIT = 60.0
"""The same after many of them, each of which doubles the time."""

TAME = 60.0
"""A link that lasted for so long makes that short again, in seconds."""

MOST_TROUBLES = 20
"""How many different troubles are logged until a link has lasted again."""


class Attempts:
    """Decides how long to wait before each attempt, and what is logged."""

    def __init__(self) -> None:
        self._troubles: set[str] = set()
        self._wait = FIRST_WAIT
        self._flood_wait = FIRST_FLOOD_WAIT

    def failed(self) -> float:
        """Return the seconds to wait after an attempt that failed."""
        wait = self._wait
        self._wait = min(2 * wait, LONGEST_WAIT)
        return wait

    def ended(self, lasted: float, *, flooded: bool) -> float:
        """Return the seconds to wait after a link that ended.

        Args:
            lasted: For how many seconds it was open.
            flooded: Whether it was dropped for what it sent.

        """
        if lasted >= STEADY:
            self._wait = FIRST_WAIT
            self._troubles.clear()
        if lasted >= TAME:
            self._flood_wait = FIRST_FLOOD_WAIT
        if flooded:
            wait = self._flood_wait
            self._flood_wait = min(2 * wait, LONGEST_FLOOD_WAIT)
            return wait
        return self.failed()

    def is_news(self, trouble: str) -> bool:
        """Return whether a trouble is to be logged, and note that it was."""
        if trouble in self._troubles or len(self._troubles) == MOST_TROUBLES:
            return False
        self._troubles.add(trouble)
        return True
