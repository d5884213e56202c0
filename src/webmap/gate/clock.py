"""The clock of every decision in the gate."""

import time

_BOOTTIME = getattr(time, "CLOCK_BOOTTIME", None)


def now() -> float:
    """Return seconds that only grow, also while the computer sleeps where it can.

    On Linux the ordinary monotonic clock stands still during suspend, and a command
    given before it would look fresh afterwards.
    """
    if _BOOTTIME is None:
        return time.monotonic()
    return time.clock_gettime(_BOOTTIME)
