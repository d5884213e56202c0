"""Settings of ``--set`` replace the topics that discovery chose."""

import pytest

from equipment.command_line import run_inside
from webmap import Bridge
from webmap.base.errors import ConfigError
from webmap.discovery import discover
from webmap.fleet.overrides import Overrides, parse_setting
from webmap.fleet.robot_options import parse_robot

URL = "ws://127.0.0.1:9090/"
TOPICS = {
    "/robot_1/odom": "nav_msgs/Odometry",
    "/robot_1/cmd_vel": "geometry_msgs/Twist",
    "/robot_1/scan": "sensor_msgs/LaserScan",
    "/robot_1/rear/scan": "sensor_msgs/LaserScan",
    "/robot_1/battery": "sensor_msgs/BatteryState",
}


def overrides(*texts):
    return Overrides([parse_setting(text) for text in texts])


@pytest.fixture
def found():
    (robot,) = discover(TOPICS).robots
    assert robot.topic("scan") == "/robot_1/scan"
    return robot


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("robot_1.scan", "not of the form ROBOT.ROLE=TOPIC"),
        ("scan=/scan", "not of the form ROBOT.ROLE=TOPIC"),
        (".scan=/scan", "not of the form ROBOT.ROLE=TOPIC"),
        ("robot_1.scam=/scan", "did you mean 'scan'?"),
        ("robot_1.arm=/arm", "no role 'arm'. The roles are odometry, velocity"),
        (
            "robot_1.scan=scan",
            "'scan' is not the name of a topic; a name begins with a slash",
        ),
        ("robot_1.scan=/a b", "'/a b' is not the name of a topic"),
        ("robot_1.scan=/a,/b", "one topic of that role, got 2"),
        ("robot_1.name= ", "at least one character"),
        (
            "robot_1.velocity_type=std_msgs/String",
            "got the type 'std_msgs/String', expected "
            "geometry_msgs/Twist or geometry_msgs/TwistStamped",
        ),
        ("robot_1.name=a\tb", "a name is one line of at most 100 characters"),
    ],
)
def test_the_error_for_an_invalid_setting_explains_the_mistake(text, words):
    with pytest.raises(ConfigError, match=r"^--set ") as refused:
        parse_setting(text)
    assert words in str(refused.value)


def test_a_setting_replaces_one_topic_and_keeps_the_other_topics(found):
    settings = overrides("robot_1.scan=/robot_1/rear/scan", "robot_1.battery=")
    robot = settings.apply(URL, found)
    config = settings.config(URL, robot)
    assert config.scan == ["/robot_1/rear/scan"]
    assert robot.first("scan").type == "sensor_msgs/LaserScan"
    assert config.battery == ""
    assert config.odometry.topic == "/robot_1/odom"
    assert config.motion.twist.topic == "/robot_1/cmd_vel"
    assert settings.fixed(URL, found) == {"scan", "battery"}


def test_a_renamed_robot_is_recognised_by_its_namespace(found):
    settings = overrides("robot_1.name=Bob", "robot_1.base=base_footprint")
    for _ in range(2):
        robot = settings.apply(URL, found)
        assert (robot.name, robot.base_frame) == ("Bob", "base_footprint")


STAMPED = "geometry_msgs/msg/TwistStamped"


@pytest.mark.parametrize("last", ["velocity=/robot_1/drive", "velocity=/drive"])
def test_the_velocity_type_setting_applies_also_with_another_velocity_topic(
    found, last
):
    settings = overrides(f"robot_1.velocity_type={STAMPED}", f"robot_1.{last}")
    about = settings.apply(URL, found)
    velocity = about.first("velocity")
    assert (velocity.topic, velocity.type) == (last.partition("=")[2], STAMPED)


def test_the_velocity_type_setting_applies_to_a_robot_option():
    bob = parse_robot("Bob::/cmd_vel", [Bridge(URL)])
    (given,) = overrides(f"Bob.velocity_type={STAMPED}").apply_to_options([bob])
    assert given.found.type_of("velocity") == STAMPED


def test_a_robot_with_odometry_set_to_nothing_does_not_use_another_pose():
    topics = TOPICS | {"/robot_1/amcl_pose": "geometry_msgs/PoseWithCovarianceStamped"}
    (robot,) = discover(topics).robots
    robot = overrides("robot_1.odometry=").apply(URL, robot)
    assert robot.config(URL).odometry is None


