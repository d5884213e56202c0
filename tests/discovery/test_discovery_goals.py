"""Which kind of goal a robot takes, according to its topics."""

from dataclasses import replace

import pytest

from webmap.config.robot import RobotConfig
from webmap.discovery import FoundRobot, Guess, discover
from webmap.discovery.findings import TopicRole
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


@pytest.mark.parametrize("before", ["/", "", "//bob/"])
@pytest.mark.parametrize("action", ["navigate_to_pose/_action/feedback", "base/goal"])
def test_the_configuration_of_a_found_robot_passes_the_checks_of_a_fleet_file(
    before, action
):
    topics: dict[TopicRole, str] = {
        "odometry": "odom",
        "velocity": "cmd_vel",
        "goal": "goal",
        "action": action,
        "cancel": "cancel",
        "initialpose": "pose",
        "tf": "tf",
    }
    guesses = {role: (Guess(before + name, "", ""),) for role, name in topics.items()}
    config = FoundRobot("Bob", "", guesses).config("ws://robot:9090")
    assert RobotConfig.from_dict(config.to_dict()) == config
    assert config.move is not None
    assert config.move.action is not None


def test_a_topic_that_is_only_the_end_of_an_action_name_gives_no_action():
    assert FoundRobot("Bob", "", {"action": (Guess("/goal", "", ""),)}).action is None


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
