"""The check before driving: was the STOP of this machine proved lately? No I/O.

A person presses STOP, odometry shows standstill, the stop hooks are answered, and the
person resets the STOP: that proves the STOP. The page then reports the check with its
other results, and the gate keeps the time. A robot whose configuration demands a check
drives slowly until then.

The gate decides by what it saw itself: no page can report a check without the proof.
"""

import math

from webmap.gate.actions import Emit, SaveCheck
from webmap.gate.commands import Refusal
from webmap.gate.events import CheckRecord, Key
from webmap.gate.protocol import CheckReport
from webmap.gate.rules.aliases import Aliases
from webmap.gate.specs import SLOW_V, SLOW_W, Cap

PROVED_FOR = 120.0
"""Seconds after the reset of a proved STOP within which a check counts."""


def span(seconds: float) -> str:
    """Return a length of time in words, such as ``12 h``."""
    for unit, length in (("h", 3600.0), ("min", 60.0)):
        if seconds >= length:
            return f"{seconds / length:g} {unit}"
    return f"{seconds:g} s"


class PreDriveCheck:
    """The newest check of one machine, and whether one is due.

    Args:
        key: The machine.
        robots: The robots of the machine.
        emit: Called with each action.

    """

    def __init__(self, key: Key, robots: Aliases, emit: Emit) -> None:
        self.due = False
        """Whether a check is demanded and there is none that is recent enough."""
        self._key = key
        self._robots = robots
        self._emit = emit
        self._record: CheckRecord | None = None
        self._checked_at = -math.inf
        self._proved_at = -math.inf

    def take(self, record: CheckRecord | None, now: float) -> None:
        """Take over the newest check, as the disk has it."""
        self._record = record
        # A check of the future has a wrong time, so nobody knows how old it is.
        known = record is not None and record.age >= 0
        self._checked_at = now - record.age if record and known else -math.inf
        self.look(now)

    def look(self, now: float) -> None:
        """Find out whether a check is due at ``now``."""
        every = self._robots.check_every
        self.due = every is not None and now - self._checked_at > every

    def prove(self, proved: bool, now: float) -> None:
        """Note the reset of a STOP: whether it was confirmed, and its hooks too."""
        self._proved_at = now if proved else -math.inf

    def passed(self, by: str, now: float) -> None:
        """Keep a check that a person has finished.

        Raises:
            Refusal: If the STOP was not proved shortly before.

        """
        if not self._robots.drivable:
            raise Refusal("the robot has no velocity topic")
        if now - self._proved_at > PROVED_FOR:
            raise Refusal(
                "press STOP, wait until it is confirmed with its stop hooks, and reset "
                "it first"
            )
        self._proved_at = -math.inf  # the next check needs another STOP
        self._emit(SaveCheck(self._key, by))

    @property
    def caps(self) -> list[Cap]:
        """The speed limit while a check is due."""
        every = self._robots.check_every
        if not self.due or every is None:
            return []
        return [Cap(SLOW_V, SLOW_W, f"not checked within {span(every)}")]

    @property
    def report(self) -> CheckReport | None:
        """What pages show; ``None`` if no check is demanded and none was made."""
        every, record = self._robots.check_every, self._record
        if record is None:
            return None if every is None else CheckReport(every)
        return CheckReport(every, record.by, record.at)
