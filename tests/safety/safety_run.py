"""How long the run is, how far it has come, and what it need not measure again.

A full run is of fifty trials or more; the environment states the number. It asserts the
promises as they stand, while a quick one grants what the machine itself was late by.
"""

import functools
import json
import os
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import webmap

TRIALS = int(os.environ.get("WEBMAP_SAFETY_TRIALS", "3"))
FULL = TRIALS >= 50

SHOW: list[Callable[[str], None]] = [print]
"""What shows progress, the newest last; pytest's own, past its capturing, in a run."""


class Progress:
    """Says how far a scenario is, where a run is long enough to ask.

    Args:
        name: The scenario.
        trials: How many it has.

    """

    def __init__(self, name: str, trials: int) -> None:
        self._name = name
        self._trials = trials
        self._begun = time.monotonic()
        self._number = 0
        self._worst = 0.0
        self._of_machine = 0.0

    def add(self, late: float, jitter: float) -> None:
        """Print how a trial ended; seconds."""
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
    """Return what is granted on top of a promise, of what the machine was late by."""
    return 0.0 if FULL else jitter


@functools.cache
def version() -> str:
    """Return what is measured: the version, and the commit if there is one."""
    commit = _git("describe", "--always")
    if not commit:
        return webmap.__version__
    # The table itself, which a run writes, makes it no other version.
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
    """Return whether a run that is resumed has this scenario already, and kept it."""
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