@pytest.mark.parametrize(
    ("odometry", "type"),
    [
        ("nav_msgs/Odometry", "move_base_msgs/MoveBaseAction"),
        ("nav_msgs/msg/Odometry", "nav2_msgs/action/NavigateToPose"),
    ],
)
def test_the_ros_dialect_determines_the_action_type(odometry, type):
    (robot,) = discover({"/robot_1/odom": odometry}).robots
    robot = overrides("robot_1.action=/robot_1/drive_to").apply(URL, robot)
    assert robot.action == ("/robot_1/drive_to", type)


def test_the_camera_setting_accepts_a_list_of_topics(found):
    robot = overrides("robot_1.camera=/front/image,/rear/image").apply(URL, found)
    cameras = robot.config(URL).cameras
    assert [camera.topic for camera in cameras] == ["/front/image", "/rear/image"]


def test_settings_add_topics_to_a_robot_option():
    bridges = [Bridge(URL)]
    bob, al = (parse_robot(f"{name}:/odom", bridges) for name in ("Bob", "Al"))
    (given,) = overrides(
        "Bob.battery=/battery", "Bob.odometry=/odom2"
    ).apply_to_options([bob])
    assert given.found.topic("battery") == "/battery"
    assert given.found.topic("odometry") == "/odom2"
    with pytest.raises(ConfigError, match="write a fleet file"):
        overrides("Bob.plan=/plan").apply_to_options([bob])
    with pytest.raises(ConfigError, match="two robots would be called 'BOB'"):
        overrides("Al.name=BOB").apply_to_options([bob, al])


def test_a_setting_for_an_unknown_robot_is_refused_unless_robots_may_still_appear():
    settings = overrides("robot_7.scan=/scan")
    with pytest.raises(ConfigError, match="did you mean 'robot_1'"):
        settings.check(["robot_1"], all_known=True)
    (words,) = settings.check(["robot_1"], all_known=False)
    assert words == "--set robot_7.scan=/scan waits for a robot of that name."
    assert settings.check(["robot_7"], all_known=True) == []


def view(*arguments):
    return run_inside("view", *arguments)


@pytest.mark.slow
def test_view_show_lists_the_settings_and_refuses_settings_for_unknown_robots(ros1):
    shown = view(
        *(ros1, "--show", "--set", "robot_1.scan=/robot_0/base_scan"),
        *("--set", "robot_1.name=Bob"),
    )
    assert shown.returncode == 0, shown.stderr
    bob = shown.stdout.partition("Bob (in /robot_1)")[2]
    (scan,) = (line for line in bob.splitlines() if line.startswith("  scan "))
    assert scan.split() == [
        *("scan", "/robot_0/base_scan", "from", "--set"),
    ]
    drawn = bob.partition("drawn by webmap view:")[2]
    assert "/robot_1/points" in drawn
    assert "/robot_1/base_scan" not in drawn, "--set chose another topic"
    assert "--set ROBOT.ROLE=TOPIC" in shown.stdout
    refused = view(ros1, "--show", "--set", "robot_0.name=Robot_1")
    assert refused.returncode == 2
    assert "two robots would be called 'robot_1'" in refused.stderr
    refused = view(ros1, "--show", "--set", "robot_9.scan=/scan")
    assert refused.returncode == 2
    assert "there is no robot 'robot_9'" in refused.stderr
    assert refused.stdout == ""


def test_view_show_lists_the_topics_and_layers_of_a_robot_option(ros1):
    given = (ros1, "--show", "--robot", "Bob:/robot_0/odom:/robot_0/cmd_vel:/odd")
    shown = view(*given)
    assert shown.returncode == 0, shown.stderr
    bob, _, drawn = shown.stdout.partition("drawn by webmap view:")
    assert [line.split() for line in bob.splitlines()] == [
        ["Bob", "(from", "--robot)"],
        ["odometry", "/robot_0/odom"],
        ["velocity", "/robot_0/cmd_vel"],
        ["scan", "/odd"],
        [],
    ]
    assert "/robot_0/points" in drawn
    assert " /map " in drawn
    assert "robot_1" not in shown.stdout
    assert view(*given, "--only-given").stdout.strip() == bob.strip()


def test_view_show_lists_only_the_given_topics_if_the_bridge_is_unreachable():
    shown = view("ws://127.0.0.1:1", "--show", "--wait", "0", "--robot", "Bob:/odom")
    lines = shown.stdout.splitlines()
    assert lines == ["Bob (from --robot)", "  odometry    /odom"]
    assert "cannot reach the rosbridge" in shown.stderr
    assert "Only the topics of --robot can be drawn" in shown.stderr


def test_a_command_timeout_that_no_base_can_have_is_refused():
    Overrides(stops_within=0.25)
    with pytest.raises(ConfigError, match=r"--stops-within: .*, at most 1e\+06"):
        Overrides(stops_within=1e9)
