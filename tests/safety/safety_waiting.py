"""How long the threads on the way from a key to a robot waited for a processor."""

from collections.abc import Iterable
from pathlib import Path

BESIDE = ("ThreadPool", "CompositorTile")
"""Threads of a browser that draw or load: no key passes them."""

NANO = 1e-9


class Waiting:
    """What the scheduler let processes wait from now on, though they were ready.

    A thread that sleeps most of the time, as the sentinel's, gets a processor before
    those that have just used one. So where all processors are taken, it says little of
    what a browser has to wait, and Linux, which counts that for each thread, says more.

    Args:
        pids: Of the processes on the way.

    """

    def __init__(self, pids: Iterable[int]) -> None:
        self._pids = list(pids)
        self._before = self._delays()

    def seconds(self) -> float:
        """Return how long since then the thread waited that waited longest."""
        return max(
            (
                delay - self._before.get(thread, 0.0)
                for thread, delay in self._delays().items()
            ),
            default=0.0,
        )

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
