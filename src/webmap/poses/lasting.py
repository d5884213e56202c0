"""When trouble with poses has lasted long enough to be shown."""

PATIENCE = 1.0
"""Seconds for which something is wrong before that is shown: when a link opens, frames
come one after another, and that is no trouble."""


class Lasting:
    """Finds out when trouble has lasted for a while."""

    def __init__(self) -> None:
        self._since: float | None = None

    def due(self, trouble: str, now: float, earliest: float) -> float | None:
        """Return when trouble is to be shown; None if there is none.

        Args:
            trouble: Which kind there is now; empty if there is none.
            now: The time, in seconds of any clock that only goes forward.
            earliest: When it is to be shown at the earliest.

        """
        if not trouble:
            self._since = None
            return None
        if self._since is None:
            self._since = now
        return max(self._since + PATIENCE, earliest)
