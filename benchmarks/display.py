"""A display process that shows a fleet, for as long as a ``with`` block lasts."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil

from benchmarks.processes import module

FLEET = Path(__file__).parent / "fleet.py"
BRIDGED = Path(__file__).parent / "bridged.py"
READY = "WebMap is ready at "


@dataclass(frozen=True, slots=True)
class Display:
    """A running display process."""

    url: str
    """Address of the page, including the token."""

    process: psutil.Process

    @property
    def gate(self) -> psutil.Process:
        """The process of its gate."""
        return next(p for p in self.process.children() if "webmap.gate" in p.cmdline())

    def cpu(self) -> float:
        """Return the processor time of the display in seconds."""
        times = self.process.cpu_times()
        return float(times.user + times.system)


@contextmanager
def display(robots: int, beams: int, *, console: bool = False) -> Iterator[Display]:
    """Start the fleet on a free port, on a plain map or in the console, and end it."""
    with running(
        FLEET,
        FLEET_ROBOTS=str(robots),
        FLEET_BEAMS=str(beams),
        FLEET_CONSOLE="1" if console else "",
    ) as shown:
        yield shown


@contextmanager
def stamped(robots: int, beams: int = 0) -> Iterator[str]:
    """Start a rosbridge with robots of ``stamped``; yield its address."""
    with module("benchmarks.stamped", robots, beams) as (url, _):
        yield url


@contextmanager
def bridged(
    robots: int, beams: int = 0, viewers: int = 100, frame_rate: float | None = None
) -> Iterator[Display]:
    """Start a rosbridge with robots of ``stamped``, and a display that shows them.

    Args:
        robots: The number of robots.
        beams: Beams of each scan; 0 for robots without scans.
        viewers: The greatest number of open pages.
        frame_rate: Frames a second for each page, whose user can then not drive. None
            for the default rate, and users who can drive.

    """
    with (
        stamped(robots, beams) as url,
        running(
            BRIDGED,
            BRIDGED_URL=url,
            BRIDGED_ROBOTS=str(robots),
            BRIDGED_SCANS="1" if beams else "",
            BRIDGED_VIEWERS=str(viewers),
            BRIDGED_FRAME_RATE="" if frame_rate is None else str(frame_rate),
        ) as shown,
    ):
        yield shown


@contextmanager
def running(program: Path, **environment: str) -> Iterator[Display]:
    """Run a program of WebMap on a free port, and end it."""
    with tempfile.TemporaryDirectory() as state:
        command = [sys.executable, "-m", "webmap", "run", str(program)]
        with subprocess.Popen(
            [*command, "--port", "0", "--no-browser"],
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, **environment, "WEBMAP_STATE_DIR": state},
        ) as process:
            try:
                assert process.stdout is not None
                line = process.stdout.readline()
                if not line.startswith(READY):
                    raise RuntimeError(f"expected {READY!r}, got {line!r}")
                url = line.removeprefix(READY).strip()
                yield Display(url, psutil.Process(process.pid))
            finally:
                process.terminate()
