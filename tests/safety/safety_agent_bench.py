"""A robot with an agent, and an operator at a display on another computer.

::

    operator ─ display ── proxy ── router ── proxy ── agent ─ gate ── witness robot
                         "display"          "agent"

The robot never stops by itself: only the agent can stop it.
"""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import ExitStack
from pathlib import Path

from safety_bench import pass_time

from equipment.processes import Process
from equipment.waiting import wait_for
from webmap.core.motion import id_at_agent
from webmap.testing import FaultProxy, Sentinel, WitnessRobot

DRIVER = Path(__file__).with_name("safety_driver.py")

ROBOT = id_at_agent("bay3", "Bob")
"""The identifier that the agent gives to the robot."""

READY = r"is ready at zenoh://127\.0\.0\.1:(\d+)"


class FarDriver:
    """A display with an operator; see ``safety_driver.py``."""

    def __init__(self, url, robot, state):
        self._robot = robot
        self.reports, self.refused = [], []
        self.acquired, self.lost = [], []
        self.popen = subprocess.Popen(
            [sys.executable, DRIVER, url, robot],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "WEBMAP_STATE_DIR": str(state)},
            text=True,
        )
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    @property
    def now(self):
        """The last report of the gate about the robot."""
        return self.reports[-1] if self.reports else {}

    def acquire(self):
        """Let the program take control of the robot; return the answer."""
        before = len(self.acquired)
        self.order("acquire")
        wait_for(lambda: len(self.acquired) > before, "an answer", 20)
        return self.acquired[-1]

    def order(self, line):
        self.popen.stdin.write(f"{line}\n")
        self.popen.stdin.flush()

    def end(self):
        if self.popen.poll() is None:
            self.popen.send_signal(signal.SIGCONT)
            self.popen.stdin.close()
            try:
                self.popen.wait(15)
            except subprocess.TimeoutExpired:
                self.popen.kill()
                self.popen.wait()
        self._thread.join(10)
        self.popen.stdout.close()
        if not self.popen.stdin.closed:
            self.popen.stdin.close()

    def _read(self):
        kinds = {"robot": self.reports, "acquired": self.acquired, "lost": self.lost}
        for line in self.popen.stdout:
            message = json.loads(line)
            if message.get("robot") in (self._robot, None):
                kinds.get(message["op"], self.refused).append(message)


class AgentBench:
    """All processes between the operator and the robot."""

    def __init__(self, folder):
        self._folder = folder
        self._open = ExitStack()
        self.router = self.agent = None

    def __enter__(self):
        enter = self._open.enter_context
        os.environ["WEBMAP_STATE_DIR"] = str(self._folder / "agent")
        self.robot = enter(WitnessRobot(timeout=None))
        self.sentinel = enter(Sentinel())
        self._open.callback(self.end_router)
        self.start_router()
        self.display_hop = enter(FaultProxy(self.port))
        self.agent_hop = enter(FaultProxy(self.port))
        self._open.callback(self.end_agent)
        self.start_agent()
        self.driver = self.new_driver("west")
        return self

    def __exit__(self, *exception):
        self._open.close()

    def start_router(self):
        port = self.port if self.router else 0
        self.router = Process("router", "--listen", f"tcp/127.0.0.1:{port}")
        self.port = int(self.router.ready(READY))

    def end_router(self):
        if not self.router.popen.stdout.closed:
            self.router.popen.send_signal(signal.SIGCONT)
            self.router.end()

    def start_agent(self):
        self.agent = Process(
            "agent",
            self.robot.url,
            "--router",
            f"zenoh://127.0.0.1:{self.agent_hop.port}",
            "--name",
            "bay3",
            "--robot",
            "Bob:/odom:/cmd_vel:",
            "--stops-within",
            "0.5",
        )
        self.agent.ready("The agent (bay3) is ready")

    def end_agent(self):
        if not self.agent.popen.stdout.closed:
            self.agent.popen.send_signal(signal.SIGCONT)
            self.agent.end(signal.SIGTERM)

    def new_driver(self, name):
        url = f"zenoh://127.0.0.1:{self.display_hop.port}/bay3"
        driver = FarDriver(url, ROBOT, self._folder / name)
        self._open.callback(driver.end)
        wait_for(lambda: driver.now.get("link") == "up", "a report of the agent", 30)
        return driver

    def drive_off(self, within=20.0):
        """Take control and drive until the robot moves steadily.

        If the machine delays the commands too long, the page loses control.
        """
        driver, deadline = self.driver, time.monotonic() + within
        while time.monotonic() < deadline:
            driver.order("x 0")
            wait_for(
                lambda: driver.now.get("armable"), "a robot that can be driven", within
            )
            driver.order("take")
            try:
                wait_for(lambda: driver.now.get("mine"), "control of the robot", 3.0)
            except AssertionError:
                continue  # the agent refused: the display did not run for a while
            pass_time(0.5)
            driver.order("x 1")
            at = time.monotonic()
            pass_time(1.0)
            zeros = self.robot.log.first_zero(at)
            if zeros is None and self.robot.velocity.vx > 0.1:
                return
        refused = driver.refused[-3:]
        raise AssertionError(f"no steady motion: {driver.now}, refused: {refused}")

    def program_off(self, within=20.0):
        """Let the program take control and drive until the robot moves steadily.

        If the machine delays the commands too long, the program loses control.
        """
        driver, deadline = self.driver, time.monotonic() + within
        while time.monotonic() < deadline:
            wait_for(
                lambda: driver.now.get("armable"), "a robot that can be driven", within
            )
            driver.lost.clear()
            if "epoch" not in driver.acquire():
                continue
            driver.order("v 0.3")
            at = time.monotonic()
            pass_time(1.0)
            zeros = self.robot.log.first_zero(at)
            if zeros is None and not driver.lost and self.robot.velocity.vx > 0.1:
                return
        raise AssertionError(f"no steady motion: {driver.acquired[-1]}, {driver.lost}")
