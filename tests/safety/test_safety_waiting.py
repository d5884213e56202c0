"""How long processes wait for a processor."""

import os
import subprocess
import sys
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from safety_waiting import Contention, Waiting, most_within, of_command, steal

from equipment.waiting import wait_for

pytestmark = [
    pytest.mark.safety,
    pytest.mark.skipif(
        not Path("/proc/self/schedstat").exists(),
        reason="Linux does not count waiting times here",
    ),
]

BUSY = "import os; os.sched_setaffinity(0, {%d}); print(flush=True)\nwhile True: pass"


@contextmanager
def three_busy():
    """Three processes that never sleep, on one processor."""
    script = BUSY % min(os.sched_getaffinity(0))
    with ExitStack() as stack:
        busy = []
        for _ in range(3):
            process = stack.enter_context(
                subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE)
            )
            stack.callback(process.kill)
            busy.append(process)
        for process in busy:
            process.stdout.readline()
        yield busy


def test_three_processes_on_one_processor_wait_for_the_processor():
    with three_busy() as busy:
        one, all_ = Waiting([busy[0].pid]), Waiting([each.pid for each in busy])
        begin = time.monotonic()
        wait_for(lambda: one.seconds() >= 0.1, "a wait of the first process")
        passed = time.monotonic() - begin
        assert one.seconds() <= passed + 1
        assert all_.seconds() >= 0.1


def test_a_sleeping_or_ended_process_has_no_waiting_time():
    with subprocess.Popen(["sleep", "60"]) as process:
        asleep = Waiting([process.pid])
        time.sleep(0.2)
        assert asleep.seconds() < 0.1
        process.kill()
        process.wait()
        assert asleep.seconds() == 0
        assert Waiting([process.pid]).seconds() == 0


def test_the_waits_of_all_processes_add_up():
    waits = {(1, "a"): 0.2, (1, "b"): 0.1, (2, "a"): 0.3}
    assert of_command(waits) == pytest.approx(0.5)
    assert of_command({}) == 0.0


def test_most_within_returns_the_largest_growth_in_a_time_window():
    counts = [(0.0, 5.0), (0.1, 5.0), (0.2, 5.04), (0.3, 5.1), (0.4, 5.1), (1.0, 5.15)]
    assert most_within(0.25, counts) == pytest.approx(0.1)
    assert most_within(0.25, counts[:2]) == 0
    assert most_within(0.25, []) == 0


def test_steal_time_is_read_from_proc_stat(tmp_path):
    stat = tmp_path / "stat"
    assert steal(stat) == 0
    stat.write_text("cpu  1 2 3 4 5 6 7 250 0 0\ncpu0 1 2 3 4 5 6 7 250 0 0\n")
    assert steal(stat) == 2.5


def test_contention_is_the_longest_wait_in_a_quarter_second():
    with three_busy() as busy:
        for _ in range(3):
            with Contention(Waiting([busy[0].pid])) as contention:
                time.sleep(1)
            # A late reading includes the wait of a longer time.
            if contention.waited < 0.5:
                break
        assert 0.02 < contention.waited < 0.5
        assert contention.stolen >= 0
