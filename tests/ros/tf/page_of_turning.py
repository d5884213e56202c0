"""A test page: a simulated robot with fewer scans than poses."""

import os

import webmap

bridge = webmap.Bridge(os.environ["TURNING_URL"])
robot = webmap.Robot("robot_0")
robot.set_odometry_topic(bridge, "/robot_0/odom", 0)
robot.set_tf(bridge, base_frame="robot_0/base_link")
robot.add_module("LaserScanner", bridge, "/robot_0/base_scan", max_dots=None)


@webmap.page("/")
def open_page(page: webmap.Page) -> None:
    """Show the robot."""
    map = webmap.Map(page.element("webmap_container"))
    map.add_robot(robot)
    map.scale(20.0)  # scans are as exact as the pixels
