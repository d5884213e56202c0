"""A wrong argument of a robot's setter is refused at the call and is not kept."""

import inspect

import msgspec
import pytest

from webmap import Bridge, Robot
from webmap.base.errors import ConfigError
from webmap.config.motion import (
    InitialPoseConfig,
    MoveConfig,
    ScanAssistConfig,
    TwistConfig,
)
from webmap.config.robot import OdometryConfig, TfConfig


@pytest.fixture
def bridge():
    return Bridge("ws://robot:9090")


@pytest.fixture
def robot():
    robot = Robot("Bob")
    yield robot
    robot.destroy()


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (
            {"stops_within": "0.25"},
            'twist.stops_within: got the text "0.25", expected a number of s',
        ),
        (
            {"v_max": True},
            "twist.v_max: got the boolean true, expected a number of metres",
        ),
        (
            {"holonomic": "no"},
            'twist.holonomic: got the text "no", expected true or false',
        ),
        ({"vmax": 1.0}, 'there is no argument "vmax"; did you mean "v_max"?'),
    ],
)
def test_a_wrong_option_of_set_twist_topic_is_refused(robot, bridge, options, expected):
    with pytest.raises(ConfigError) as error:
        robot.set_twist_topic(bridge, "/cmd_vel", **options)
    assert str(error.value).startswith("robot 'Bob': ")
    assert expected in str(error.value)
    assert robot.motion.spec() is None


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        (
            {"action_type": 5},
            "action_type: got the whole number 5, expected one of the types",
        ),
        (
            {"frame": None},
            "frame: got the value None, expected a text that is not empty",
        ),
    ],
)
def test_a_wrong_option_of_set_move_topic_is_refused(robot, bridge, options, expected):
    with pytest.raises(ConfigError) as error:
        robot.set_move_topic(bridge, "/goal", **options)
    assert expected in str(error.value)
    assert robot.motion.spec() is None


@pytest.mark.parametrize(
    "set_topic",
    [
        lambda robot: robot.set_twist_topic("ws://robot:9090", "/cmd_vel"),
        lambda robot: robot.set_move_topic("ws://robot:9090", "/goal"),
        lambda robot: robot.set_odometry_topic("ws://robot:9090", "/odom"),
        lambda robot: robot.set_tf("ws://robot:9090"),
        lambda robot: robot.set_initial_pose_topic("ws://robot:9090"),
    ],
    ids=["twist", "move", "odometry", "tf", "initial pose"],
)
def test_a_url_in_place_of_a_bridge_is_refused(robot, set_topic):
    with pytest.raises(ConfigError, match="bridge: expected a Bridge, got 'ws://rob"):
        set_topic(robot)


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (
            ("bad topic",),
            'got the text "bad topic", expected the name of a topic, such as "/odom"',
        ),
        (
            ("/odom", -5),
            "throttle: got the whole number -5, expected a whole number of mill",
        ),
        (
            ("/odom", "100"),
            'throttle: got the text "100", expected a whole number of millis',
        ),
    ],
)
def test_invalid_arguments_of_set_odometry_topic_are_refused(
    robot, bridge, arguments, expected
):
    with pytest.raises(ConfigError) as error:
        robot.set_odometry_topic(bridge, *arguments)
    assert expected in str(error.value)
    assert robot.feed is None


def test_a_stop_distance_of_a_wrong_type_is_refused(robot):
    with pytest.raises(
        ConfigError, match='stop_distance: got the text "1", expected a num'
    ):
        robot.set_scan_assist("/scan", 0.3, stop_distance="1")


SETTERS = {
    "odometry": (Robot.set_odometry_topic, OdometryConfig),
    "tf": (Robot.set_tf, TfConfig),
    "twist": (Robot.set_twist_topic, TwistConfig),
    "move": (Robot.set_move_topic, MoveConfig),
    "initial_pose": (Robot.set_initial_pose_topic, InitialPoseConfig),
    "scan_assist": (Robot.set_scan_assist, ScanAssistConfig),
}
ONLY_OF_THE_SETTER = {("initial_pose", "topic"): "/initialpose"}
"""Defaults that a fleet file does not have: its key is the topic."""


@pytest.mark.parametrize("key", SETTERS)
def test_a_setter_has_the_arguments_and_the_defaults_of_the_fleet_file(key):
    setter, part = SETTERS[key]
    _, *parameters = inspect.signature(setter).parameters.values()
    there = {each.name: each.default for each in parameters}
    keys = {each.name: each for each in msgspec.structs.fields(part)}
    assert there.keys() - {"bridge"} == keys.keys() - {"bridge"}
    for name, default in there.items():
        if name == "bridge" or (key, name) in ONLY_OF_THE_SETTER:
            continue
        field = keys[name]
        if field.required:
            assert default is inspect.Parameter.empty
            continue
        made = field.default_factory is not msgspec.NODEFAULT
        expected = field.default_factory() if made else field.default
        assert default == (tuple(expected) if made else expected)
