"""Delay before trouble with poses is shown."""

PATIENCE = 1.0
"""Seconds for which trouble must last before it is shown: when a connection opens,
frames arrive one after another, which is no trouble."""


class Lasting:
    """Determines when trouble has lasted for a while."""

    def __init__(self) -> None:
        self._since: float | None = None

    def due(self, trouble: str, now: float, earliest: float) -> float | None:
        """Return when to show the trouble; None if there is none.

        Args:
            trouble: The current kind; empty if there is none.
            now: The time of any monotonic clock, in seconds.
            earliest: The earliest time to show it.

        """
        if not trouble:
            self._since = None
            return None
        if self._since is None:
            self._since = now
        return max(self._since + PATIENCE, earliest)
