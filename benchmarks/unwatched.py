"""The processor time of a display without open pages, compared with one viewer.

One rosbridge has a thousand robots with odometry at 10 Hz, or a hundred robots with
odometry and scans of 360 points at 10 Hz. The display serves the console, like ``webmap
view``.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import psutil

from benchmarks.harness import Comparison, Contender, Figures, compare
from webmap.base.audience import RARELY

FLEETS = {"1,000 robots": (1000, 0), "100 robots with scans": (100, 360)}
"""The number of robots, and of the beams of their scans."""

PROGRAM = Path(__file__).parent / "busy_fleet.py"

CONNECTED = 8.0
"""Seconds until all robots are connected."""

SETTLED = 32.0
"""Seconds until no page counts as open, and throttles hold no pose any more: they need
three periods to follow a longer period of the bridge."""

PERIOD = RARELY / 1000
"""Seconds of a measurement. The poses of all robots may come together, within a part of
this time."""


@contextmanager
def _running(*command: object, **environment: str) -> Iterator["subprocess.Popen[str]"]:
    """Run a Python module."""
    with subprocess.Popen(
        [sys.executable, "-m", *map(str, command)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | environment,
    ) as process:
        try:
            yield process
        finally:
            process.terminate()


def _line(process: "subprocess.Popen[str]") -> str:
    assert process.stdout is not None
    return process.stdout.readline().strip()


def _spent(display: "subprocess.Popen[str]") -> tuple[float, int]:
    """Return the processor time of the display in seconds, and its message count."""
    assert display.stdin is not None
    times = psutil.Process(display.pid).cpu_times()
    display.stdin.write("\n")
    display.stdin.flush()
    return times.user + times.system, int(_line(display))


def shown_to(
    viewers: int, robots: int, beams: int, connected: float = CONNECTED
) -> Callable[[], Figures]:
    """Return a run of the display with robots and viewers.

    Args:
        viewers: The number of viewers; with 0, the run takes :data:`SETTLED` longer.
        robots: The number of robots.
        beams: The beams of their scans; 0 for robots without scans.
        connected: Seconds until all robots are connected.

    """

    def run() -> Figures:
        with ExitStack() as running:
            folder = running.enter_context(tempfile.TemporaryDirectory())
            server = running.enter_context(_running("benchmarks.busy_robots", beams))
            display = running.enter_context(
                _running(
                    *("webmap", "run", PROGRAM, "--port", "0", "--no-browser"),
                    FLEET_URL=f"ws://127.0.0.1:{_line(server)}",
                    FLEET_ROBOTS=str(robots),
                    FLEET_BEAMS=str(beams),
                    WEBMAP_STATE_DIR=folder,
                )
            )
            url = _line(display).rpartition(" at ")[2]
            time.sleep(connected if viewers else SETTLED)
            if viewers:
                watch = ("benchmarks.watchers", url, viewers, 2 * PERIOD)
                if _line(running.enter_context(_running(*watch))) != "ready":
                    raise RuntimeError("the viewer saw no frame")
            cpu, messages = _spent(display)
            began = time.monotonic()
            time.sleep(PERIOD)
            cpu_then, messages_then = _spent(display)
            took = time.monotonic() - began
        return {
            "cpu of the display (% of a core)": 100 * (cpu_then - cpu) / took,
            "messages (a second)": (messages_then - messages) / took,
        }

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare no viewer with one, for each fleet."""
    return [
        compare(
            title,
            [
                Contender(name, shown_to(viewers, *fleet))
                for name, viewers in (("1 viewer", 1), ("no viewer", 0))
            ],
            rounds,
        )
        for title, fleet in FLEETS.items()
    ]
