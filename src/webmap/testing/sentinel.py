"""The scheduling delay of this machine, second by second."""

import threading
import time
from bisect import bisect_left


class Sentinel:
    """Measures scheduling delay while a test measures something else.

    A time limit on a busy machine is the promised limit plus the delay of the machine
    in the same seconds; this thread sleeps for 5 ms at a time and records how late it
    wakes.
    """

    PERIOD = 0.005
    """Seconds between two wakes."""

    def __init__(self) -> None:
        self._late: list[tuple[float, float]] = []
        self._end = threading.Event()
        self._thread = threading.Thread(
            target=self._watch, name="sentinel", daemon=True
        )

    def __enter__(self) -> "Sentinel":
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._end.set()
        self._thread.join(5)

    def worst(self, since: float, until: float | None = None) -> float:
        """Return the longest delay in a period of the monotonic clock, in seconds."""
        until = time.monotonic() if until is None else until
        return max((late for _, late in self._between(since, until)), default=0.0)

    def stolen(self, since: float, until: float | None = None) -> float:
        """Return the total waiting time of a ready thread in a period, in seconds.

        Data that passes several threads and processes waits in each of them, so this is
        the time that a busy machine can add from end to end. A wake that is at most
        1 ms late is normal on an idle machine and does not count.
        """
        until = time.monotonic() if until is None else until
        return sum(late for _, late in self._between(since, until) if late > 0.001)

    def _between(self, since: float, until: float) -> list[tuple[float, float]]:
        """Return the wakes that were due in a period, each with its delay."""
        first = bisect_left(self._late, (since, 0.0))
        return [(at, late) for at, late in self._late[first:] if at <= until + late]

    def _watch(self) -> None:
        while not self._end.is_set():
            due = time.monotonic() + self.PERIOD
            time.sleep(self.PERIOD)
            now = time.monotonic()
            self._late.append((now, max(0.0, now - due)))
