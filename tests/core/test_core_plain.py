"""Robots as JSON and as TOML, and back."""

import json
import tomllib

import pytest

from webmap import Bridge, Namespace, Robot, svg
from webmap.base.errors import ConfigError
from webmap.core.motion import robot_motions


def toml(value) -> str:
    """Return a value as TOML in one line; TOML has no value for None."""
    match value:
        case bool():
            return str(value).lower()
        case int() | float():
            return repr(value)
        case str():
            return json.dumps(value)
        case list() | tuple():
            return f"[{', '.join(map(toml, value))}]"
        case dict():
            pairs = [f"{json.dumps(key)} = {toml(each)}" for key, each in value.items()]
            return f"{{{', '.join(pairs)}}}"
    raise TypeError(f"TOML cannot hold {value!r}")


def through_json(data):
    return json.loads(json.dumps(data))


def through_toml(data):
    return tomllib.loads(f"robot = {toml(data)}")["robot"]


@pytest.fixture
def robot():
    bridge = Bridge("ws://robot:9090")
    robot = Robot("Bob", svg.g(svg.circle(r=0.2), "a text"))
    robot.set_odometry_topic(bridge, "/odom", 50, type="nav_msgs/Odometry")
    hooks = [{"topic": "/lock"}]
    limits = {"z_max": 0.5, "rx_max": 0.2, "ry_max": 0.1}
    robot.set_twist_topic(bridge, "/cmd_vel", stop_hooks=hooks, **limits)
    robot.set_move_topic(bridge, "/goal", on_operator_loss="cancel")
    robot.set_initial_pose_topic(bridge, covariance=(1, 2, 3))
    robot.set_scan_assist("/scan", 0.3)
    robot.set_alignment(1.0, 2.0, 90.0)
    robot.add_module("LaserScanner", bridge, "/scan", 0.2, max_dots=None, name="rear")
    robot.add_module("Battery", bridge, "/battery")
    yield robot
    robot.destroy()


@pytest.mark.parametrize("through", [through_json, through_toml])
def test_a_robot_with_modules_is_restored_from_json_and_toml(robot, through):
    data = robot.to_dict()
    again = Robot.from_dict(through(data), {"ws://robot:9090": robot.feed.bridge})
    assert through(again.to_dict()) == through(data)
    assert again.motion.spec().base.z_max == 0.5
    again.destroy()


@pytest.mark.parametrize("through", [through_json, through_toml])
def test_a_scanner_without_max_dots_is_restored_from_json_and_toml(robot, through):
    again = Robot.from_dict(through(robot.to_dict()))
    assert again.modules[0].max_dots is None
    again.destroy()


@pytest.mark.parametrize("data", [[1], "Bob", None, 5])
def test_plain_data_that_are_not_a_table_are_refused(data):
    with pytest.raises(ConfigError, match="plain data is a table such as"):
        Robot.from_dict(data)


def test_refused_plain_data_leave_no_robot_behind():
    before = set(robot_motions)
    twist = {"bridge": "ws://robot:9090", "topic": "/cmd_vel"}
    for wrong in ({"modules": [{"name": "Horn"}]}, {"twist": {**twist, "v_max": -1}}):
        with pytest.raises((ConfigError, LookupError)):
            Robot.from_dict({"name": "Bob", "twist": twist, **wrong})
    assert robot_motions == before


def test_a_module_argument_that_is_not_plain_data_is_refused():
    namespace = Namespace("lamp")
    namespace.register(lambda robot, bulb: bulb, name="Lamp")
    robot = Robot("Bob", namespace=namespace)
    robot.add_module("Lamp", object())
    with pytest.raises(ConfigError, match=r"robot 'Bob' is not plain data: .*object"):
        robot.to_dict()
    robot.destroy()
