"""The numbers of robots and of viewers at which poses and frames become too old.

Robots send odometry at 10 Hz. Their number grows until one percent of the poses is
older than 150 ms: first at a viewer of the display, then at the gate, which has stopped
and watches all robots but one, and drives that one. Then the number of viewers of 100
robots grows until frames are older than 150 ms. Two more runs have five viewers that
read nothing, and 500 viewers with 5 frames a second.
"""

import json
import math
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import ExitStack

import psutil

from benchmarks.agents import Operator
from benchmarks.display import Display, bridged, stamped
from benchmarks.harness import Comparison, Figures, percentile
from benchmarks.plot import Curve, Plot, save
from benchmarks.processes import used
from benchmarks.stamped import SPEEDS, topics
from webmap.agents.gates import Gates
from webmap.config.motion import TwistConfig
from webmap.gate.protocol import Report, RobotReport, RobotSpec

FEW = 50
"""The smallest number of robots that a gate watches; it has stopped them."""

ROBOTS = (100, 200, 500, 1000, 2000, 4000)
VIEWERS = (50, 100, 200)
SHOWN = 100
"""The number of robots that the display shows to many viewers."""

STALLED = 5

MOST_VIEWERS, FRAME_RATE = 500, 5.0
"""The greatest number of viewers, and their frames a second in this run."""

TOO_OLD = 150.0
"""Milliseconds."""

AGE_50, AGE_99 = "pose age, 50 % (ms)", "pose age, 99 % (ms)"
ARRIVED = "poses that arrive (%)"
CPU = "processor (% of a core)"
FRAME_50, FRAME_99 = "frame age, 50 % (ms)", "frame age, 99 % (ms)"


def busy(process: psutil.Process, seconds: float) -> float:
    """Return the share of a core that a process uses in a time, in percent."""
    before, begun = sum(process.cpu_times()[:2]), time.monotonic()
    time.sleep(seconds)
    spent = sum(process.cpu_times()[:2]) - before
    return float(100 * spent / (time.monotonic() - begun))


def seen(
    shown: Display, viewers: int, seconds: float, stalled: int = 0
) -> dict[str, float]:
    """Return the figures of the viewers of a display, and its processor time."""
    command = [sys.executable, "-m", "benchmarks.watchers", shown.url, str(viewers)]
    with subprocess.Popen(
        [*command, str(seconds), "1", str(stalled)], stdout=subprocess.PIPE, text=True
    ) as watching:
        assert watching.stdout is not None
        if watching.stdout.readline().strip() != "ready":
            raise RuntimeError("the viewers saw no frame")
        cpu = busy(shown.process, 0.8 * seconds)
        found: dict[str, float] = json.loads(watching.stdout.readline())
    return found | {CPU: cpu}


def display_with(robots: int, seconds: float) -> Figures:
    """Return the figures of one viewer of a number of robots."""
    with bridged(robots) as shown:
        found = seen(shown, 1, seconds)
    return {
        AGE_50: found["pose age, 50"],
        AGE_99: found["pose age, 99"],
        ARRIVED: 10 * found["poses"] / robots,
        CPU: found[CPU],
    }


def viewed_by(
    viewers: int, seconds: float, stalled: int = 0, frame_rate: float | None = None
) -> Figures:
    """Return the figures of many viewers of some robots."""
    pages = viewers + stalled
    with bridged(SHOWN, viewers=pages, frame_rate=frame_rate) as shown:
        found = seen(shown, viewers, seconds, stalled)
    return {
        FRAME_50: found["frame age, 50"],
        FRAME_99: found["frame age, 99"],
        "frames of the slowest viewer (a second)": found["least frames"],
        "bytes to all viewers (MB a second)": found["bytes"] * viewers / 1e6,
        CPU: found[CPU],
    }


class Watch:
    """The ages of the odometry that the gate reports.

    A report contains the newest odometry, whose age grows until the next message.
    Therefore only the first report of each message counts.
    """

    def __init__(self) -> None:
        self.ages: list[float] = []
        self.up: set[str] = set()
        self.stopped: set[str] = set()
        self._last: dict[str, float] = {}

    def note(self, report: Report) -> None:
        """Record a report."""
        if not isinstance(report, RobotReport):
            return
        now = time.monotonic()
        if report.link == "up":
            self.up.add(report.robot)
        if report.latched:
            self.stopped.add(report.robot)
        if report.measured is None:
            return
        sent = report.measured[0]
        if self._last.get(report.robot) != sent:
            self._last[report.robot] = sent
            self.ages.append(1000 * ((now - sent) % SPEEDS))


def _until(check: Callable[[], bool], what: str) -> None:
    deadline = time.monotonic() + 60
    while not check():
        if time.monotonic() > deadline:
            raise RuntimeError(f"timeout: {what}")
        time.sleep(0.05)


