"""One page's connection, as the gate knows it. No I/O."""

from collections import deque

from webmap.gate.limits import page_cap
from webmap.gate.messages import PROGRAM, RefusedCount, Role

GARBAGE_LIMIT = 20
"""Senseless messages in a second at which a connection is closed (S10)."""

FLOOD_LIMIT = 400
"""Messages in a second at which a connection is closed.

A page that was cut off for some seconds may rightly deliver a few hundred at once.
"""

COUNT_EVERY = 1.0
"""Seconds between two counts of what was refused."""

QUIET = 1.0
"""Seconds for which the same refusal is not said again."""


class Rate:
    """Counts what happened within the last second.

    Args:
        limit: How often is too often.

    """

    def __init__(self, limit: int) -> None:
        self._times: deque[float] = deque(maxlen=limit)

    def too_often(self, now: float) -> bool:
        """Count one more at ``now``; return whether the limit is reached."""
        times = self._times
        times.append(now)
        return len(times) == times.maxlen and now - times[0] < 1.0


class Connection:
    """What one connection may do and how far its words were taken.

    Args:
        id: The display's name for it.
        name: Who that is, for people.
        role: What they may do.

    """

    def __init__(self, id: str, name: str, role: Role) -> None:
        self.id = id
        self.name = name
        self.role = role
        self.acked = -1
        """The newest accepted ``seq``."""
        self.cap = page_cap()
        self.garbage = Rate(GARBAGE_LIMIT)
        self.messages = Rate(FLOOD_LIMIT)
        self.closing = False
        self.flagged = False
        """Whether it was logged that this page asks for more than full speed."""
        self._refused = 0
        self._last_refused = ""
        self._counted_at = float("-inf")
        self._told: dict[tuple[str | None, str, str], float] = {}

    @property
    def program(self) -> bool:
        """Whether this is the display's own Python code."""
        return self.id == PROGRAM

    def set_speeds(self, v: float, w: float) -> None:
        """Take over what the page's ``Teleop`` asks for; nonsense means standstill."""
        self.cap = page_cap(v, w)

    def note_refused(self, what: str, why: str) -> None:
        """Count a message that was refused."""
        self._refused += 1
        self._last_refused = f"{what}: {why}"

    def count_refused(self, now: float) -> RefusedCount | None:
        """Return what was refused since the last count, if there is something to say.

        Args:
            now: Seconds, monotonic; infinity for the last count of all.

        """
        if not self._refused or now - self._counted_at < COUNT_EVERY:
            return None
        count = RefusedCount(self.name, self._refused, self._last_refused)
        self._refused, self._counted_at = 0, now
        return count

    def news(self, robot: str | None, what: str, why: str, now: float) -> bool:
        """Return whether a refusal is worth saying, or was said just now."""
        told = {key: at for key, at in self._told.items() if now - at < QUIET}
        self._told = told
        key = (robot, what, why)
        if key in told:
            return False
        told[key] = now
        return True
