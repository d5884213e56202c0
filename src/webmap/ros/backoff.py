"""When to try again."""

import random
from collections.abc import Callable

FIRST = 0.5
LONGEST = 10.0
STEADY = 5.0


class Backoff:
    """Delays between attempts to connect: growing, and never the same for two.

    Args:
        jitter: Gives a number in [0, 1); replaced in tests.

    """

    def __init__(self, jitter: Callable[[], float] = random.random) -> None:
        self._jitter = jitter
        self._failures = 0

    def next(self, lasted: float = 0.0) -> float:
        """Return how long to wait before the next attempt, in seconds.

        Between 0.25 s and 0.5 s at first, twice that at each failure, at most 10 s.

        Args:
            lasted: How long the link that ended now was open, in seconds. One that
                held for 5 s starts the growth anew; a bridge that accepts and
                hangs up does not.

        """
        if lasted >= STEADY:
            self._failures = 0
        longest = min(LONGEST, FIRST * 2.0 ** min(self._failures, 16))
        self._failures += 1
        return longest * (0.5 + 0.5 * self._jitter())
