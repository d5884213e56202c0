"""``--topics``, for bridges that cannot list their topics."""

import subprocess
import sys
import tomllib

import pytest

from equipment.command_line import run_inside
from webmap.base.errors import ConfigError
from webmap.cli.options import parse_topics

TOPICS = "/bob/odom [nav_msgs/msg/Odometry]\n/bob/cmd_vel [geometry_msgs/msg/Twist]\n"


def webmap(*arguments, stdin=""):
    return subprocess.run(
        [sys.executable, "-m", "webmap", *arguments],
        input=stdin,
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )


def test_discover_finds_robots_of_a_topic_list_without_the_bridge():
    command = ("discover", "ws://127.0.0.1:1", "--topics", "-", "--toml")
    result = run_inside(*command, stdin=TOPICS)
    assert result.returncode == 0, result.stderr
    (robot,) = tomllib.loads(result.stdout)["robots"]
    assert robot["name"] == "bob"
    assert "/bob/odom" in result.stdout


def test_an_invalid_line_of_a_topic_list_is_reported_with_its_number():
    result = webmap("discover", "ws://127.0.0.1:1", "--topics", "-", stdin="/odom\n")
    assert result.returncode == 2
    assert result.stderr.startswith("Error: <stdin>, line 1: got '/odom'; expected a")


def test_a_topic_list_with_two_bridges_is_refused(tmp_path):
    topics = tmp_path / "topics.txt"
    topics.write_text(TOPICS)
    for command in ("discover", "doctor"):
        result = run_inside(command, "ws://a:1", "ws://b:1", "--topics", str(topics))
        assert result.returncode == 2
        assert "one bridge, got 2 bridges" in result.stderr


def test_help_shows_each_example_on_its_own_line():
    lines = run_inside("discover", "--help").stdout.splitlines()
    assert "  webmap discover ws://robot:9090 --toml > fleet.toml" in lines


def test_an_endless_topic_list_is_refused():
    result = webmap("discover", "ws://127.0.0.1:1", "--topics", "/dev/zero")
    assert result.returncode == 2
    assert (
        "has more than 4194304 characters, expected a list of topics" in result.stderr
    )


def test_a_topic_list_that_is_not_utf_8_is_refused(tmp_path):
    (tmp_path / "list").write_bytes(b"/odom \xff")
    result = webmap("discover", "ws://127.0.0.1:1", "--topics", str(tmp_path / "list"))
    assert result.returncode == 2
    assert "list is not UTF-8" in result.stderr


def test_a_device_instead_of_a_program_is_refused():
    result = run_inside("run", "/dev/zero", "--no-browser")
    assert result.returncode == 2
    assert "/dev/zero: expected a file or a folder, got a device" in result.stderr


# The content of a list.

ROS2 = """\
/cmd_vel [geometry_msgs/msg/TwistStamped, geometry_msgs/msg/Twist]
/odom [nav_msgs/msg/Odometry]
"""
ROS1 = """
Published topics:
 * /odom [nav_msgs/Odometry] 1 publisher
 * /rosout_agg [rosgraph_msgs/Log] 2 publishers

Subscribed topics:
 * /cmd_vel [geometry_msgs/Twist] 1 subscriber
"""
BY_HAND = """\
# what the robot has
/odom  nav_msgs/Odometry   # from the filter
/cmd_vel: geometry_msgs/Twist
"""


@pytest.mark.parametrize(
    ("text", "types"),
    [
        (ROS2, ["geometry_msgs/msg/TwistStamped", "nav_msgs/msg/Odometry"]),
        (ROS1, ["nav_msgs/Odometry", "rosgraph_msgs/Log", "geometry_msgs/Twist"]),
        (BY_HAND, ["nav_msgs/Odometry", "geometry_msgs/Twist"]),
    ],
    ids=["ros2 topic list -t", "rostopic list -v", "by hand"],
)
def test_topic_lists_printed_by_ros_or_written_by_hand_are_read(text, types):
    topics = parse_topics(text)
    assert list(topics.values()) == types
    assert {"/odom", "/cmd_vel"} <= set(topics)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("/odom nav_msgs/Odometry\n/odom\n", "list.txt, line 2: got '/odom'; expected"),
        ("odom nav_msgs/Odometry", "line 1: got 'odom nav_msgs/Odometry'"),
        ("/odom Odometry", "line 1: got '/odom Odometry'"),
        ("/odom nav_msgs/srv/a/b", "line 1"),
        ("/a-b nav_msgs/Odometry", "line 1"),
        ("/a x/A\n/a x/B", "line 2: /a has the type x/B here and x/A above"),
        ("\n# nothing\n", "list.txt is empty"),
        ("\x00\xff" * 100, "line 1"),
    ],
)
def test_the_error_for_an_invalid_topic_list_explains_the_mistake(text, message):
    with pytest.raises(ConfigError) as caught:
        parse_topics(text, "list.txt")
    assert message in str(caught.value)
    assert len(str(caught.value)) < 400


def test_a_topic_listed_twice_with_the_same_type_is_accepted():
    assert parse_topics("/a x/A\n/a x/A\n") == {"/a": "x/A"}
