"""kill -9 of the gate, the display or both: STOP stays active and nothing moves."""

import json
import os
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import psutil
import pytest
from safety_bench import ROBOT_TIMEOUT, pass_time
from safety_figures import Figure, note
from safety_run import FULL, TRIALS, Progress, grace, is_measured

from equipment.waiting import wait_for
from webmap.testing import Bounds, Quiet, Sentinel, WitnessRobot, check_invariants

pytestmark = [pytest.mark.safety, pytest.mark.serial]

DRIVER = Path(__file__).with_name("safety_driver.py")

LAST = 200
"""The last step, of 10 ms each, after which a process is killed."""

SCRIPT = [(0.0, "take"), (0.05, "x 0"), (0.5, "x 1"), (1.2, "stop"), (1.5, "x 1")]
"""The orders to the operator and their times: drive for 0.7 s, then STOP."""

KILLS = range(1, LAST + 1) if FULL else range(5, LAST, 30 // TRIALS)
KILLS_OF_BOTH = KILLS if FULL else range(5, LAST, 90)

LANES = 4
"""The number of robots that are driven at the same time; each mostly waits."""


class Driver:
    """A process of ``safety_driver.py``: an operator, and a gate as its child."""

    def __init__(self, url, state):
        self.reports, self.refused = [], []
        self.popen = subprocess.Popen(
            [sys.executable, str(DRIVER), url],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "WEBMAP_STATE_DIR": str(state)},
            text=True,
        )
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()
        wait_for(lambda: self.now.get("link") == "up", "a link to the robot")

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        if self.popen.poll() is None:
            self.popen.stdin.close()
            self.popen.wait(10)
        self._thread.join(10)
        self.popen.stdout.close()
        if not self.popen.stdin.closed:
            self.popen.stdin.close()

    @property
    def now(self):
        """The last report of the gate about the robot."""
        return self.reports[-1] if self.reports else {}

    @property
    def gate(self):
        (gate,) = psutil.Process(self.popen.pid).children()
        return gate

    def order(self, line):
        self.popen.stdin.write(f"{line}\n")
        self.popen.stdin.flush()

    def _read(self):
        for line in self.popen.stdout:
            message = json.loads(line)
            (self.reports if message["op"] == "robot" else self.refused).append(message)


def play(driver, robot, steps):
    """Send the orders of the script for some steps; return whether STOP is active."""
    wait_for(lambda: driver.now.get("armable") or driver.now.get("latched"), "a gate")
    begin = time.monotonic()
    todo = list(SCRIPT)
    while (passed := time.monotonic() - begin) < steps * 0.01:
        while todo and todo[0][0] <= passed:
            driver.order(todo.pop(0)[1])
        pass_time(0.001)
    return driver.now.get("latched") is True


def try_to_drive(driver):
    """Take control with released keys, then press, as an operator does."""
    driver.order("x 0")
    driver.order("take")
    pass_time(0.5)
    driver.order("x 1")
    pass_time(0.4)


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("part", ["gate", "display", "both"])
def test_after_a_kill_no_motion_resumes_and_an_acknowledged_stop_stays_active(
    tmp_path, part
):
    name = f"{WHAT[part]} killed after step n of {LAST}; STOP stays"
    if is_measured(name):
        pytest.skip("the resumed run already has this figure")
    steps = KILLS_OF_BOTH if part == "both" else KILLS
    progress, kills = Progress(name, len(steps)), []
    with Sentinel() as sentinel, ThreadPoolExecutor(LANES) as lanes:
        once = partial(kill_after, part=part, folder=tmp_path, sentinel=sentinel)
        for kill in lanes.map(once, steps):
            kills.append(kill)
            progress.add(kill.late, kill.jitter)
    assert any(kill.acknowledged for kill in kills), "no kill came after a STOP"
    assert any(kill.drove_again for kill in kills), "no robot could be driven again"
    note(
        Figure(
            name=name,
            stops_by="zero" if part == "display" else "itself",
            promised=PROMISED[part],
            worst=max(kill.late for kill in kills),
            jitter=max(kill.jitter for kill in kills),
            trials=len(kills),
        )
    )


def test_a_full_run_has_200_kills_and_each_run_kills_after_the_script_too():
    assert not FULL or len(KILLS) == LAST
    assert max(KILLS) * 0.01 > SCRIPT[-1][0], "the last kill must come after the script"


BY_ITSELF = ROBOT_TIMEOUT + 0.05
PROMISED = {"gate": BY_ITSELF, "display": 0.3, "both": BY_ITSELF}
"""Seconds until the robot stops, by its command timeout or by a zero of the gate."""

WHAT = {
    "gate": "the gate is",
    "display": "the display is",
    "both": "the gate and the display are",
}


@dataclass(frozen=True)
class Kill:
    """The result of one kill; times are in seconds."""

    late: float
    jitter: float
    acknowledged: bool
    """Whether the gate had reported an active STOP before the kill."""

    drove_again: bool


def kill_after(steps, *, part, folder, sentinel):
    """Kill a part after a number of steps, with a separate robot and state folder."""
    with WitnessRobot(timeout=ROBOT_TIMEOUT) as robot:
        return kill_one(steps, part, robot, folder / str(steps), sentinel)


def kill_one(steps, part, robot, state, sentinel):
    """Kill a part after a number of steps, and try to drive afterwards."""
    begin = time.monotonic()
    with Driver(robot.url, state) as driver:
        acknowledged = play(driver, robot, steps)
        seen = len(driver.reports)
        killed_at = time.monotonic()
        if part == "gate":
            driver.gate.kill()
            # The operator still presses while the display starts another gate.
            wait_for(lambda: len(driver.reports) > seen + 1, "another gate")
            wait_for(lambda: driver.now.get("link") == "up", "its link")
            pass_time(0.8)
            resumed_until = time.monotonic()
            try_to_drive(driver)
        else:
            if part == "both":
                driver.gate.kill()  # first, or it would notice the end of its pipe
            driver.popen.kill()
            driver.popen.wait(10)
            pass_time(0.8)
            resumed_until = time.monotonic()
    if part != "gate":
        with Driver(robot.url, state) as driver:
            pass_time(0.3)
            resumed_until = time.monotonic()
            try_to_drive(driver)
    pass_time(0.7)
    rest = robot.log.standstill(killed_at)
    moved = robot.log.moving_since(resumed_until)
    if acknowledged:
        assert not moved, f"killed after step {steps}: STOP was not active"
    rests = [m for m in robot.log.moved if killed_at <= m.at < resumed_until]
    moving = [m.at for m in rests if abs(m.twist.vx) > 0.01]
    on = max(moving) - killed_at if moving else 0.0
    bound = PROMISED[part]
    bad_luck = sentinel.stolen(killed_at, killed_at + bound)
    assert on <= bound + grace(bad_luck), (
        f"killed after step {steps}: the robot moved for {on} s"
    )
    assert rest is not None
    still = killed_at + 0.3 + bad_luck
    wrong = check_invariants(
        [received for received in robot.log.twists if received.at >= begin],
        Bounds(1.0, 1.5, zeros=1e9),
        quiet=[Quiet(still, resumed_until, f"killed after step {steps}")],
        unreachable=[(killed_at - 0.5, killed_at + 10.0)],
    )
    assert not wrong, wrong
    return Kill(on, bad_luck, acknowledged, drove_again=bool(moved))
