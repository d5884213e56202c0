"""A page that sends goals to one robot, whose bridge has the address SAFETY_BRIDGE.

The service of the robot's stop hook may never answer.
"""

import os

import webmap

bridge = webmap.Bridge(os.environ["SAFETY_BRIDGE"])
bob = webmap.Robot("Bob", webmap.svg.circle(cx=0, cy=0, r=0.3, fill="red"))
bob.set_odometry_topic(bridge, "/robot_0/odom")
hooks = [{"service": "/robot_0/stop"}]
bob.set_twist_topic(bridge, "/robot_0/cmd_vel", stops_within=0.5, stop_hooks=hooks)
bob.set_move_topic(bridge, action="/robot_0/navigate_to_pose")


@webmap.page("/")
def main(page):
    """Show the selected robot, with the origin of the world in the middle."""
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("Teleop", 1.0, 1.5)
    map.add_module("StopButton")
    map.add_module("GoalTool")
    map.scale(20)
    map.add_robot(bob)
    map.set_selected(bob)


webmap.run()
