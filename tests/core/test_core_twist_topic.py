"""Limits that no base has are refused at the call and are not kept."""

import math

import pytest

from webmap import Bridge, Robot
from webmap.base.errors import ConfigError, MotionError
from webmap.base.geometry import Twist
from webmap.base.lifecycle import lifecycle


@pytest.fixture
def robot():
    robot = Robot("Bob")
    yield robot
    robot.destroy()


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        (
            "v_max",
            -1,
            "whole number -1, expected a number of metres per second from 0 on",
        ),
        (
            "w_max",
            math.inf,
            "number inf, expected a number of radians per second from 0",
        ),
        ("a_max", 0, "whole number 0, expected a number of metres per second squared"),
        ("z_max", 0, "whole number 0, expected a number of metres per second above 0"),
        ("rx_max", -1, "whole number -1, expected a number of radians per second abo"),
        ("ry_max", math.nan, "number nan, expected a number of radians per second abo"),
        ("stops_within", math.nan, "number nan, expected a number of seconds above 0"),
        ("stops_within", 0, "whole number 0, expected a number of seconds above 0"),
        (
            "z_max",
            0.0005,
            "number 0.0005, expected a number of metres per second from 0.001 on",
        ),
    ],
)
def test_an_invalid_limit_or_command_timeout_of_a_base_is_refused(
    robot, name, value, expected
):
    bridge = Bridge("ws://robot:9090")
    with pytest.raises(ConfigError) as error:
        robot.set_twist_topic(bridge, "/cmd_vel", **{name: value})
    assert f"robot 'Bob': twist.{name}: got the {expected}" in str(error.value)
    assert robot.motion.spec() is None


def test_a_refused_set_twist_topic_keeps_the_previous_topic_and_limits(robot):
    bridge = Bridge("ws://robot:9090")
    robot.set_twist_topic(bridge, "/cmd_vel", v_max=0.5)
    with pytest.raises(ConfigError):
        robot.set_twist_topic(bridge, "/other", v_max=-1)
    spec = robot.motion.spec()
    assert (spec.base.topic, spec.base.v_max) == ("/cmd_vel", 0.5)


class NotingGate:
    """Records the velocities that the gate would receive."""

    def __init__(self):
        self.twists = []

    def declare(self, spec):
        pass

    def forget(self, robot):
        pass

    def twist(self, robot, twist):
        self.twists.append(twist)


@pytest.fixture
def gate(robot, monkeypatch):
    gate = NotingGate()
    monkeypatch.setattr(robot.motion, "gate", gate)
    monkeypatch.setattr(type(lifecycle), "running", True)
    return gate


@pytest.mark.parametrize(
    ("axis", "unit"), [("z", "m/s"), ("rx", "rad/s"), ("ry", "rad/s")]
)
def test_a_velocity_with_an_axis_without_a_limit_is_refused(robot, gate, axis, unit):
    robot.set_twist_topic(Bridge("ws://robot:9090"), "/cmd_vel", v_max=0.5)
    with pytest.raises(MotionError) as error:
        robot.twist(0.1, **{axis: 0.25})
    assert str(error.value) == (
        f"robot 'Bob': the velocity was not sent: got {axis} = 0.25 {unit}, but no "
        f"limit of the robot is known for {axis}: state {axis}_max with its twist topic"
    )
    assert gate.twists == []


def test_all_six_velocity_components_of_a_robot_with_limits_are_sent_to_the_gate(
    robot, gate
):
    limits = {"z_max": 0.5, "rx_max": 0.2, "ry_max": 0.1}
    robot.set_twist_topic(Bridge("ws://robot:9090"), "/cmd_vel", **limits)
    robot.twist(1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
    assert gate.twists == [Twist(1.0, 2.0, 6.0, vz=3.0, wx=4.0, wy=5.0)]
