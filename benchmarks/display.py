"""A display process that shows the fleet, for as long as a ``with`` block lasts."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psutil

FLEET = Path(__file__).parent / "fleet.py"
READY = "WebMap is ready at "


@dataclass(frozen=True, slots=True)
class Display:
    """A running display process."""

    url: str
    """Address of the page, including the token."""

    process: psutil.Process

    def cpu(self) -> float:
        """Return the seconds of processor time that it has used."""
        times = self.process.cpu_times()
        return float(times.user + times.system)


@contextmanager
def display(robots: int, beams: int, *, console: bool = False) -> Iterator[Display]:
    """Start the fleet on a free port, on a plain map or in the console, and end it."""
    with tempfile.TemporaryDirectory() as state:
        environment = os.environ | {
            "FLEET_ROBOTS": str(robots),
            "FLEET_BEAMS": str(beams),
            "WEBMAP_STATE_DIR": state,
            "FLEET_CONSOLE": "1" if console else "",
        }
        command = [sys.executable, "-m", "webmap", "run", str(FLEET)]
        with subprocess.Popen(
            [*command, "--port", "0", "--no-browser"],
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
        ) as running:
            try:
                assert running.stdout is not None
                line = running.stdout.readline()
                if not line.startswith(READY):
                    raise RuntimeError(f"expected {READY!r}, got {line!r}")
                url = line.removeprefix(READY).strip()
                yield Display(url, psutil.Process(running.pid))
            finally:
                running.terminate()