def gate_with(robots: int, seconds: float) -> Figures:
    """Return the ages of odometry at a gate, and the times until it acknowledges.

    An operator has control of the first robot. All others have been stopped, so the
    gate watches their odometry and sends zeros to them.
    """
    with ExitStack() as running:
        os.environ["WEBMAP_STATE_DIR"] = running.enter_context(
            tempfile.TemporaryDirectory()
        )
        url = running.enter_context(stamped(robots))
        watch, gates = Watch(), Gates()
        gates.on_report(watch.note)
        gates.start()
        running.callback(gates.stop)
        for number in range(robots):
            odometry, velocity, _ = topics(number)
            gates.declare(
                RobotSpec(
                    id=f"r{number}",
                    name=f"robot {number}",
                    twist=TwistConfig(topic=velocity, bridge=url),
                    odometry_topic=odometry,
                    odometry_type="nav_msgs/Odometry",
                )
            )
        _until(lambda: len(watch.up) == robots, "the connections")
        operator = Operator(gates, "r0")
        stopping = gates.connect("Bob", "viewer", lambda _text: None, print)
        for number in range(1, robots):
            stopping.receive(json.dumps({"op": "stop", "robot": f"r{number}"}))
        _until(lambda: len(watch.stopped) == robots - 1, "the stops")
        operator.take()
        gate = next(
            process
            for process in psutil.Process().children()
            if "webmap.gate" in process.cmdline()
        )
        ended = threading.Event()
        driving = threading.Thread(target=_drive, args=(operator, ended))
        driving.start()
        time.sleep(2.0)
        watch.ages.clear()
        operator.forget()
        before, begun = used(gate), time.monotonic()
        time.sleep(seconds)
        cpu = 100 * (used(gate) - before) / (time.monotonic() - begun)
        ages, trips = list(watch.ages), list(operator.trips)
        ended.set()
        driving.join()
    return {
        AGE_50: percentile(ages, 50),
        AGE_99: percentile(ages, 99),
        "from a command to its tick, 99 % (ms)": percentile(trips, 99),
        CPU: cpu,
    }


def _drive(operator: Operator, ended: threading.Event) -> None:
    while not ended.wait(0.05):
        if operator.holds:
            operator.drive(0.0)
        else:
            operator.take()


def ramp(
    title: str,
    measure: Callable[[int, float], Figures],
    counts: Iterable[int],
    seconds: float,
    what: str = "robots",
    age: str = AGE_99,
) -> Comparison:
    """Measure growing numbers until an age is too high, or no data arrives."""
    found: dict[str, list[Figures]] = {}
    for count in counts:
        print(f"{title}: {count} {what}", file=sys.stderr)
        try:
            figures = measure(count, seconds)
        except (RuntimeError, TimeoutError) as error:
            print(f"{title}: {count} {what}: {error}", file=sys.stderr)
            if not found:
                raise
            names = next(iter(found.values()))[0]
            figures = dict.fromkeys(names, math.nan)
        found[f"{count} {what}"] = [figures]
        if not figures[age] <= TOO_OLD:
            break
    return Comparison(title, found)


def end_of(comparison: Comparison, age: str = AGE_99) -> str:
    """Return a sentence with the number at which an age becomes too high."""
    ages = [
        (int(name.split()[0]), comparison.median(name, age)) for name in comparison.runs
    ]
    well = max((count for count, age in ages if age <= TOO_OLD), default=0)
    late = min((count for count, age in ages if not age <= TOO_OLD), default=math.inf)
    what = next(iter(comparison.runs)).split()[1]
    end = f"between {well} and {late} {what}" if late < math.inf else f"above {well}"
    old = f"{age.split()[0]}s are older than {TOO_OLD:.0f} ms"
    return f"{comparison.title}: {old} {end}"


def plot(ramps: Iterable[Comparison]) -> Plot:
    """Return the age of poses against the number of robots."""
    curves = [
        Curve(
            each.title,
            [(int(name.split()[0]), each.median(name, AGE_99)) for name in each.runs],
        )
        for each in ramps
    ]
    return Plot("Age of poses, 99 %", "robots at 10 Hz", "ms", curves)


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Find the limits; one round, because each step is long enough."""
    del rounds
    seconds = 2.0 if quick else 2.5
    robots = ROBOTS[:2] if quick else ROBOTS
    viewers = VIEWERS[:1] if quick else VIEWERS
    ramps = [
        ramp(
            "robots that a display shows to one viewer", display_with, robots, seconds
        ),
        ramp("robots that a gate watches", gate_with, (FEW, *robots), seconds),
    ]
    for each in ramps:
        print(end_of(each), end="\n\n")
    save("limits", plot(ramps))
    many = ramp(
        f"viewers of {SHOWN} robots", viewed_by, viewers, seconds, "viewers", FRAME_99
    )
    print(end_of(many, FRAME_99), end="\n\n")
    stalled = viewed_by(viewers[0], seconds, STALLED)
    many.runs[f"{viewers[0]} viewers and {STALLED} that stall"] = [stalled]
    if not quick:
        most = viewed_by(MOST_VIEWERS, seconds, frame_rate=FRAME_RATE)
        many.runs[f"{MOST_VIEWERS} viewers at {FRAME_RATE:g} frames a second"] = [most]
    return [*ramps, many]
