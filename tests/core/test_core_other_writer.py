"""While another program publishes velocities, rosapi is asked for its node."""

import asyncio
from types import SimpleNamespace

import pytest

from webmap import Bridge, Robot
from webmap.core import motion
from webmap.core.motion import RobotMotion

REST = {
    "doing": "other",
    "holder": None,
    "goal": None,
    "measured": None,
    "alarm": None,
    "link": "up",
}
OTHER_WRITER = SimpleNamespace(
    other_writer="another program publishes to /cmd_vel", **REST
)
NOTHING = SimpleNamespace(other_writer=None, **REST)
NODES = ["/rosbridge_websocket", "/teleop", "/webmap_sim", "/joy"]


class Gate:
    def __init__(self):
        self.named = []

    def declare(self, spec):
        pass

    def forget(self, robot_id):
        pass

    def name_writers(self, robot_id, nodes):
        self.named.append((robot_id, nodes))


@pytest.fixture
def gate(monkeypatch):
    gate = Gate()
    monkeypatch.setattr(RobotMotion, "gate", gate)
    return gate


@pytest.fixture
def robot():
    robot = Robot("Bob")
    yield robot
    robot.motion.close()


def driven(robot, answers):
    """Give a robot a velocity topic on a bridge whose rosapi returns these answers."""
    asked = []

    async def nodes(kind, topic):
        assert kind == "publishers"
        asked.append(topic)
        return answers.pop(0)

    bridge = Bridge("ws://robot:9090")
    bridge._graph.nodes = nodes
    robot.set_twist_topic(bridge, "/cmd_vel", type="geometry_msgs/Twist")
    return asked


def receive_reports(robot, *reports):
    async def scenario():
        for report in reports:
            robot.on_gate_report(report)
            await asyncio.sleep(0)
            await asyncio.sleep(0)

    asyncio.run(scenario())


def test_the_publishing_nodes_are_sent_to_the_gate_without_those_of_bridges(
    robot, gate
):
    asked = driven(robot, [NODES, []])
    receive_reports(robot, NOTHING)
    assert asked == []
    receive_reports(robot, OTHER_WRITER, OTHER_WRITER)
    assert asked == ["/cmd_vel"], "rosapi is not asked for each report"
    assert gate.named == [(robot.id, ("/teleop", "/joy"))]
    receive_reports(robot, NOTHING, OTHER_WRITER)
    assert gate.named[1:] == [(robot.id, ())]


def test_rosapi_is_asked_again_while_another_program_publishes(
    robot, gate, monkeypatch
):
    monkeypatch.setattr(motion, "ASK_WRITERS", 0.0)
    asked = driven(robot, [NODES, NODES])
    receive_reports(robot, OTHER_WRITER, OTHER_WRITER)
    assert len(asked) == 2


def test_no_nodes_are_sent_to_the_gate_when_rosapi_does_not_answer(robot, gate):
    asked = driven(robot, [None])
    receive_reports(robot, OTHER_WRITER)
    assert (len(asked), gate.named) == (1, [])


def test_no_nodes_are_sent_to_the_gate_for_a_robot_without_a_velocity_topic(
    robot, gate
):
    receive_reports(robot, OTHER_WRITER)
    assert gate.named == []
