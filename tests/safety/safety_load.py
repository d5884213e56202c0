"""Much to show, many who watch and a busy processor.

Ten robots scan ten times a second, a map of 16 million cells comes every two seconds
through a rosbridge, and fifty viewers look on, of whom five read nothing.
"""

import contextlib
import os
import re
import subprocess
import sys
from pathlib import Path

from safety_bench import wait_for

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
    """Be another computer as far as one can: robots and viewers are not on this one.

    What they send and take is the load; the processor that they need for it is not.
    """
    os.setsid()
    os.nice(19)
    with contextlib.suppress(OSError):
        # Where each session gets the same share, it is the session that must be nice.
        Path("/proc/self/autogroup").write_text("19")


@contextlib.contextmanager
def helper(script, *arguments):
    """Run a script of this folder until its standard input ends."""
    command = [sys.executable, str(Path(__file__).with_name(script)), *arguments]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(
        command, text=True, preexec_fn=run_separately, **pipes
    ) as process:
        try:
            yield process
            assert process.poll() is None, f"{script} has ended"
        finally:
            process.stdin.close()
            try:
                process.wait(20)
            except subprocess.TimeoutExpired:
                process.kill()  # the machine gives it no time to end in order


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
    """Have all there is to show on the page of a bench."""
    with flood() as addresses:
        os.environ["SAFETY_FLOOD"] = addresses
        try:
            bench.end_display()
            bench.start_display()
            bench.open_page()
            with crowd(bench.url), busy_processor():
                wait_for(lambda: bench.tab.evaluate(DOTS) == SCANNERS, "scans", 30)
                wait_for(lambda: bench.tab.evaluate(PICTURE), "a map", 30)
                bench.crowded = True
                yield
        finally:
            bench.crowded = False
            del os.environ["SAFETY_FLOOD"]
            bench.end_display()


@contextlib.contextmanager
def maps_coming(bench):
    """See that a map came, and was drawn, in the meantime."""
    before = bench.tab.evaluate(PICTURE)
    yield
    bench.heal()
    wait_for(lambda: bench.tab.evaluate(PICTURE) not in (None, before), "maps", 30)
    assert bench.tab.evaluate(DOTS) == SCANNERS
