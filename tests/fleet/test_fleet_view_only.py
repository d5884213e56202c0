"""Robots of a recording are shown, and nothing is sent to them."""

from webmap import Bridge
from webmap.config.motion import MotionConfig
from webmap.console import Console
from webmap.discovery import discover
from webmap.discovery.newcomers import News
from webmap.fleet.overrides import MOTION, ViewOnly
from webmap.fleet.view_robots import ViewRobots

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


def test_a_robot_of_a_recording_gets_no_motion_settings():
    (found,) = discover(TOPICS, "robot").robots
    assert {"velocity", "goal", "action", "initialpose"} <= set(found.guesses)
    watched = ViewOnly("office")
    config = watched.config(URL, watched.apply(URL, found))
    assert (config.odometry.topic, config.scan) == ("/odom", ["/scan"])
    assert config.motion == MotionConfig()


def test_topics_that_appear_later_give_a_recorded_robot_no_motion_settings():
    bridge, late = Bridge(URL), ViewRobots(Console(), ViewOnly("office"))
    came = late.show_news
    (bare,) = discover(SEEN, "robot").robots
    came(News(bare), bridge)
    (whole,) = discover(TOPICS, "robot").robots
    came(News(whole, MOTION), bridge)
    (robot,) = late.robots
    try:
        assert robot.motion.config == MotionConfig()
    finally:
        robot.destroy()


def test_a_recorded_robot_without_namespace_is_named_after_the_recording():
    names = {}
    for prefix in ("", "/bob"):
        topics = {f"{prefix}{topic}": type for topic, type in SEEN.items()}
        (found,) = discover(topics, "robot").robots
        names[prefix] = ViewOnly("office").apply(URL, found).name
    assert names == {"": "office", "/bob": "bob"}
