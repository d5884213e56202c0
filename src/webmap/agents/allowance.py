"""How much each user of a router may send per second. No I/O."""

import logging
import threading

log = logging.getLogger("webmap.agent")

BURST = 10.0
"""Seconds of the rates that may come at once: a display subscribes to all at once."""

QUIET = 10.0
"""Seconds for which the same user is not logged again."""

MOST_USERS = 1000
"""Users that are remembered; only a router without users has so many names."""


class Allowance:
    """Limits what the users of a router may send; may be used in several threads.

    Args:
        what: What they send, for the log.
        pieces: Pieces per second. The default is for the displays of one user.
        size: Bytes per second.

    """

    def __init__(self, what: str, pieces: int = 400, size: int = 1 << 20) -> None:
        self._what, self._pieces, self._size = what, pieces, size
        self._uses: dict[str, tuple[float, float]] = {}
        """For how many seconds the user has sent in advance, and when that was."""
        self._logged: dict[str, float] = {}
        self._lock = threading.Lock()

    def admits(self, user: str, size: int, now: float) -> bool:
        """Return whether a piece of so many bytes is used; it counts only then."""
        with self._lock:
            if len(self._uses) >= MOST_USERS:
                self._uses.clear()
                self._logged.clear()
            used, at = self._uses.get(user, (0.0, now))
            used = max(0.0, used - (now - at))
            admitted = used < BURST
            if admitted:
                used += max(1 / self._pieces, size / self._size)
                self._uses[user] = used, now
            elif now - self._logged.get(user, -QUIET) >= QUIET:
                self._logged[user] = now
                log.warning("%s sends too many %s: some are lost", user, self._what)
            return admitted
