"""The clock of the gate."""

import time

_BOOTTIME = getattr(time, "CLOCK_BOOTTIME", None)


def now() -> float:
    """Return monotonic seconds that, on Linux, also count while the computer sleeps.

    The ordinary monotonic clock of Linux does not advance during suspend: a command
    from before it would look fresh afterwards.
    """
    if _BOOTTIME is None:
        return time.monotonic()
    return time.clock_gettime(_BOOTTIME)
