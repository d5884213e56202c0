"""STOP, its reset and scan assist of a robot: set, sent to the gate, refused."""

import asyncio
import json
import math
from concurrent.futures import Future
from types import SimpleNamespace

import numpy as np
import pytest

from webmap import Bridge, Robot
from webmap.base.errors import (
    BridgeClosed,
    ConfigError,
    MotionError,
    MotionRefused,
)
from webmap.base.lifecycle import lifecycle
from webmap.config.motion import StopHook
from webmap.core.motion import RobotMotion
from webmap.gate import pipe
from webmap.gate.protocol import StopReport
from webmap.gate.specs import checked

LOCK = {"topic": "/lock", "type": "std_msgs/Bool"}
E_STOP = {"service": "/e_stop", "type": "std_srvs/Trigger"}


class Link:
    url = "ws://robot:9090"
    lag = 0.0

    def protect(self, topic, carries):
        pass


class Gate:
    """Records the requests of a robot."""

    ready = True

    def __init__(self):
        self.asked = []

    def take(self, robot_id):
        self.asked.append(("take", robot_id))
        future = Future()
        future.set_result(7)
        return future

    def declare(self, spec):
        self.spec = spec

    def forget(self, robot_id):
        pass

    def twist(self, robot_id, twist):
        self.asked.append(("twist", robot_id, twist))

    def move(self, robot_id, *pose):
        self.asked.append(("move", robot_id, *pose))

    def locate(self, robot_id, *pose):
        self.asked.append(("locate", robot_id, *pose))

    def stop_robot(self, robot_id):
        self.asked.append(("stop", robot_id))

    def cancel(self, robot_id):
        self.asked.append(("cancel", robot_id))

    def reset(self, robot_id, stop):
        self.asked.append(("reset", robot_id, stop))


@pytest.fixture
def robot():
    robot = Robot("Bob")
    yield robot
    robot.motion.close()


@pytest.fixture
def gate(monkeypatch):
    gate = Gate()
    monkeypatch.setattr(RobotMotion, "gate", gate)
    monkeypatch.setattr(type(lifecycle), "running", True)
    return gate


def drivable(robot, **options):
    robot.set_twist_topic(Link(), "/cmd_vel", type="geometry_msgs/Twist", **options)
    return robot


class AgentLink(Link):
    url = "zenoh://hall:7447/bay3"


def test_the_commands_of_a_program_reach_an_agents_robot_as_any_other(robot, gate):
    robot.set_twist_topic(AgentLink(), "/cmd_vel", type="geometry_msgs/Twist")
    robot.set_move_topic(AgentLink(), "/goal")
    robot.report = SimpleNamespace(
        armable=True, latched=False, holder=None, epoch=7, reason=None
    )
    assert asyncio.run(robot.acquire_lease()) == 7
    robot.twist(0.5)
    robot.move(robot.position, robot.orientation)
    robot.locate(robot.position, robot.orientation)
    robot.stop()
    robot.cancel()
    assert [what for what, *_ in gate.asked] == [
        "take",
        "twist",
        "move",
        "locate",
        "stop",
        "cancel",
    ]
    assert {id for _, id, *_ in gate.asked} == {robot.motion.id}


def test_stop_and_reset_stop_are_sent_to_the_gate(robot, gate):
    drivable(robot)
    robot.stop()
    stop = StopReport("Ann", True, "", "s1")
    robot.on_gate_report(
        SimpleNamespace(
            stop=stop,
            state="stopped",
            alarm=None,
            link="up",
            other_writer=None,
            doing="stopped",
            holder=None,
            goal=None,
        )
    )
    robot.reset_stop()
    reset = ("reset", robot.motion.id, "s1")
    assert gate.asked == [("stop", robot.motion.id), reset]


def test_reset_stop_is_refused_without_a_stop_in_the_report(robot, gate):
    drivable(robot)
    robot.stop()
    for report in (None, SimpleNamespace(stop=None)):
        robot.report = report
        with pytest.raises(MotionError, match=r"until report\.stop is set"):
            robot.reset_stop()
    assert gate.asked == [("stop", robot.motion.id)]


