"""The costs of viewers for the display process and for the robots' bridge.

Fifty robots with scans of 360 points at 10 Hz and poses at 20 Hz. The viewers are in
a separate process and draw nothing. Then robots have a rosbridge, and the messages from
it are counted.
"""

import json
import subprocess
import sys
from collections.abc import Callable

from benchmarks.display import display
from benchmarks.harness import Comparison, Contender, Figures, compare
from benchmarks.unwatched import shown_to

ROBOTS = 50
BEAMS = 360

BRIDGED = 10
"""The number of robots that have a rosbridge."""

CONNECTED = 2.0
"""Seconds until they are connected."""


def watched_by(viewers: int, seconds: float) -> Callable[[], Figures]:
    """Return a run with a number of viewers."""

    def run() -> Figures:
        with display(ROBOTS, BEAMS) as shown:
            command = [sys.executable, "-m", "benchmarks.watchers", shown.url]
            with subprocess.Popen(
                [*command, str(viewers), str(seconds)],
                stdout=subprocess.PIPE,
                text=True,
            ) as watching:
                assert watching.stdout is not None
                if watching.stdout.readline().strip() != "ready":
                    raise RuntimeError("the viewers saw no frame")
                before = shown.cpu()
                received = json.loads(watching.stdout.readline())
                used = shown.cpu() - before
        return {
            "cpu of the display (ms a second)": used / seconds * 1000,
            "frames a viewer (a second)": received["frames"],
            "bytes a viewer (kB a second)": received["bytes"] / 1000,
        }

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare one viewer with five and with twenty."""
    seconds = 2.0 if quick else 5.0
    contenders = [
        Contender(f"{viewers} viewers", watched_by(viewers, seconds))
        for viewers in (1, 20)
    ]
    title = f"{ROBOTS} robots with scans of {BEAMS} points"
    costs = compare(title, contenders, rounds)
    contenders = [
        Contender(f"{viewers} viewers", shown_to(viewers, BRIDGED, BEAMS, CONNECTED))
        for viewers in (1, 5, 20)
    ]
    title = f"{BRIDGED} robots of a rosbridge with scans of {BEAMS} points"
    return [costs, compare(title, contenders, rounds)]
