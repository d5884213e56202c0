"""The work for an unwatched robot, in timers and calls instead of seconds."""

import asyncio
import json
import sys
import time

import pytest
from pose_script import CountingLoop, odometry

import webmap
from webmap.base.audience import RARELY, audience
from webmap.console.robot_looks import make_robot
from webmap.features.alerts.alerts import Alerts, AlertWatch

URL = "ws://robot:9090"
PERIOD = RARELY / 1000
ROBOTS = 40


@pytest.fixture(autouse=True)
def somebody_looks():
    yield
    audience._set(True)


class Fleet:
    """Robots of the console behind one bridge, without a page."""

    def __init__(self, loop):
        self.loop = loop
        self.bridge = webmap.Bridge(URL)
        self.bridge._fan_out.begin(loop)
        self.bridge._link.lane.state = "open"
        self.bridge._link._send = lambda frame: None
        self.robots = [
            make_robot(webmap.RobotConfig.from_dict(self.config(n)), [self.bridge])
            for n in range(ROBOTS)
        ]
        self.watch = AlertWatch(Alerts(), lambda: self.robots)

    @staticmethod
    def config(number):
        return {
            "name": f"Robot {number}",
            "bridge": URL,
            "odometry": {"topic": f"/robot_{number}/odom", "type": "nav_msgs/Odometry"},
            "twist": {"topic": f"/robot_{number}/cmd_vel", "stops_within": 0.25},
            "modules": [{"name": "Trail", "options": {"length": 10.0}}],
        }

    async def send(self, seconds):
        """Send the poses of a bridge while no page is open, spread over time."""
        until = self.loop.now + seconds
        while self.loop.now < until:
            for number in range(ROBOTS):
                stamp = self.loop.now
                message = odometry(stamp, stamp=stamp, v=1.0)
                topic = f"/robot_{number}/odom"
                frame = {"op": "publish", "topic": topic, "msg": message}
                self.bridge._link._received(json.dumps(frame).encode())
                await asyncio.sleep(PERIOD / ROBOTS)

    def destroy(self):
        for robot in self.robots:
            robot.destroy()


def test_a_robot_at_which_nobody_looks_needs_few_timers_and_calls(monkeypatch):
    calls = 0

    def count(frame, event, argument):
        nonlocal calls
        ours = "/webmap/" in frame.f_code.co_filename
        calls += event == "call" and ours

    async def scenario():
        loop = asyncio.get_running_loop()
        monkeypatch.setattr(time, "monotonic", loop.time)
        fleet = Fleet(loop)
        audience._set(False)
        for topic in fleet.bridge._topics.values():  # messages that were late before
            for listener in topic.listeners:
                listener.throttle.offer("first", loop.now - 0.4 * PERIOD)
                listener.throttle.offer("second", loop.now + 0.1 * PERIOD)
        fleet.watch.start(loop)
        await fleet.send(5 * PERIOD)
        before, loop.timers = fleet.bridge.stats.frames, 0
        sys.setprofile(count)
        await fleet.send(4 * PERIOD)
        sys.setprofile(None)
        poses = fleet.bridge.stats.frames - before
        assert poses == 4 * ROBOTS
        # One timer is of this test; the log needs one to notice the end of the poses.
        assert (loop.timers - poses) / poses < 1.3
        assert calls / poses < 130
        audience._set(True)
        for robot in fleet.robots:
            place = robot.svg._transform
            assert place == (robot.position.x, robot.position.y, robot.yaw)
            assert robot.svg._age.measured == pytest.approx(robot.pose_stamp)
        await fleet.watch.stop()
        fleet.destroy()

    with asyncio.Runner(loop_factory=CountingLoop) as runner:
        runner.run(scenario())


def test_who_begins_to_look_sees_everything_where_the_robot_is_now(monkeypatch):
    async def scenario():
        loop = asyncio.get_running_loop()
        monkeypatch.setattr(time, "monotonic", loop.time)
        fleet = Fleet(loop)
        await fleet.send(PERIOD)
        trail, mark = fleet.robots[0].modules
        audience._set(False)
        await fleet.send(4 * PERIOD)
        audience._set(True)
        robot = fleet.robots[0]
        drawn = [trail.svg._transform, mark.svg._transform]
        robot.pose_source.draw()
        mark.on_odometry_update()
        assert drawn == [trail.svg._transform, mark.svg._transform]
        assert drawn[0][:2] == pytest.approx((-robot.position.x, -robot.position.y))
        fleet.destroy()

    with asyncio.Runner(loop_factory=CountingLoop) as runner:
        runner.run(scenario())
