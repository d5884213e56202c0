"""STOP and cancel reach the robot while a goal or a service call blocks a socket.

A rosbridge of ROS 2 runs an action goal, and a service call, on the thread that reads
the socket. All later messages on the same socket wait until the goal or call has ended.
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

import pytest
from playwright.sync_api import expect
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from equipment.chromium import watched_tab
from equipment.declarations import declared
from equipment.foxglove_actions import ABORTED, CANCELED, Navigation
from equipment.processes import WEB, reset, running
from equipment.waiting import wait_for
from webmap.config.motion import StopHook
from webmap.gate.display.client import GateClient
from webmap.testing import Sentinel, WitnessRobot

pytestmark = [pytest.mark.safety, pytest.mark.serial]

SITE = Path(__file__).with_name("safety_goal_site.py")

FAR = (0.0, 0.0, 0.0)
"""A goal that the simulated robot reaches after half a minute."""

STILL = 0.02
"""The speed in metres per second below which a robot counts as not moving."""

BRAKING = 2.0
"""Seconds after which a simulated robot that receives STOP must not move."""


class Simulator:
    """A simulator process of ROS 2 with one robot, and the odometry of the robot."""

    def __enter__(self):
        options = ["--port", "0", "--robots", "1", "--dialect", "ros2"]
        command = [sys.executable, "-m", "webmap", "sim", "--with-parent"]
        quirks = ["--quirks", "real,blocking_goals,blocking_services,hanging_stop"]
        self._process = subprocess.Popen(
            [*command, *options, *quirks],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self.url = self._process.stdout.readline().split()[-1]
        self._open = ExitStack()
        link = connect(self.url, max_size=None, proxy=None)
        self._socket = self._open.enter_context(link)
        subscribe = {"op": "subscribe", "topic": "/robot_0/odom"}
        self._socket.send(json.dumps(subscribe))
        self.speeds = []
        """The arrival time of each message, and its speed."""
        self._thread = threading.Thread(target=self._read)
        self._thread.start()
        return self

    def __exit__(self, *exception):
        self._open.close()
        self._thread.join(10)
        self._process.stdin.close()
        self._process.wait(10)
        self._process.stdout.close()

    @property
    def moves(self):
        return bool(self.speeds) and self.speeds[-1][1] > 0.2

    @property
    def is_still(self):
        return bool(self.speeds) and self.speeds[-1][1] < STILL

    def stays_still(self, seconds):
        """Return whether the robot does not move for a time from now on."""
        begun = time.monotonic()
        wait_for(lambda: self.speeds[-1][0] > begun + seconds, "odometry")
        return all(speed < STILL for at, speed in self.speeds if at > begun)

    def _read(self):
        try:
            for frame in self._socket:
                twist = json.loads(frame)["msg"]["twist"]["twist"]
                self.speeds.append((time.monotonic(), abs(twist["linear"]["x"])))
        except ConnectionClosed:
            pass


class Page:
    """A gate with one robot, and with a program that sends goals, and a page."""

    def __init__(self, **robot):
        self.reports, self.refused = [], []
        self.client = GateClient()
        self.client.declare(declared(id="r1", name="Bob", **robot))

    def __enter__(self):
        self.client.start()
        self._socket = self.client.connect("Ann", "operator", self._receive, print)
        wait_for(lambda: self.reports, "a report")
        wait_for(lambda: self.reports[-1]["armable"], "a robot that can be driven")
        return self

    def __exit__(self, *exception):
        self.client.stop()

    def send_away(self, x, y, yaw):
        self.client.take("r1").result(10)
        self.client.move("r1", x, y, yaw)

    def send(self, op, **fields):
        self._socket.receive(json.dumps({"op": op, "robot": "r1", **fields}))

    def reset(self):
        wait_for(lambda: self.reports[-1]["latched"], "STOP on the disk")
        self.send("reset", stop=self.reports[-1]["stop"]["id"])
        wait_for(lambda: not self.reports[-1]["latched"], "the reset")

    def _receive(self, text):
        message = json.loads(text)
        if message["op"] == "robot":
            self.reports.append(message)
        elif message["op"] == "refused":
            self.refused.append(message)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))


@pytest.fixture
def simulated(folder):
    with (
        Simulator() as robot,
        Page(
            bridge_url=robot.url,
            twist_topic="/robot_0/cmd_vel",
            odometry_topic="/robot_0/odom",
            odometry_type="nav_msgs/msg/Odometry",
            action="/robot_0/navigate_to_pose",
            stop_hooks=(StopHook(service="/robot_0/stop"),),
        ) as page,
    ):
        page.send_away(*FAR)
        wait_for(lambda: robot.moves, "motion")
        yield robot, page


def test_stop_ends_a_goal_that_blocks_its_socket_while_a_stop_hook_hangs(simulated):
    robot, page = simulated
    page.send("stop")
    wait_for(lambda: robot.is_still, "a standstill", BRAKING)
    page.reset()
    # The gate sends no more zeros, so a goal that was not cancelled would continue.
    assert robot.stays_still(2.0), "the goal continues after the reset"


def test_cancel_ends_a_goal_that_blocks_its_socket(simulated):
    robot, page = simulated
    page.send("cancel")
    wait_for(lambda: robot.is_still, "a standstill", BRAKING)
    assert robot.stays_still(1.0)


def test_cancel_ends_a_goal_while_a_stop_hook_hangs(simulated):
    robot, page = simulated
    page.send("stop")
    page.reset()
    wait_for(lambda: robot.is_still, "a standstill", BRAKING)
    page.send_away(*FAR)
    wait_for(lambda: robot.moves, "motion to the second goal")
    page.send("cancel")
    wait_for(lambda: robot.is_still, "a standstill", BRAKING)
    assert robot.stays_still(1.0)


def test_a_hanging_goal_and_service_call_do_not_delay_the_zero_of_a_stop(folder):
    with (
        Sentinel() as sentinel,
        WitnessRobot(goals_block=True) as robot,
        Page(
            bridge_url=robot.url,
            twist_topic="/cmd_vel",
            odometry_topic="/odom",
            odometry_type="nav_msgs/Odometry",
            action="/navigate_to_pose",
            stop_hooks=(StopHook(service="/e_stop"),),
        ) as page,
    ):
        page.send_away(1.0, 2.0, 0.0)
        wait_for(lambda: robot.log.of("send_action_goal"), "the goal")
        robot.answers_services(False)
        stopped = time.monotonic()
        page.send("stop")
        wait_for(lambda: robot.log.first_zero(stopped), "a zero")
        late = robot.log.first_zero(stopped) - stopped
        assert late < 0.1 + sentinel.stolen(stopped)

        def calls():
            return {
                received.message["service"] for received in robot.log.of("call_service")
            }

        wanted = {"/navigate_to_pose/_action/cancel_goal", "/e_stop"}
        wait_for(lambda: wanted <= calls(), "the cancel and the hook")
        (goal,) = robot.log.of("send_action_goal")
        links = {received.link for received in robot.log.of("call_service")}
        assert goal.link not in links, "a call on the link of the goal would wait"


def test_a_goal_through_foxglove_outlives_a_killed_gate_until_it_is_cancelled(folder):
    robot = {"action": "/navigate_to_pose", "twist_topic": None}
    with Navigation() as navigation:
        navigation.offer()
        with Page(bridge_url=navigation.url, **robot) as page:
            page.send_away(1.0, 2.0, 0.0)
            (first,) = wait_for(lambda: navigation.goals, "the goal")
            wait_for(
                lambda: page.reports[-1]["goal"]["state"] == "accepted", "its answer"
            )
            os.kill(page.client.pid, signal.SIGKILL)
            wait_for(
                lambda: page.reports[-1]["goal"] is None, "a report of the next gate"
            )
            wait_for(lambda: page.reports[-1]["armable"], "a robot that can be sent")
            navigation.feedback(1.5)
            page.send_away(3.0, 2.0, 0.0)
            wait_for(lambda: len(navigation.goals) == 2, "the next goal")
            assert not first.ended.is_set()
            first.end(ABORTED)
            navigation.feedback(2.5)
            wait_for(lambda: page.reports[-1]["goal"]["left"] == 2.5, "its feedback")
            assert page.reports[-1]["goal"]["state"] == "under way"
            page.send("stop")
            wait_for(
                lambda: page.reports[-1]["goal"]["state"] == "cancelled", "its end"
            )
            assert navigation.goals[1].result[0] == CANCELED


@pytest.fixture
def page_of_goals(folder, monkeypatch, chromium):
    """A page in a browser that shows a robot whose goals block their socket."""
    with Simulator() as robot:
        monkeypatch.setenv("SAFETY_BRIDGE", robot.url)
        display = running("run", SITE, "--port", 0, "--no-browser", pattern=WEB)
        with display as process, watched_tab(chromium, 1000, 700) as tab:
            tab.goto(process.url)
            expect(tab.locator(".robot.selected:not(.unplaced)")).to_be_attached()
            yield robot, tab


def aim(robot, tab):
    """Send the robot to the middle of the world; retry if the goal arrives too late."""
    for _ in range(10):
        go = tab.get_by_role("button", name="Send goal")
        go.click()
        expect(go).to_have_attribute("aria-pressed", "true")
        tab.mouse.move(500, 350)
        tab.mouse.down()
        tab.mouse.move(530, 350)
        tab.mouse.up()
        try:
            wait_for(lambda: robot.moves, "motion", 3.0)
        except AssertionError:
            continue
        return
    raise AssertionError(tab.inner_text("body"))


@pytest.mark.browser
def test_cancel_and_stop_on_the_page_end_goals_that_block_their_socket(page_of_goals):
    robot, tab = page_of_goals
    aim(robot, tab)
    tab.get_by_role("button", name="Cancel goal").first.click()
    wait_for(lambda: robot.is_still, "a standstill after the cancel", BRAKING)
    assert robot.stays_still(1.0)

    aim(robot, tab)
    tab.keyboard.press("Space")
    wait_for(lambda: robot.is_still, "a standstill after STOP", BRAKING)
    expect(tab.locator(".webmap-teleop")).to_have_attribute("data-state", "stopped")
    reset(tab)
    # The gate sends no more zeros, so a goal that was not cancelled would continue.
    assert robot.stays_still(2.0), "the goal continues after the reset"
