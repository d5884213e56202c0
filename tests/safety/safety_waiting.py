"""How long the threads between a key and a robot waited for a processor."""

import threading
import time
from collections.abc import Iterable
from pathlib import Path

BESIDE = ("ThreadPool", "CompositorTile")
"""Threads of a browser that draw or load: no key passes them."""

NANO = 1e-9


class Waiting:
    """How long processes that were ready wait for the scheduler, from now on.

    A thread that sleeps most of the time, as the sentinel's, gets a processor before
    those that have just used one. So where all processors are taken, it says little of
    what a browser has to wait, and Linux, which counts that for each thread, says more.

    Args:
        pids: The processes between key and robot.

    """

    def __init__(self, pids: Iterable[int]) -> None:
        self._pids = list(pids)
        self._before = self._delays()

    def seconds(self) -> float:
        """Return how long since then the thread waited that waited longest."""
        return max(self.of_threads().values(), default=0.0)

    def of_threads(self) -> dict[tuple[int, str], float]:
        """Return how long since then each thread waited."""
        return {
            thread: delay - self._before.get(thread, 0.0)
            for thread, delay in self._delays().items()
        }

    def _delays(self) -> dict[tuple[int, str], float]:
        delays = {}
        for pid in self._pids:
            for task in Path(f"/proc/{pid}/task").glob("*"):
                try:
                    name = (task / "comm").read_text()
                    _, delay, _ = (task / "schedstat").read_text().split()
                except (OSError, ValueError):  # it has ended, or nobody counts
                    continue
                if not name.startswith(BESIDE):
                    delays[pid, task.name] = int(delay) * NANO
        return delays


class Contention:
    """How much processor time other processes and the host took during a measurement.

    Other processes use a processor while a thread between key and robot waits for
    one. The host of a virtual machine may take a processor away: then no thread runs on
    that processor, and Linux counts the time as steal time, see proc_stat(5).

    Args:
        waiting: Reads how long the threads between key and robot have waited.

    """

    PERIOD = 0.05
    """Seconds between two readings."""

    WINDOW = 0.25
    """Seconds over which time that was taken is added up."""

    def __init__(self, waiting: Waiting) -> None:
        self._waiting = waiting
        self._steals: list[tuple[float, float]] = []
        self._waits: dict[tuple[int, str], list[tuple[float, float]]] = {}
        self._end = threading.Event()
        self._thread = threading.Thread(
            target=self._watch, name="contention", daemon=True
        )

    def __enter__(self) -> "Contention":
        self._thread.start()
        return self

    def __exit__(self, *exception: object) -> None:
        self._end.set()
        self._thread.join(5)

    @property
    def stolen(self) -> float:
        """The most steal time of all processors within the window, in seconds."""
        return most_within(self.WINDOW, self._steals)

    @property
    def waited(self) -> float:
        """The longest wait of one thread within the window, in seconds."""
        waits = self._waits.values()
        return max((most_within(self.WINDOW, each) for each in waits), default=0.0)

    def _watch(self) -> None:
        while not self._end.wait(self.PERIOD):
            now = time.monotonic()
            self._steals.append((now, steal(Path("/proc/stat"))))
            for thread, waited in self._waiting.of_threads().items():
                self._waits.setdefault(thread, []).append((now, waited))


def steal(stat: Path) -> float:
    """Return the steal time of all processors, in seconds; 0 if Linux counts none."""
    try:
        all_processors = stat.read_text().splitlines()[0].split()
        return int(all_processors[8]) / 100
    except (OSError, IndexError, ValueError):
        return 0.0


def most_within(window: float, counts: list[tuple[float, float]]) -> float:
    """Return the largest growth of a count within a window.

    Args:
        window: The length of the window.
        counts: The count at several times, oldest first.

    """
    grown = [0.0]
    first = 0
    for at, count in counts:
        while counts[first][0] < at - window:
            first += 1
        grown.append(count - counts[first][1])
    return max(grown)
