"""Numbers that no base has are refused where they are said, and are not kept."""

import math

import pytest

from webmap import Bridge, Robot
from webmap.errors import ConfigError


@pytest.fixture
def robot():
    robot = Robot("Bob")
    yield robot
    robot.destroy()


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("v_max", -1, "-1, expected a number from 0 on"),
        ("w_max", math.inf, "inf, expected a number from 0 on"),
        ("a_max", 0, "0, expected a number from 0.001 on"),
        ("stops_within", math.nan, "nan, expected a number from 0 on"),
    ],
)
def test_what_a_base_cannot_be_is_refused(robot, name, value, expected):
    bridge = Bridge("ws://robot:9090")
    with pytest.raises(ConfigError) as error:
        robot.set_twist_topic(bridge, "/cmd_vel", **{name: value})
    assert str(error.value) == f"robot 'Bob': {name} is {expected}"
    assert robot.motion.spec() is None


def test_a_base_that_is_told_wrongly_stays_as_it_was(robot):
    bridge = Bridge("ws://robot:9090")
    robot.set_twist_topic(bridge, "/cmd_vel", v_max=0.5)
    with pytest.raises(ConfigError):
        robot.set_twist_topic(bridge, "/other", v_max=-1)
    spec = robot.motion.spec()
    assert (spec.twist_topic, spec.v_max) == ("/cmd_vel", 0.5)
