"""A list of topics that a person gives."""

import pytest

from webmap.discovery.topic_list import parse_topics
from webmap.errors import ConfigError

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
def test_what_ros_prints_and_what_people_write_is_read(text, types):
    topics = parse_topics(text)
    assert list(topics.values()) == types
    assert {"/odom", "/cmd_vel"} <= set(topics)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("/odom nav_msgs/Odometry\n/odom\n", "list.txt, line 2: got '/odom'; expected"),
        ("odom nav_msgs/Odometry", "line 1: got 'odom nav_msgs/Odometry'"),
        ("/odom Odometry", "line 1: got '/odom Odometry'"),
        ("/odom nav_msgs/srv/a/b", "line 1"),
        ("/a-b nav_msgs/Odometry", "line 1"),
        ("/a x/A\n/a x/B", "line 2: /a is x/B here and x/A further up"),
        ("\n# nothing\n", "list.txt is empty"),
        ("\x00\xff" * 100, "line 1"),
    ],
)
def test_what_is_wrong_is_said_with_its_line(text, words):
    with pytest.raises(ConfigError) as caught:
        parse_topics(text, "list.txt")
    assert words in str(caught.value)
    assert len(str(caught.value)) < 400


def test_a_topic_that_is_listed_twice_alike_is_no_fault():
    assert parse_topics("/a x/A\n/a x/A\n") == {"/a": "x/A"}
