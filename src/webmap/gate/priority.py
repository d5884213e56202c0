"""Being first in the queue for a processor, where the system lets one ask."""

import contextlib
import os
import sys

REAL_TIME = 1
"""The lowest of the real-time priorities: before every program that has none."""


def rise() -> bool:
    """Have this thread, and those that it starts, run before what is not urgent.

    The gate needs little of a processor, but needs it soon. Linux gives that to root
    and to whom ``RLIMIT_RTPRIO`` allows it; on other systems and for other users the
    gate is one program among all, as it also works.

    Returns:
        Whether it was allowed.

    """
    if sys.platform != "linux":
        return False
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(REAL_TIME))
        return True
    return False
