"""Robots as they are told on the command line."""

import pytest

from webmap import Bridge, Robot
from webmap.console import RobotDescription, parse_robot
from webmap.console.fleet import make_robot
from webmap.errors import ConfigError


@pytest.fixture
def bridges():
    return [Bridge("ws://localhost:9090"), Bridge("ws://localhost:9091")]


def test_a_robot_is_a_name_and_three_topics(bridges):
    about = parse_robot("Bob:/odom:/cmd_vel:/scan", bridges, stops_within=0.25)
    assert about == RobotDescription(
        name="Bob",
        bridge=bridges[0],
        odometry="/odom",
        twist="/cmd_vel",
        scan="/scan",
        stops_within=0.25,
    )


def test_topics_may_be_empty_or_left_out(bridges):
    about = parse_robot("Bob:/odom::/scan", bridges)
    assert (about.odometry, about.twist, about.scan) == ("/odom", "", "/scan")
    assert parse_robot("Bob:/odom", bridges).scan == ""


def test_a_number_says_behind_which_bridge_it_is(bridges):
    assert parse_robot("2@Bob:/odom", bridges).bridge is bridges[1]


def test_an_at_sign_in_a_topic_is_no_number_of_a_bridge(bridges):
    assert parse_robot("Bob:/a@b", bridges).odometry == "/a@b"


@pytest.mark.parametrize(
    "text", ["", "Bob", ":/odom", "Bob:::", "Bob:/a:/b:/c:/d", "  :/odom"]
)
def test_another_form_is_refused_with_the_right_one(bridges, text):
    with pytest.raises(ConfigError, match="NAME:ODOM:CMD_VEL:SCAN"):
        parse_robot(text, bridges)


@pytest.mark.parametrize("number", ["0", "3", "-1", "x", "", "²"])
def test_a_bridge_that_is_not_there_is_refused(bridges, number):
    with pytest.raises(ConfigError, match="there are 2"):
        parse_robot(f"{number}@Bob:/odom", bridges)


def test_a_described_robot_has_what_its_topics_need(bridges):
    robot = make_robot(
        RobotDescription(
            name="Bob",
            bridge=bridges[0],
            odometry="/odom",
            twist="/cmd_vel",
            scan="/scan",
            battery="/battery",
            goal="/goal",
            cancel="/cancel",
            stops_within=0.25,
        )
    )
    names = [type(module).__name__ for module in robot.modules]
    assert names == ["LaserScanner", "Battery", "NameLabel"]
    spec = robot.motion.spec()
    assert (spec.twist_topic, spec.goal_topic) == ("/cmd_vel", "/goal")
    assert spec.cancel_topic == "/cancel"
    assert spec.stops_within == 0.25
    robot.destroy()


def test_a_scan_is_drawn_under_the_robot_s_body(bridges):
    robot = make_robot(RobotDescription(name="Bob", bridge=bridges[0], scan="/scan"))
    order = [child for child in robot.svg.children]
    assert order.index(robot.modules[0].svg) < order.index(robot.model)
    robot.destroy()


def test_a_name_stays_upright_wherever_the_robot_looks(bridges):
    robot = make_robot(RobotDescription(name="Bob", bridge=bridges[0]))
    robot.orientation = type(robot.orientation).from_yaw(1.0)
    robot.notify_modules("on_odometry_update")
    label = robot.modules[-1].svg
    assert label._transform == pytest.approx((0.0, 0.0, -1.0))
    robot.destroy()


def test_a_page_is_told_which_base_moves_sideways(bridges):
    robot = Robot("Bob")
    robot.set_twist_topic(bridges[0], "/cmd_vel", holonomic=True)
    assert "data-holonomic" in robot.svg.attributes
    robot.set_twist_topic(bridges[0], "/cmd_vel")
    assert "data-holonomic" not in robot.svg.attributes
    robot.destroy()
