"""Delays between attempts to connect."""

import random
from collections.abc import Callable

FIRST = 0.5
LONGEST = 10.0
STEADY = 5.0


class Backoff:
    """Growing, random delays between attempts to connect.

    Args:
        jitter: Returns a number in [0, 1); replaced in tests.

    """

    def __init__(self, jitter: Callable[[], float] = random.random) -> None:
        self._jitter = jitter
        self._failures = 0

    def next(self, lasted: float = 0.0) -> float:
        """Return the delay before the next attempt, in seconds.

        The first delay is between 0.25 s and 0.5 s. Each failure doubles it; the
        greatest is 10 s.

        Args:
            lasted: How long the connection that has just ended was open, in seconds.
                After 5 s or more the delay starts again at its smallest value; after
                less (a bridge that accepts and disconnects) the delay keeps growing.

        """
        if lasted >= STEADY:
            self._failures = 0
        longest = min(LONGEST, FIRST * 2.0 ** min(self._failures, 16))
        self._failures += 1
        return longest * (0.5 + 0.5 * self._jitter())
