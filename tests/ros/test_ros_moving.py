"""What sets robots in motion, by name and by type."""

import pytest

from webmap.ros.moving import moved_by_name, moved_by_type


@pytest.mark.parametrize(
    ("type", "moved"),
    [
        ("geometry_msgs/Twist", "a velocity"),
        ("geometry_msgs/msg/TwistStamped", "a velocity"),
        ("ackermann_msgs/msg/AckermannDriveStamped", "a velocity"),
        ("sensor_msgs/Joy", "a velocity"),
        ("geometry_msgs/PoseStamped", "a goal"),
        ("move_base_msgs/MoveBaseActionGoal", "a goal"),
        ("nav2_msgs/action/NavigateToPose_SendGoal", "a goal"),
        ("actionlib_msgs/GoalID", "the end of a goal"),
        ("action_msgs/srv/CancelGoal", "the end of a goal"),
        ("std_msgs/Bool", None),
        ("geometry_msgs/PoseWithCovarianceStamped", None),
        ("no type", None),
    ],
)
def test_a_type_tells_what_it_moves(type, moved):
    assert moved_by_type(type) == moved


@pytest.mark.parametrize(
    ("name", "moved"),
    [
        ("/cmd_vel", "a velocity"),
        ("/bob/cmd_vel_nav", "a velocity"),
        ("/base/stamped_cmd_vel", "a velocity"),
        ("/move_base_simple/goal", "a goal"),
        ("/move_base/cancel", "the end of a goal"),
        ("/bob/goal_pose", "a goal"),
        ("/navigate_to_pose/_action/send_goal", "a goal"),
        ("/navigate_to_pose/_action/cancel_goal", "the end of a goal"),
        ("/navigate_to_pose/_action/get_result", "a goal"),
        ("/dock", None),
        ("/goal_checker/reset", None),
    ],
)
def test_a_name_tells_what_it_moves(name, moved):
    assert moved_by_name(name) == moved
