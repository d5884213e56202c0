"""Measure how long the threads from key to robot wait for a processor."""

import threading
import time
from collections.abc import Iterable
from pathlib import Path

BESIDE = ("ThreadPool", "CompositorTile")
"""Names of browser threads that draw or load; they do not handle keys."""

NANO = 1e-9


class Waiting:
    """Measures from now on how long ready processes wait for a processor.

    The sentinel's thread sleeps most of the time, so Linux runs it before threads that
    have just used a processor. When all processors are busy, the sentinel waits less
    than a browser does. Therefore this class reads the waiting time of each thread,
    which Linux counts.

    Args:
        pids: The processes from key to robot.

    """

    def __init__(self, pids: Iterable[int]) -> None:
        self._pids = list(pids)
        self._before = self._delays()

    def seconds(self) -> float:
        """Return how long a command may have waited since then."""
        return of_command(self.of_threads())

    def of_threads(self) -> dict[tuple[int, str], float]:
        """Return the waiting time of each thread since then."""
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
                except (OSError, ValueError):  # it has ended, or is not counted
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
        waiting: Reads how long the threads from key to robot have waited.

    """

    PERIOD = 0.05
    """Seconds between two readings."""

    WINDOW = 0.25
    """The length of the window in seconds."""

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
        """The longest wait of a command within the window, in seconds."""
        return of_command(
            {
                thread: most_within(self.WINDOW, waits)
                for thread, waits in self._waits.items()
            }
        )

    def _watch(self) -> None:
        while not self._end.wait(self.PERIOD):
            now = time.monotonic()
            self._steals.append((now, steal(Path("/proc/stat"))))
            for thread, waited in self._waiting.of_threads().items():
                self._waits.setdefault(thread, []).append((now, waited))


def of_command(waits: dict[tuple[int, str], float]) -> float:
    """Return how long a command has waited, in seconds.

    A command passes through all processes in turn, so their waits add up. Of the
    threads of a process, the one that waited longest counts.

    Args:
        waits: The wait of each thread, by its process.

    """
    longest: dict[int, float] = {}
    for (pid, _), waited in waits.items():
        longest[pid] = max(waited, longest.get(pid, 0.0))
    return sum(longest.values())


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
