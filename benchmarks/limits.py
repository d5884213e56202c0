"""How many robots, and how many viewers, until what is shown is too old.

Robots send odometry at 10 Hz; more and more of them, until the oldest percent of the
poses is older than 150 ms: at a viewer of the display, and at the gate, where each but
one was stopped and is watched, and where one is driven. Then more and more viewers of
100 robots, with the setting for it, until frames are that old; five more that read
nothing; and 500 with 5 frames a second.
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

from benchmarks.agents import Hand
from benchmarks.display import Display, bridged, stamped
from benchmarks.harness import Comparison, Figures, percentile
from benchmarks.plot import Curve, Plot, save
from benchmarks.processes import used
from benchmarks.stamped import SPEEDS, topics
from webmap.agents.gates import Gates
from webmap.gate.protocol import Report, RobotReport, RobotSpec

FEW = 50
"""The fewest robots that a gate watches: each was stopped."""

ROBOTS = (100, 200, 500, 1000, 2000, 4000)
VIEWERS = (50, 100, 200)
SHOWN = 100
"""Robots that the viewers see."""

STALLED = 5

MOST_VIEWERS, FRAME_RATE = 500, 5.0
"""The most viewers, and the frames a second that the settings then give to each."""

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
    """Return what viewers of a display receive, and its processor time."""
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
    """Return what one viewer sees of a number of robots."""
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
    """Return what many viewers see of some robots."""
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

    A report has the newest odometry, so that between two messages it becomes up to a
    period older; only the first report of each message counts.
    """

    def __init__(self) -> None:
        self.ages: list[float] = []
        self.up: set[str] = set()
        self.stopped: set[str] = set()
        self._last: dict[str, float] = {}

    def note(self, report: Report) -> None:
        """Note a report."""
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
            raise RuntimeError(f"never came: {what}")
        time.sleep(0.05)


def gate_with(robots: int, seconds: float) -> Figures:
    """Return what the gate knows of robots that were stopped, and how it answers.

    Each robot but the first was stopped, so the gate watches its odometry and keeps
    sending zero to it. An operator holds the first one.
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
                    bridge_url=url,
                    twist_topic=velocity,
                    odometry_topic=odometry,
                    odometry_type="nav_msgs/Odometry",
                )
            )
        _until(lambda: len(watch.up) == robots, "the connections")
        hand = Hand(gates, "r0")
        stopping = gates.connect("Bob", "viewer", lambda _text: None, print)
        for number in range(1, robots):
            stopping.receive(json.dumps({"op": "stop", "robot": f"r{number}"}))
        _until(lambda: len(watch.stopped) == robots - 1, "the stops")
        hand.take()
        gate = next(
            process
            for process in psutil.Process().children()
            if "webmap.gate" in process.cmdline()
        )
        ended = threading.Event()
        driving = threading.Thread(target=_drive, args=(hand, ended))
        driving.start()
        time.sleep(2.0)
        watch.ages.clear()
        hand.forget()
        before, begun = used(gate), time.monotonic()
        time.sleep(seconds)
        cpu = 100 * (used(gate) - before) / (time.monotonic() - begun)
        ages, trips = list(watch.ages), list(hand.trips)
        ended.set()
        driving.join()
    return {
        AGE_50: percentile(ages, 50),
        AGE_99: percentile(ages, 99),
        "from a command to its tick, 99 % (ms)": percentile(trips, 99),
        CPU: cpu,
    }


def _drive(hand: Hand, ended: threading.Event) -> None:
    while not ended.wait(0.05):
        if hand.holds:
            hand.drive(0.0)
        else:
            hand.take()


def ramp(
    title: str,
    measure: Callable[[int, float], Figures],
    counts: Iterable[int],
    seconds: float,
    what: str = "robots",
    age: str = AGE_99,
) -> Comparison:
    """Measure more and more of something until an age is too high, or nothing comes."""
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
    """Return in words where an age becomes higher than allowed."""
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
