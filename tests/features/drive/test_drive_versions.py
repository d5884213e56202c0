"""WebMap at every version of rosbridge that the simulator plays.

Each robot is found, driven, stopped and sent to goals, one of which it rejects.
"""

import asyncio
import time

import pytest
from running_simulators import simulators

from equipment.declarations import declared
from equipment.waiting import until, wait_for
from webmap.base.geometry import Twist
from webmap.discovery import discover
from webmap.gate.display.client import GateClient
from webmap.gate.protocol import RobotReport
from webmap.ros.rosbridge.server.dialect import REAL, dialect_of
from webmap.ros.temporary_bridge import TemporaryBridge

pytestmark = [pytest.mark.slow, pytest.mark.serial]  # it drives in real time

ACTIONS = {
    "ros1": ("move_base", "move_base_msgs/MoveBaseAction"),
    "ros2": ("navigate_to_pose", "nav2_msgs/action/NavigateToPose"),
}
FAR = (15.8, -4.2)
REJECTED = {
    "0.11": ("failed", "the goal is in no known frame"),
    "2.1": ("unknown", "perhaps rejected: the robot did not answer within 5 s"),
}
"""The report on a goal that the robot rejects; newer versions send the rejection."""


class Site:
    """A simulator, and a gate with one of its robots declared twice.

    The goals of ``bob`` are in the map, those of ``lost`` in a frame that no robot
    knows.
    """

    def __init__(self, version, simulator):
        self.version, self.simulator = version, simulator
        self.robot = simulator.world.robots[1]
        self.client = GateClient()
        self.reports = {}
        self.client.on_report(self._hear)
        action, type = ACTIONS[dialect_of(version)]
        for id, frame in (("bob", "map"), ("lost", "moon")):
            self.client.declare(
                declared(
                    id=id,
                    name=id,
                    bridge_url=simulator.url,
                    twist_topic=f"{self.robot.topics}/cmd_vel",
                    stops_within=0.25,
                    action=f"{self.robot.topics}/{action}",
                    action_type=type,
                    goal_frame=frame,
                )
            )

    def _hear(self, report):
        if isinstance(report, RobotReport):
            self.reports[report.robot] = report

    def wait(self, test, id="bob"):
        def found():
            report = self.reports.get(id)
            return report is not None and test(report) and report

        return wait_for(found, lambda: f"a report: {self.reports.get(id)}")

    def take(self, id="bob"):
        self.wait(lambda report: report.armable and report.link == "up", id)
        self.client.take(id).result(10)

    def stop_and_reset(self):
        self.client.stop_robot("bob")
        stopped = self.wait(lambda report: report.latched and report.stop is not None)
        wait_for(lambda: self.robot.twist.is_zero, "a standstill")
        self.client.reset("bob", stopped.stop.id)
        self.wait(lambda report: not report.latched)
        # Only zeros were sent until now, so a goal that was not cancelled continues.
        time.sleep(0.5)
        assert self.robot.twist.is_zero


@pytest.fixture(scope="module", params=REAL)
def site(request, tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch, simulators(request.param) as found:
        patch.setenv("WEBMAP_STATE_DIR", str(tmp_path_factory.mktemp("state")))
        made = Site(request.param, found[request.param])
        made.client.start()
        try:
            yield made
        finally:
            made.client.stop()
            wait_for(lambda: not made.simulator.server.sessions, "no client is left")
            assert not made.simulator.server.hangs


def test_the_robots_are_found_and_the_bridge_is_left(site):
    """A client subscribes, unsubscribes and disconnects; others are still answered."""

    async def look():
        scans = []
        async with TemporaryBridge(site.simulator.url) as bridge:
            await bridge.open()
            topics = await bridge.topics()
            removal = bridge.subscribe("/robot_1/base_scan", scans.append)
            await until(lambda: len(scans) >= 3)
            removal.remove()
        async with TemporaryBridge(site.simulator.url) as bridge:
            assert await bridge.time() is not None
        return topics

    topics = asyncio.run(look())
    found = discover(topics, "hall")
    assert [robot.name for robot in found.robots] == ["robot_0", "robot_1"]
    assert found.dialect == dialect_of(site.version)


def test_a_robot_drives_until_stop(site):
    site.take()

    def drives():
        site.client.twist("bob", Twist(wz=0.4))
        return site.robot.twist.wz > 0.2

    wait_for(drives, "motion")
    site.stop_and_reset()


def test_stop_cancels_a_goal(site):
    site.take()
    site.client.move("bob", *FAR, 0.0)
    site.wait(lambda report: report.goal and report.goal.state == "under way")
    wait_for(lambda: not site.robot.twist.is_zero, "motion")
    site.stop_and_reset()
    assert site.reports["bob"].goal.state == "cancelled"


def test_a_rejected_goal_is_reported_as_the_bridge_reports_it(site):
    site.take("lost")
    site.client.move("lost", *FAR, 0.0)
    report = site.wait(lambda r: r.goal and r.goal.state not in ("sent",), "lost")
    expected = REJECTED.get(site.version, ("failed", "Action goal was rejected"))
    assert (report.goal.state, report.goal.why) == expected
    assert site.robot.twist.is_zero
