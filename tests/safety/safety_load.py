"""The full load: much data to show, many viewers, and a busy processor.

Ten robots send ten scans a second, a rosbridge sends a map of 16 million cells every
two seconds, and there are fifty viewers, of which five read nothing.
"""

import contextlib
import os
import re
import subprocess
import sys
from pathlib import Path

from equipment.waiting import wait_for

VIEWERS = 50
SILENT = 5
SCANNERS = 10

UNDER_LOAD = (
    f"a map of 16 million cells, {SCANNERS} robots that scan, {VIEWERS} viewers, "
    f"{SILENT} of whom read nothing, and a busy processor"
)

PICTURE = "document.querySelector('.occupancy-grid image')?.getAttribute('href')"
DOTS = """[...document.querySelectorAll('.laserscan .dot')]
    .filter((dots) => dots.getAttribute('d')).length"""


def run_separately():
    """Give this process a low priority, because robots and viewers are other computers.

    The data that they send and receive is the load, not their processor time.
    """
    os.setsid()
    os.nice(19)
    with contextlib.suppress(OSError):
        # With autogroups, Linux compares the priorities of sessions, not of processes.
        Path("/proc/self/autogroup").write_text("19")


@contextlib.contextmanager
def helper(script, *arguments, prepare=run_separately):
    """Run a script of this folder for as long as the ``with`` block lasts."""
    command = [sys.executable, str(Path(__file__).with_name(script)), *arguments]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command, text=True, preexec_fn=prepare, **pipes) as process:
        try:
            yield process
            assert process.poll() is None, f"{script} has ended"
        finally:
            process.stdin.close()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()  # the machine is too busy for an orderly end


@contextlib.contextmanager
def crowd(url):
    with helper("safety_crowd.py", url, str(VIEWERS), str(SILENT)) as process:
        assert process.stdout.readline() == "ready\n"
        yield


@contextlib.contextmanager
def flood():
    with helper("safety_flood.py") as process:
        lines = sorted(process.stdout.readline() for _ in range(2))
        maps, robots = [re.search(r"ws://\S+", line)[0] for line in lines]
        yield f"{robots} {maps}"


@contextlib.contextmanager
def busy_processor():
    with subprocess.Popen([sys.executable, "-c", "while True: pass"]) as process:
        try:
            yield
        finally:
            process.kill()


@contextlib.contextmanager
def under_load(bench):
    """Run the display of a bench under the full load."""
    with flood() as addresses:
        os.environ["SAFETY_FLOOD"] = addresses
        try:
            bench.end_display()
            bench.start_display()
            bench.open_page()
            with crowd(bench.url), busy_processor():
                wait_for(lambda: bench.tab.evaluate(DOTS) == SCANNERS, "scans", 30)
                wait_for(lambda: bench.tab.evaluate(PICTURE), "a map", 30)
                bench.loaded = True
                yield
        finally:
            bench.loaded = False
            del os.environ["SAFETY_FLOOD"]
            bench.end_display()


@contextlib.contextmanager
def maps_coming(bench):
    """Assert that the page draws a new map during the ``with`` block."""
    before = bench.tab.evaluate(PICTURE)
    yield
    bench.restore()
    wait_for(lambda: bench.tab.evaluate(PICTURE) not in (None, before), "maps", 30)
    assert bench.tab.evaluate(DOTS) == SCANNERS
