"""Robots of a recording are seen, and nothing of them is told anything."""

from webmap import Bridge
from webmap.cli.described import describe
from webmap.cli.latecomers import LateRobots, greet
from webmap.cli.watched import MOTION, Watched
from webmap.console import Console
from webmap.discovery import discover
from webmap.discovery.newcomers import News

URL = "ws://127.0.0.1:9090"
SEEN = {
    "/odom": "nav_msgs/msg/Odometry",
    "/scan": "sensor_msgs/msg/LaserScan",
}
TOPICS = SEEN | {
    "/cmd_vel": "geometry_msgs/msg/Twist",
    "/goal_pose": "geometry_msgs/msg/PoseStamped",
    "/initialpose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/navigate_to_pose/_action/feedback": (
        "nav2_msgs/action/NavigateToPose_FeedbackMessage"
    ),
}


def test_a_robot_that_could_be_driven_is_described_as_one_that_is_seen():
    (found,) = discover(TOPICS, "robot").robots
    assert {"velocity", "goal", "action", "initialpose"} <= set(found.guesses)
    about = describe(Watched("office").apply(URL, found), Bridge(URL))
    assert (about.odometry, about.scan) == ("/odom", "/scan")
    assert (about.twist, about.goal, about.cancel, about.initial_pose) == ("",) * 4
    assert about.action is None


def test_topics_that_come_later_do_not_let_it_be_driven_either():
    bridge, late = Bridge(URL), LateRobots(Console())
    watched = Watched("office")
    came = greet(late, [], None, overruling=watched)
    (bare,) = discover(SEEN, "robot").robots
    came(News(bare), bridge)
    (whole,) = discover(TOPICS, "robot").robots
    came(News(whole, MOTION), bridge)
    (robot,) = late.robots
    try:
        assert robot.motion.twist_topic is None
        assert robot.motion.move_topic is None
        assert robot.motion.pose_topic is None
    finally:
        robot.destroy()


def test_a_robot_without_a_name_of_its_own_is_called_as_the_recording():
    names = {}
    for prefix in ("", "/bob"):
        topics = {f"{prefix}{topic}": type for topic, type in SEEN.items()}
        (found,) = discover(topics, "robot").robots
        names[prefix] = Watched("office").apply(URL, found).name
    assert names == {"": "office", "/bob": "bob"}
