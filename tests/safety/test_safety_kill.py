"""kill -9 of the gate and of the display at any moment: nothing resumes, STOP stays."""

import json
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import psutil
import pytest
from safety_bench import ROBOT_TIMEOUT, TRIALS, pass_time, wait_for
from safety_figures import Figure, note

from webmap.testing import Bounds, Quiet, Sentinel, WitnessRobot, check_invariants

pytestmark = [pytest.mark.safety, pytest.mark.serial]

DRIVER = Path(__file__).with_name("safety_driver.py")

LAST = 200
"""The last of the gate's steps, of 10 ms each, after which it is killed."""

SCRIPT = [(0.0, "take"), (0.05, "x 0"), (0.5, "x 1"), (1.2, "stop"), (1.5, "x 1")]
"""What the hand does, and after how many seconds: drive for 0.7 s, then STOP."""

COUNT = min(LAST, 4 * TRIALS)
KILLS = [round(LAST * (n + 0.5) / COUNT) for n in range(COUNT)]


class Driver:
    """A process with a gate and a hand."""

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
        """What the gate said last of the robot."""
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


@pytest.fixture
def robot():
    with WitnessRobot(timeout=ROBOT_TIMEOUT) as robot:
        yield robot


def play(driver, robot, steps):
    """Let the hand do as the script says until so many steps of the gate are over."""
    wait_for(lambda: driver.now.get("armable") or driver.now.get("latched"), "a gate")
    begin = time.monotonic()
    todo = list(SCRIPT)
    while (passed := time.monotonic() - begin) < steps * 0.01:
        while todo and todo[0][0] <= passed:
            driver.order(todo.pop(0)[1])
        pass_time(0.001)
    return driver.now.get("latched") is True


def try_to_drive(driver):
    """Take the robot, show released keys, press: what a person would do."""
    driver.order("x 0")
    driver.order("take")
    pass_time(0.5)
    driver.order("x 1")
    pass_time(0.4)


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("part", ["gate", "display"])
def test_after_a_kill_nothing_resumes_and_an_acknowledged_stop_stands(
    robot, tmp_path, part
):
    late, stood, again, jitter = [], 0, 0, []
    with Sentinel() as sentinel:
        for number, steps in enumerate(KILLS):
            one = kill_after(steps, part, robot, tmp_path / str(number), sentinel)
            late.append(one[0])
            jitter.append(one[1])
            stood += one[2]
            again += one[3]
    assert stood, "no kill came after an acknowledged STOP"
    assert again, "nothing could be driven again, so that the test shows nothing"
    note(
        Figure(
            name=f"the {part} is killed after step n of {LAST}; STOP stays",
            stops_by="itself" if part == "gate" else "zero",
            promised=ROBOT_TIMEOUT + 0.05 if part == "gate" else 0.3,
            worst=max(late),
            jitter=max(jitter),
            trials=len(KILLS),
        )
    )


def kill_after(steps, part, robot, state, sentinel):
    """Kill a part after so many steps; return how long the robot moved on."""
    begin = time.monotonic()
    with Driver(robot.url, state) as driver:
        acknowledged = play(driver, robot, steps)
        seen = len(driver.reports)
        killed_at = time.monotonic()
        if part == "gate":
            driver.gate.kill()
            # The hand goes on pressing while another gate is started.
            wait_for(lambda: len(driver.reports) > seen + 1, "another gate")
            wait_for(lambda: driver.now.get("link") == "up", "its link")
            pass_time(0.8)
            resumed_until = time.monotonic()
            try_to_drive(driver)
        else:
            driver.popen.kill()
            driver.popen.wait(10)
            pass_time(0.8)
            resumed_until = time.monotonic()
    if part == "display":
        with Driver(robot.url, state) as driver:
            pass_time(0.3)
            resumed_until = time.monotonic()
            try_to_drive(driver)
    pass_time(0.7)
    rest = robot.log.standstill(killed_at)
    moved = robot.log.moving_since(resumed_until)
    if acknowledged:
        assert not moved, f"killed after step {steps}: STOP did not stand"
    rests = [m for m in robot.log.moved if killed_at <= m.at < resumed_until]
    moving = [m.at for m in rests if abs(m.twist.vx) > 0.01]
    on = max(moving) - killed_at if moving else 0.0
    bound = ROBOT_TIMEOUT + 0.05 if part == "gate" else 0.3
    bad_luck = sentinel.stolen(killed_at, killed_at + bound)
    assert on <= bound + bad_luck, f"killed after step {steps}: it moved on for {on} s"
    assert rest is not None
    still = killed_at + 0.3 + bad_luck
    wrong = check_invariants(
        [told for told in robot.log.told if told.at >= begin],
        Bounds(1.0, 1.5, zeros=1e9),
        quiet=[Quiet(still, resumed_until, f"killed after step {steps}")],
        unreachable=[(killed_at - 0.5, killed_at + 10.0)],
    )
    assert not wrong, wrong
    return on, bad_luck, acknowledged, bool(moved)
