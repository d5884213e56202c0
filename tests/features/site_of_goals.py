"""A page with robots of ROS 1 and ROS 2 and every tool that sends goals or poses.

Run by a test, with the addresses of the two bridges in the environment.
"""

import os

import webmap

OLD = webmap.Bridge(os.environ["ROS1"], name="ros1")
NEW = webmap.Bridge(os.environ["ROS2"], name="ros2")


def made(name, bridge, **goals):
    robot = webmap.Robot(name)
    prefix = f"/robot_{name[-1]}"
    robot.set_odometry_topic(bridge, f"{prefix}/odom")
    robot.set_twist_topic(bridge, f"{prefix}/cmd_vel", stops_within=0.25)
    robot.set_move_topic(
        bridge, **{key: f"{prefix}/{topic}" for key, topic in goals.items()}
    )
    robot.set_initial_pose_topic(bridge, f"{prefix}/initialpose")
    return robot


robots = [
    made("Old 0", OLD, topic="move_base_simple/goal"),
    made("New 0", NEW, action="navigate_to_pose"),
    made("New 1", NEW, action="navigate_to_pose"),
    made(
        "Plain 1", OLD, topic="move_base_simple/goal", cancel_topic="move_base/cancel"
    ),
]
robots[0].set_move_topic(
    OLD, action="/robot_0/move_base", action_type="move_base_msgs/MoveBaseAction"
)
# The plain robot's goal is also drawn from its topic, whichever program sends it.
robots[3].add_module("PoseStamped", OLD, "/robot_1/move_base_simple/goal", name="goal")


@webmap.page("/")
def page(page):
    map = webmap.Map(page.element("webmap_container"))
    for robot in robots:
        map.add_robot(robot)
    for module in ("MouseViewControl", "GoalTool", "InitialPoseTool", "RouteTool"):
        map.add_module(module)
    map.add_module("Teleop", 1.0, 1.5)
    map.add_module("StopButton")
    # The hall is to the right of the tools, which open over the map.
    map.fit(-20, -10, 32, 20)