def test_acquire_lease_waits_for_the_first_report_of_a_restarted_gate(robot, gate):
    free = SimpleNamespace(
        armable=True,
        latched=False,
        holder=None,
        epoch=7,
        reason=None,
        state="held",
        alarm=None,
        link="up",
        other_writer=None,
        doing="held",
        goal=None,
    )

    async def scenario():
        drivable(robot).on_gate_report(free)
        robot.on_gate_down()
        asking = asyncio.create_task(robot.acquire_lease(timeout=10.0))
        await asyncio.sleep(0.1)
        assert gate.asked == [], "the report of the previous gate does not count"
        assert robot.report is free, "pages still show it"
        robot.on_gate_report(free)
        assert await asking == 7

    asyncio.run(scenario())
    assert gate.asked == [("take", robot.motion.id)]


def test_a_program_cannot_publish_to_the_topic_of_a_stop_hook(robot):
    bridge = Bridge("ws://robot:9090")
    robot.set_twist_topic(bridge, "/cmd_vel", stop_hooks=[LOCK, E_STOP])
    for locked in (True, False):
        with pytest.raises(MotionRefused) as refused:
            bridge.publish("lock/", {"data": locked}, "std_msgs/Bool")
    assert str(refused.value) == (
        "/lock carries the STOP of a robot, which only the gate publishes: use "
        "Robot.stop() and Robot.reset_stop()"
    )
    with pytest.raises(BridgeClosed):
        bridge.publish("/lock/other", {"data": True}, "std_msgs/Bool")


@pytest.mark.parametrize("ask", [Robot.stop, Robot.reset_stop])
def test_stop_and_reset_stop_are_refused_before_webmap_is_started(robot, ask):
    with pytest.raises(MotionError, match=r"before webmap\.start"):
        ask(drivable(robot))


@pytest.mark.parametrize("ask", [Robot.stop, Robot.reset_stop])
def test_stop_and_reset_stop_are_refused_for_a_robot_without_motion_topics(
    robot, gate, ask
):
    with pytest.raises(MotionError, match="no twist topic and no move topic"):
        ask(robot)
    assert gate.asked == []


def test_stop_hooks_and_scan_assist_are_restored_from_plain_data(robot):
    drivable(robot, stop_hooks=[LOCK, E_STOP])
    corners = [(0.3, 0.2), (-0.3, 0), (0.3, -0.2)]
    robot.set_scan_assist("/scan", corners, angle=30, upside_down=True, frame="/l")
    data = json.loads(json.dumps(robot.to_dict()))
    assert data["twist"]["stop_hooks"] == [LOCK, E_STOP]
    assert data["scan_assist"] == data["scan_assist"] | {
        "topic": "/scan",
        "footprint": [[0.3, 0.2], [-0.3, 0.0], [0.3, -0.2]],
        "angle": 30.0,
        "upside_down": True,
        "frame": "l",
    }
    again = Robot.from_dict(data, {Link.url: Link()})
    assert json.loads(json.dumps(again.to_dict())) == data
    assert again.motion.spec().scan_assist == robot.motion.spec().scan_assist
    hooks = [StopHook(**LOCK), StopHook(**E_STOP)]
    assert again.motion.spec().base.stop_hooks == hooks
    again.motion.close()


@pytest.mark.parametrize("size", [np.float32(0.25), np.array([[1, 0], [0, 1], [0, 0]])])
def test_numpy_numbers_of_scan_assist_can_be_sent_to_the_gate(robot, size):
    far = np.float64(0.5)
    drivable(robot).set_scan_assist("/scan", size, x=far, stop_distance=far, brake=far)
    pipe.pack(checked(robot.motion.spec()))


@pytest.mark.parametrize("size", ["0.3", [1.0, 2.0], None])
def test_a_footprint_that_is_neither_radius_nor_corners_is_refused(robot, size):
    with pytest.raises(
        ConfigError, match="robot's radius in metres, above 0, or 3 corners"
    ):
        drivable(robot).set_scan_assist("/scan", size)


