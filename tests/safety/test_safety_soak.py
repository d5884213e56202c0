"""Half an hour under the full load: memory does not grow, and no zero is late.

It runs in a full run only, or for the minutes that WEBMAP_SAFETY_SOAK gives.
"""

import itertools
import os
import time

import psutil
import pytest
from safety_bench import pass_time
from safety_figures import Soak, note
from safety_load import UNDER_LOAD, maps_coming, under_load
from safety_run import FULL, SHOW

from equipment.waiting import wait_for
from webmap.gate.rules.motion import HELD_PERIOD

pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]

MINUTES = float(os.environ.get("WEBMAP_SAFETY_SOAK", "30" if FULL else "0"))

WARM = 2.0
"""Minutes until all processes have the memory that they keep."""

STEP = 0.01
"""Seconds between two checks of the clock by the gate; a zero may wait so long."""

STOP_AGAIN = 240.0
"""Seconds until the next STOP, as the zeros of a STOP end after ten minutes."""

GROWTH = 0.1


def processes(bench):
    """Return the display, its gate and its worker, by name."""
    display = psutil.Process(bench.display.popen.pid)
    found = {"display": display}
    for child in display.children(recursive=True):
        what = child.cmdline()
        if "webmap.gate" in what:
            found["gate"] = child
        elif "webmap.ros.worker" in what:
            found["worker"] = child
    return found


class Memory:
    """The resident memory of each process in bytes, measured every second.

    Each map of 16 million cells needs memory for several copies for a short time. So
    the smallest value of several minutes is the memory that a process keeps.
    """

    def __init__(self, bench):
        self._bench = bench
        self._seen = []

    def look(self):
        sizes = {n: p.memory_info().rss for n, p in processes(self._bench).items()}
        self._seen.append((time.monotonic(), sizes))

    def least(self, since, until):
        """Return the smallest value of each process between two times."""
        sizes = [sizes for at, sizes in self._seen if since <= at <= until]
        names = set.intersection(*map(set, sizes))
        return {name: min(one[name] for one in sizes) for name in sorted(names)}


def press_stop(bench):
    bench.space("keyDown")
    bench.space("keyUp")


@pytest.mark.skipif(not MINUTES, reason="takes half an hour: make test-safety runs it")
@pytest.mark.timeout(5400)
def test_half_an_hour_under_full_load_keeps_memory_stable_and_delays_no_zero(bench):
    memory = Memory(bench)
    with under_load(bench), maps_coming(bench):
        press_stop(bench)
        pids = {name: process.pid for name, process in processes(bench).items()}
        pass_time(60 * min(WARM, MINUTES / 3))
        again = begun = time.monotonic()
        end = begun + 60 * MINUTES
        while time.monotonic() < end:
            if time.monotonic() > again:
                press_stop(bench)
                again = time.monotonic() + STOP_AGAIN
                SHOW[-1](f"soak: {(end - again + STOP_AGAIN) / 60:.0f} min to go")
            memory.look()
            pass_time(1.0)
        wait_for(lambda: bench.robot.log.twists[-1].at > end, "a zero")
        received = [
            received for received in bench.robot.log.twists if received.at >= begun
        ]
        alive = {name: process.pid for name, process in processes(bench).items()}
    part = (end - begun) / 4
    before, kept = memory.least(begun, begun + part), memory.least(end - part, end)
    assert all(one.is_zero for one in received), "the robot moved during STOP"
    gaps = [after.at - one.at for one, after in itertools.pairwise(received)]
    late = sorted(max(0.0, gap - HELD_PERIOD - STEP) for gap in gaps)
    most, usual = late[-1], late[int(len(late) * 0.999)]
    jitter = bench.sentinel.worst(begun, end)
    for name, size in kept.items():
        note(
            Soak(
                f"memory of the {name} after {MINUTES:g} min",
                "%",
                100 * GROWTH,
                100 * (size / before[name] - 1),
            )
        )
    note(Soak("delay of a zero of STOP, maximum", "ms", 50, 1000 * most))
    note(Soak("delay of a zero of STOP, 99.9 % of them", "ms", 20, 1000 * usual))
    note(Soak("delay of the machine, maximum", "ms", None, 1000 * jitter))
    assert alive == pids, "a process has ended"
    for name, size in kept.items():
        assert size <= before[name] * (1 + GROWTH), (name, before, kept, UNDER_LOAD)
    assert most <= 0.05 + (0 if FULL else jitter)
    assert usual <= 0.02 + (0 if FULL else jitter)
