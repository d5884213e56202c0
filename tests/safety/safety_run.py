"""The number of trials of a run, its progress, and the figures that it has already.

A full run has twenty trials or more; an environment variable sets the number. A full
run asserts the promised times. A quick run adds the delay of the machine to them.
"""

import functools
import json
import os
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import pytest

import webmap

TRIALS = int(os.environ.get("WEBMAP_SAFETY_TRIALS", "3"))
FULL = TRIALS >= 20

LONG = pytest.mark.skipif(not FULL, reason="takes long: make test-safety runs it")

SHOW: list[Callable[[str], None]] = [print]
"""Functions that print progress; the last one is used.

During a run, this is a function that prints although pytest captures output.
"""


class Progress:
    """Prints the progress of a scenario, if a run has more than one trial.

    Args:
        name: The name of the scenario.
        trials: The number of its trials.

    """

    def __init__(self, name: str, trials: int) -> None:
        self._name = name
        self._trials = trials
        self._begun = time.monotonic()
        self._number = 0
        self._worst = 0.0
        self._of_machine = 0.0

    def add(self, late: float, jitter: float) -> None:
        """Add the result of a trial, in seconds, and print the progress at times."""
        self._number += 1
        self._worst = max(self._worst, late)
        self._of_machine = max(self._of_machine, jitter)
        if TRIALS > 1 and (self._number % 10 == 0 or self._number == self._trials):
            each = (time.monotonic() - self._begun) / self._number
            SHOW[-1](
                f"{self._name}: trial {self._number} of {self._trials}, "
                f"worst {self._worst * 1000:.0f} ms, "
                f"machine late by {self._of_machine * 1000:.0f} ms, "
                f"{each:.1f} s each"
            )


def grace(jitter: float) -> float:
    """Return the part of the machine's delay that is added to a promised time."""
    return 0.0 if FULL else jitter


@functools.cache
def version() -> str:
    """Return the version of WebMap, with its commit if there is one."""
    commit = _git("describe", "--always")
    if not commit:
        return webmap.__version__
    # A run writes the table in docs, so changes there do not count.
    changed = "+" if _git("status", "--porcelain", "--", "src", "tests") else ""
    return f"{webmap.__version__} ({commit}{changed})"


def _git(*arguments: str) -> str:
    asked = subprocess.run(
        ["git", *arguments],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=False,
    )
    return asked.stdout.strip()


def is_measured(name: str) -> bool:
    """Return whether a resumed run already has a figure that keeps this promise."""
    path = os.environ.get("WEBMAP_SAFETY_FIGURES")
    if not path or os.environ.get("WEBMAP_SAFETY_RESUME") != "1":
        return False
    if not Path(path).exists():
        return False
    wanted = (name, TRIALS, version())
    lines = map(json.loads, Path(path).read_text().splitlines())
    return any(
        (f["name"], f["asked"], f["version"]) == wanted and f["worst"] <= f["promised"]
        for f in lines
        if "name" in f
    )
