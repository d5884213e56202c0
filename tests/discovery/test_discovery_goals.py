"""Which kind of goal a robot takes, according to its topics."""

from dataclasses import replace

import pytest

from webmap.discovery import discover
from webmap.discovery.fleet_toml import fleet_toml

ROS1 = {
    "/bob/odom": "nav_msgs/Odometry",
    "/bob/cmd_vel": "geometry_msgs/Twist",
    "/bob/move_base/goal": "move_base_msgs/MoveBaseActionGoal",
    "/bob/move_base/cancel": "actionlib_msgs/GoalID",
    "/bob/move_base_simple/goal": "geometry_msgs/PoseStamped",
    "/bob/initialpose": "geometry_msgs/PoseWithCovarianceStamped",
}
ROS2 = {
    "/odom": "nav_msgs/msg/Odometry",
    "/cmd_vel": "geometry_msgs/msg/Twist",
    "/goal_pose": "geometry_msgs/msg/PoseStamped",
    "/navigate_to_pose/_action/feedback": (
        "nav2_msgs/action/NavigateToPose_FeedbackMessage"
    ),
    "/navigate_to_pose/_action/status": "action_msgs/msg/GoalStatusArray",
    "/follow_path/_action/feedback": "nav2_msgs/action/FollowPath_FeedbackMessage",
    "/initialpose": "geometry_msgs/msg/PoseWithCovarianceStamped",
}


@pytest.mark.parametrize(
    ("topics", "action", "pose"),
    [
        (ROS1, ("/bob/move_base", "move_base_msgs/MoveBaseAction"), "/bob/initialpose"),
        (
            ROS2,
            ("/navigate_to_pose", "nav2_msgs/action/NavigateToPose"),
            "/initialpose",
        ),
    ],
)
def test_the_action_and_initial_pose_of_ros_1_and_ros_2_are_found(topics, action, pose):
    (robot,) = discover(topics, "robot").robots
    assert robot.action == action
    assert robot.topic("initialpose") == pose
    assert robot.topic("goal")


def test_a_robot_with_only_a_goal_topic_has_no_action():
    topics = {name: type for name, type in ROS1.items() if "move_base/" not in name}
    (robot,) = discover(topics, "robot").robots
    assert robot.action is None


def test_the_fleet_file_contains_the_action_and_the_initial_pose():
    found = discover(ROS2, "robot")
    text = fleet_toml([("robot", "ws://robot:9090", found)])
    assert 'move.action = "/navigate_to_pose" # Nav2\'s action' in text
    assert 'move.action_type = "nav2_msgs/action/NavigateToPose"' in text
    assert 'initial_pose = "/initialpose"' in text


def test_the_fleet_file_names_the_map_frame_for_a_robot_without_goals():
    topics = {
        "/bob/odom": "nav_msgs/Odometry",
        "/bob/initialpose": "geometry_msgs/PoseWithCovarianceStamped",
    }
    found = discover(topics, "bob")
    (robot,) = found.robots
    mapped = replace(found, robots=(replace(robot, root_frame="bob/map"),))
    text = fleet_toml([("bob", "ws://bob", mapped)])
    assert 'initial_pose.topic = "/bob/initialpose"' in text
    assert 'initial_pose.frame = "bob/map"' in text
