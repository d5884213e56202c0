"""Which robots ``webmap doctor`` checks."""

import click
import pytest

from webmap.base.errors import ConfigError
from webmap.discovery import discover
from webmap.discovery.doctor.facts import merge_configured
from webmap.fleet.doctor import bridges_of

URL = "ws://127.0.0.1:9090"
TOPICS = {
    "/a/odom": "nav_msgs/Odometry",
    "/a/cmd_vel": "geometry_msgs/Twist",
    "/a/scan": "sensor_msgs/LaserScan",
    "/a/rear/scan": "sensor_msgs/LaserScan",
    "/a/battery": "sensor_msgs/BatteryState",
    "/a/plan": "nav_msgs/Path",
    "/b/odom": "nav_msgs/Odometry",
    "/b/cmd_vel": "geometry_msgs/Twist",
}
FLEET = """
[bridges]
hall = "ws://hall:9090"
yard = "ws://yard:9090"

[[map]]
bridge = "hall"
topic = "/floor"

[[robots]]
name = "Bob"
bridge = "hall"
odometry = "/bob/odom"
twist = { topic = "/bob/cmd_vel", type = "geometry_msgs/TwistStamped" }
scan = ["/bob/front", "/bob/rear"]
"""


def looked_at(robots=(), settings=()):
    """Return the robots behind a bridge that are checked."""
    ((_, configured),) = bridges_of([URL], robots, settings)
    found = discover(TOPICS)
    findings, _ = merge_configured(found, configured(found), TOPICS)
    return {robot.name: robot for robot in findings.robots}


def test_without_options_doctor_checks_the_discovered_robots_of_each_bridge():
    found = bridges_of([URL, "ws://Bob"], (), ())
    assert [url for url, _ in found] == ["ws://127.0.0.1:9090", "ws://bob"]
    assert [list(configured(discover(TOPICS))) for _, configured in found] == [[], []]


def test_doctor_applies_settings_and_keeps_the_other_discovered_topics():
    robots = looked_at(
        settings=[
            "a.scan=/a/rear/scan",
            "a.battery=",
            "a.name=Ann",
            "a.velocity_type=geometry_msgs/TwistStamped",
        ]
    )
    assert list(robots) == ["Ann", "b"]
    ann = robots["Ann"]
    assert [guess.topic for guess in ann.guesses["scan"]] == ["/a/rear/scan"]
    assert "battery" not in ann.guesses
    assert ann.topic("odometry") == "/a/odom"
    assert ann.type_of("velocity") == "geometry_msgs/TwistStamped"
    assert robots["b"].type_of("velocity") == "geometry_msgs/Twist"


def test_doctor_checks_the_topics_of_a_robot_option_and_its_other_layers():
    robots = looked_at(["Bob:/a/odom:/a/cmd_vel:/a/rear/scan"], ["Bob.camera=/c"])
    assert list(robots) == ["Bob"]
    bob = robots["Bob"]
    assert [guess.topic for guess in bob.guesses["scan"]] == ["/a/rear/scan"]
    assert bob.topic("camera") == "/c"
    assert bob.topic("plan") == "/a/plan"
    assert "battery" not in bob.guesses


def test_doctor_takes_bridges_and_their_robots_from_a_fleet_file(tmp_path):
    file = tmp_path / "fleet.toml"
    file.write_text(FLEET)
    (hall, at_hall), (yard, at_yard) = bridges_of([str(file)], (), ())
    assert (hall, yard) == ("ws://hall:9090", "ws://yard:9090")
    (bob,) = at_hall(discover({}))
    assert bob.name == "Bob"
    assert bob.topics["velocity"] == (("/bob/cmd_vel", "geometry_msgs/TwistStamped"),)
    assert bob.topics["scan"] == (("/bob/front", ""), ("/bob/rear", ""))
    assert bob.topics["map"] == (("/floor", ""),)
    assert list(at_yard(discover({}))) == []


@pytest.mark.parametrize(
    ("given", "robots", "settings", "words"),
    [
        (["ws://a", "ws://b"], [], ["a.scan="], "apply to the robots of one bridge"),
        (["ws://a", "ws://b"], ["Bob:/odom"], [], "got 2 bridges"),
        (["fleet.toml"], ["Bob:/odom"], [], "fleet.toml configures the bridges"),
        (["ws://a", "fleet.toml"], [], [], "leave out --robot, --set and other"),
    ],
)
def test_options_that_exclude_each_other_are_refused(given, robots, settings, words):
    with pytest.raises(click.UsageError, match=words):
        bridges_of(given, robots, settings)


def test_a_setting_for_an_unknown_robot_is_refused():
    ((_, configured),) = bridges_of([URL], (), ["c.scan=/scan"])
    with pytest.raises(ConfigError, match="there is no robot 'c'"):
        configured(discover(TOPICS))
    with pytest.raises(ConfigError, match="there is no robot 'a'"):
        bridges_of([URL], ["Bob:/odom"], ["a.scan=/scan"])
