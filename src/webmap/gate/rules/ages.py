"""The ages of what came in the last two seconds: which one most of them stay below."""

import math
from collections import deque

WINDOW = 2.0
"""Seconds over which ages are looked at."""


class Ages:
    """Ages in seconds, the newest ones."""

    def __init__(self) -> None:
        self._ages: deque[tuple[float, float]] = deque()
        self._p95: float | None = None
        self._stale = False

    def add(self, age: float, now: float) -> None:
        """Count one more; ``age`` in seconds."""
        self._ages.append((now, age))
        self._stale = True
        self.forget_old(now)

    def forget_old(self, now: float) -> None:
        """Look at the last two seconds only."""
        while self._ages and now - self._ages[0][0] > WINDOW:
            self._ages.popleft()
            self._stale = True

    def clear(self) -> None:
        """Forget everything."""
        self._ages.clear()
        self._stale = True

    @property
    def p95(self) -> float | None:
        """The age in seconds that 95 of 100 stay below, if there is any."""
        if self._stale:
            ages = sorted(age for _, age in self._ages)
            self._p95 = ages[math.ceil(0.95 * len(ages)) - 1] if ages else None
            self._stale = False
        return self._p95