def test_unset_stop_hooks_and_scan_assist_are_not_in_plain_data(robot):
    drivable(robot)
    assert "scan_assist" not in robot.to_dict()
    assert "stop_hooks" not in robot.to_dict()["twist"]


@pytest.mark.parametrize("radius", [0, -0.3, math.nan, math.inf, True, np.float64(-1)])
def test_a_radius_that_is_not_a_positive_number_is_refused(robot, radius):
    with pytest.raises(
        ConfigError, match=r"footprint: got the .* radius in metres, above 0"
    ):
        robot.set_scan_assist("/scan", radius)


def test_a_footprint_that_crosses_itself_is_refused_and_the_old_one_is_kept(robot):
    corners = [(0.3, 0.2), (-0.3, -0.2), (0.3, -0.2), (-0.3, 0.2)]
    robot.set_scan_assist("/scan", 0.3)
    before = robot.motion.config.scan_assist
    with pytest.raises(ConfigError, match="edge from corner 1 meets the edge from"):
        robot.set_scan_assist("/scan", corners)
    assert robot.motion.config.scan_assist == before


def test_a_footprint_given_as_a_radius_is_restored_from_plain_data(robot):
    drivable(robot).set_scan_assist("/scan", 0.25, blind="creep", creep=0.05, x=0.1)
    data = robot.to_dict()
    again = Robot.from_dict(data, {Link.url: Link()})
    assert again.to_dict() == data
    again.motion.close()


@pytest.mark.parametrize(
    ("hooks", "expected"),
    [
        (
            [{"topic": 5}],
            r'\[0\].topic: got the whole number 5, expected a name, such as "/lock"',
        ),
        ([{"topic": ""}], r'\[0\].topic: got the text "", expected a name, such as'),
        (
            [{"topic": "/lock", "type": 5}],
            r"\[0\].type: got the whole number 5, expected a text",
        ),
        (
            [{"service": "/e_stop", "type": "std_msgs/Bool"}],
            "expected one of the types std_srvs/Trigger",
        ),
        ([{"topik": "/lock"}], 'there is no key "topik" here; did you mean "topic"'),
        (
            [{"topic": "/lock", "data": True}],
            'no key "data" here; there are topic, service, type',
        ),
        (["/lock"], 'the text "/lock", expected a table such as {topic = "/lock"}'),
        (LOCK, "stop_hooks: got the table .* expected an array such as"),
        ("/lock", 'stop_hooks: got the text "/lock", expected an array such as'),
        (5, "stop_hooks: got the whole number 5, expected an array such as"),
        ([{"topic": "cmd_vel"}], "/cmd_vel is the velocity topic"),
    ],
)
def test_an_invalid_stop_hook_is_refused_and_the_old_one_is_kept(
    robot, hooks, expected
):
    drivable(robot, stop_hooks=[LOCK])
    with pytest.raises(ConfigError, match=f"robot 'Bob': .*{expected}"):
        drivable(robot, stop_hooks=hooks)
    assert robot.motion.spec().base.stop_hooks == [StopHook(**LOCK)]


def test_relative_names_of_stop_hooks_are_resolved_at_once(robot):
    drivable(robot, stop_hooks=[{"topic": "lock"}, {"service": "e_stop/"}])
    assert robot.to_dict()["twist"]["stop_hooks"] == [LOCK, E_STOP]


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        ({"topic": "/scan"}, "footprint"),
        ({"topic": "/scan", "footprint": "round"}, "footprint"),
        ({"topic": "/scan", "footprint": 0.2, "blind": "go"}, "blind"),
        ({"topic": "/scan", "footprint": 0.2, "brakes": 1}, "brakes"),
    ],
)
def test_invalid_plain_data_of_scan_assist_are_refused_with_the_key(data, expected):
    with pytest.raises(ConfigError, match=expected):
        Robot.from_dict({"name": "Bob", "scan_assist": data})


def test_closing_the_motion_of_a_robot_declares_no_spec_to_the_gate(robot, gate):
    drivable(robot).set_move_topic(robot.motion.bridge("twist"), "/goal")
    gate.spec = None
    robot.motion.close()
    assert gate.spec is None
