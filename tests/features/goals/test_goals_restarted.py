"""Goals that were under way when the gate was killed, with simulated robots."""

import math
import os
import signal

import pytest
from running_simulators import simulators

from equipment.declarations import declared
from equipment.waiting import wait_for
from webmap.gate.display.client import GateClient
from webmap.gate.protocol import RobotReport

pytestmark = pytest.mark.slow

ACTIONS = {
    "ros1": ("move_base", "move_base_msgs/MoveBaseAction"),
    "ros2": ("navigate_to_pose", "nav2_msgs/action/NavigateToPose"),
}
OLD, NEW = (11.0, 2.5), (15.8, -4.2)


class Program:
    """A program that sends goals, and the newest report on its robot."""

    def __init__(self, client):
        self._client = client
        self.report = None
        client.on_report(self._hear)

    def _hear(self, report):
        if isinstance(report, RobotReport):
            self.report = report

    def wait(self, test):
        wait_for(
            lambda: self.report is not None and test(self.report),
            lambda: f"a report: {self.report}",
        )

    def go(self, place):
        self.wait(lambda report: report.armable and report.link == "up")
        self._client.take("r1").result(10)
        self._client.move("r1", *place, 0.0)
        self.wait(lambda report: report.goal and report.goal.state == "under way")
        assert (self.report.goal.x, self.report.goal.y) == place


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_a_goal_after_a_restart_of_the_gate_is_not_taken_for_the_earlier_one(
    dialect, tmp_path, monkeypatch
):
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))
    client = GateClient()
    program = Program(client)
    with simulators(dialect) as found:
        simulator = found[dialect]
        robot = simulator.world.robots[1]
        action, type = ACTIONS[dialect]
        client.declare(
            declared(
                id="r1",
                name="Bob",
                bridge_url=simulator.url,
                action=f"{robot.topics}/{action}",
                action_type=type,
                goal_frame="map",
            )
        )
        client.start()
        try:
            program.go(OLD)
            first = program.report.goal.id
            program.report = None
            os.kill(client.pid, signal.SIGKILL)
            program.go(NEW)
            assert program.report.goal.id != first
            program.wait(lambda report: report.goal.state not in ("under way", "sent"))
            assert program.report.goal.state == "reached", program.report.goal
            there = robot.pose
            assert math.dist((there.x, there.y), NEW) < 0.3
        finally:
            client.stop()
