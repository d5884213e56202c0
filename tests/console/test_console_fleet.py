"""Robots in the console."""

import pytest

from webmap import Bridge, Robot, RobotConfig
from webmap.console import make_robot


@pytest.fixture
def bridge():
    return Bridge("ws://localhost:9090")


def robot_of(bridge, **parts):
    config = RobotConfig.from_dict({"name": "Bob", "bridge": bridge.url, **parts})
    return make_robot(config, [bridge])


def test_a_configured_robot_has_the_modules_and_the_spec_of_its_topics(bridge):
    robot = robot_of(
        bridge,
        odometry="/odom",
        twist={"topic": "/cmd_vel", "stops_within": 0.25},
        scan="/scan",
        battery="/battery",
        move={"topic": "/goal", "cancel_topic": "/cancel"},
    )
    names = [type(module).__name__ for module in robot.modules]
    assert names == ["LaserScanner", "Battery", "StateMark"]
    spec = robot.motion.spec()
    assert (spec.base.topic, spec.navigation.topic) == ("/cmd_vel", "/goal")
    assert spec.navigation.cancel_topic == "/cancel"
    assert spec.base.stops_within == 0.25
    robot.destroy()


def test_a_scan_is_drawn_under_the_robot_s_body(bridge):
    robot = robot_of(bridge, scan="/scan")
    order = [child for child in robot.svg.children]
    assert order.index(robot.modules[0].svg) < order.index(robot.model)
    robot.destroy()


def test_the_name_label_stays_upright_at_any_heading_of_the_robot(bridge):
    robot = robot_of(bridge)
    robot.orientation = type(robot.orientation).from_yaw(1.0)
    robot.notify_modules("on_odometry_update")
    label = robot.modules[-1].svg
    assert label._transform == pytest.approx((0.0, 0.0, -1.0))
    robot.destroy()


def test_a_robot_with_a_holonomic_base_is_marked_for_the_page(bridge):
    robot = Robot("Bob")
    robot.set_twist_topic(bridge, "/cmd_vel", holonomic=True)
    assert "data-holonomic" in robot.svg.attributes
    robot.set_twist_topic(bridge, "/cmd_vel")
    assert "data-holonomic" not in robot.svg.attributes
    robot.destroy()
