"""A page for a test: two robots of one simulator, and the map of it."""

import os

import webmap
from webmap.console.robot_looks import robot_model

bridge = webmap.Bridge(os.environ["ALIGNING_URL"], name="north")
robots = []
for number in range(2):
    robot = webmap.Robot(f"robot_{number}", robot_model())
    robot.set_odometry_topic(bridge, f"/robot_{number}/odom", 0)
    robot.set_tf(bridge, base_frame=f"robot_{number}/base_link")
    robot.set_move_topic(bridge, f"/robot_{number}/move_base_simple/goal")
    robot.add_module(
        "LaserScanner", bridge, f"/robot_{number}/base_scan", max_dots=None
    )
    robots.append(robot)


@webmap.page("/")
def open_page(page: webmap.Page) -> None:
    """Show the robots on their map."""
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("OccupancyGrid", bridge, "/map")
    for robot in robots:
        map.add_robot(robot)
    map.add_module("MouseViewControl")
    map.add_module("GoalTool")
    map.add_module("AlignTool")
    map.scale(20)
