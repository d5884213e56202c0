"""Ticks: numbers that a command must echo, so that its age is known.

The age is measured between two moments of one clock, this process's own; no clock of
a browser or a robot has a part in it.
"""

import secrets
from collections import deque

from webmap.gate.refusal import Refusal

PERIOD = 0.05
"""Seconds between two ticks."""

MAX_AGE = 0.3
"""The oldest tick that a command may echo, in seconds (S2)."""

_REMEMBERED = 64


class Ticks:
    """Issues ticks and knows how old each of the newest ones is.

    Args:
        first: The first number. A random one, unless said, so that the ticks of
            another session of the gate are unknown here.

    """

    def __init__(self, first: int | None = None) -> None:
        self.newest = (secrets.randbits(32) if first is None else first) - 1
        self._issued: deque[float] = deque(maxlen=_REMEMBERED)
        self._due = float("-inf")

    def issue(self, now: float) -> int | None:
        """Return a new tick if one is due at ``now``."""
        if now < self._due:
            return None
        # Late by more than one period means that the process stood still; there is
        # nothing to catch up on.
        self._due = self._due + PERIOD if now < self._due + PERIOD else now + PERIOD
        self.newest += 1
        self._issued.append(now)
        return self.newest

    def age(self, tick: int, now: float) -> float | None:
        """Return the seconds since ``tick`` was issued; ``None`` if it is unknown."""
        back = self.newest - tick
        if not 0 <= back < len(self._issued):
            return None
        return now - self._issued[-1 - back]

    def check(self, tick: int, now: float) -> float:
        """Let a command pass that echoes a tick which is young enough.

        Returns:
            The tick's age in seconds.

        Raises:
            Refusal: If the tick is too old or was never issued here.

        """
        age = self.age(tick, now)
        if age is None:
            raise Refusal("unknown tick: too old, or from another session")
        if age > MAX_AGE:
            raise Refusal(f"command too old (over {MAX_AGE * 1000:.0f} ms): ignored")
        return age
