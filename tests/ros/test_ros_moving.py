"""Which topics and services move a robot, by name and by type."""

import pytest

from webmap.ros.motion_topics import moved_by_both, moved_by_name, moved_by_type

SIMULATED = "the place or the speed of a simulated robot"


@pytest.mark.parametrize(
    ("type", "moved"),
    [
        ("geometry_msgs/Twist", "a velocity"),
        ("geometry_msgs/msg/TwistStamped", "a velocity"),
        ("ackermann_msgs/msg/AckermannDriveStamped", "a velocity"),
        ("sensor_msgs/Joy", "a velocity"),
        ("gazebo_msgs/ModelState", SIMULATED),
        ("gazebo_msgs/msg/ModelStates", SIMULATED),
        ("gazebo_msgs/srv/SetModelState", SIMULATED),
        ("std_msgs/Float64MultiArray", None),
        ("geometry_msgs/Vector3", None),
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
def test_motion_is_recognised_by_the_type(type, moved):
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
        ("/velocity_controller/commands", "a velocity"),
        ("/bob/left_wheel_velocity_controller/command", "a velocity"),
        ("/mecanum_drive_controller/reference", "a velocity"),
        ("/arm_controller/joint_trajectory", "a velocity"),
        ("/bob/cmdvel", "a velocity"),
        ("/bob/target_velocity", "a velocity"),
        ("/controller_manager/list_controllers", None),
        ("/velocity_controller/transition_event", None),
        ("/voice/commands", None),
        ("/travel/target", None),
        ("/dock", None),
        ("/goal_checker/reset", None),
    ],
)
def test_motion_is_recognised_by_the_name(name, moved):
    assert moved_by_name(name) == moved


@pytest.mark.parametrize(
    ("name", "type", "moved"),
    [
        ("/wheels/commands", "std_msgs/msg/Float64MultiArray", "a velocity"),
        ("/left_wheel/cmd", "std_msgs/Float64", "a velocity"),
        ("/bob/velocity", "geometry_msgs/Vector3", "a velocity"),
        ("/bob/vel", "geometry_msgs/msg/Vector3Stamped", "a velocity"),
        ("/samples", "std_msgs/Float64MultiArray", None),
        ("/gravity", "geometry_msgs/Vector3", None),
        ("/voice/commands", "std_msgs/String", None),
        ("/wheels/commands", "no type", None),
    ],
)
def test_number_topics_are_recognised_as_motion_by_name_and_type_together(
    name, type, moved
):
    assert moved_by_both(name, type) == moved
