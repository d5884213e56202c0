"""Starts a real ROS 2 graph and a rosbridge of another project."""

import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import NamedTuple

from ros_facts import ROBOT
from websockets.sync.client import connect

from equipment.environment import outside
from equipment.waiting import wait_for
from webmap.testing import FaultProxy

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
FOLDER = Path(sys.prefix) / "ros"
"""A folder beside the environment of the tests, removed together with it."""

CANNOT = 3


def installed():
    """Install ROS if it is missing; return the paths, or why it cannot be installed."""
    if sys.prefix == sys.base_prefix:
        return None, "the tests do not run in a virtual environment to put it into"
    done = subprocess.run(
        [sys.executable, ROOT / "tools" / "make_ros.py", FOLDER],
        capture_output=True,
        text=True,
        env=outside(),
        check=False,
    )
    if done.returncode == CANNOT:
        return None, done.stdout.strip()
    assert done.returncode == 0, done.stderr
    return json.loads((FOLDER / "about.json").read_text()), ""


class Twist(NamedTuple):
    """A velocity that reached the robot."""

    speed: float
    turn: float
    at: float
    """The time on the monotonic clock, which all processes share."""

    pose: tuple[float, float, float]
    """The place of the robot at that time: x, y, yaw."""

    @property
    def is_zero(self):
        return (self.speed, self.turn) == (0.0, 0.0)


class Program:
    """A program of ROS, and each line of its output."""

    def __init__(self, command, environment):
        self.lines = []
        self.popen = subprocess.Popen(
            [str(part) for part in command],
            env={**os.environ, **environment},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self):
        for line in self.popen.stdout:
            self.lines.append(line)

    def wait_for(self, pattern, within=60.0):
        """Return the match in the first line that has one."""

        def found():
            for line in list(self.lines):
                if match := re.search(pattern, line):
                    return match
            assert self.popen.poll() is None, "".join(self.lines)
            return None

        lines = lambda: f"{pattern!r} in:\n{''.join(self.lines)}"  # noqa: E731
        return wait_for(found, lines, within)

    def end(self, sig=signal.SIGINT):
        self.popen.send_signal(sig)
        try:
            self.popen.wait(10)
        except subprocess.TimeoutExpired:
            self.popen.kill()
            self.popen.wait()
        self._reader.join(10)
        self.popen.stdout.close()


class Ros:
    """One ROS graph with a robot, and its rosbridge."""

    def __init__(self, about):
        self._about = about
        # A separate domain for each process, so that parallel runs do not mix.
        domain = str(os.getpid() % 100 + 1)
        self._environment = {**about["environment"], "ROS_DOMAIN_ID": domain}
        python = FOLDER / "bin" / "python"
        self.graph = Program([python, HERE / "ros_graph.py"], self._environment)
        self.bridge = None
        self._door = FaultProxy(0)
        self._door.refuse()

    @property
    def url(self):
        """The address of the rosbridge, the same after each start."""
        return f"ws://127.0.0.1:{self._door.port}"

    def start_bridge(self):
        """Start a rosbridge, and let clients in when it has found the robot.

        On a busy machine this takes seconds after the bridge began to listen. Messages
        that are published before then are lost, also a zero.
        """
        self.graph.wait_for("ready")
        self.bridge = Program(
            [self._about["bridge"], "--bind", "127.0.0.1:0", "--no-rosapi",
             "--log-ansi", "false", "--log-directory", FOLDER / "log"],
            # The libraries of ROS must be loaded by Python.
            {**self._environment, "LD_PRELOAD": self._about["library"]},
        )  # fmt: skip
        found = self.bridge.wait_for(r"listening address=127\.0\.0\.1:(\d+)")
        wait_until_known(f"ws://127.0.0.1:{found[1]}", f"{ROBOT}/odom")
        self._door.target = int(found[1])
        self._door.refuse(False)

    def kill_bridge(self):
        self._door.refuse()
        self.bridge.end(signal.SIGKILL)
        self.bridge = None

    def twists(self):
        """Each velocity that reached the robot, in order."""
        received = [
            json.loads(line) for line in list(self.graph.lines) if "twist" in line
        ]
        return [Twist(*each["twist"], each["at"], each["pose"]) for each in received]

    def end(self):
        for program in (self.bridge, self.graph):
            if program is not None:
                program.end()
        self._door.end()


def wait_until_known(url, topic, within=60.0):
    """Wait until a bridge has found a topic."""
    subscribe = json.dumps({"op": "subscribe", "topic": topic})
    deadline = time.monotonic() + within
    with connect(url, proxy=None) as socket:
        while time.monotonic() < deadline:
            socket.send(subscribe)
            with contextlib.suppress(TimeoutError):
                if json.loads(socket.recv(timeout=0.5))["op"] == "publish":
                    return
    raise AssertionError(f"{topic} is not known to the bridge")


@contextlib.contextmanager
def running(about):
    """Run a graph and its rosbridge."""
    ros = Ros(about)
    try:
        ros.start_bridge()
        yield ros
    finally:
        ros.end()
