"""The simple tutorial: one robot on a map, with keys to drive it.

Start a rosbridge on the robot, or the simulator in its place, and then this::

    webmap sim --flat
    webmap run examples/simple/simple.py
"""

import webmap

# The connection to the robot's ROS system. It opens when WebMap runs, and again after
# it was lost, so topics can be set at once.
bridge = webmap.Bridge("ws://localhost:9090")
bridge.on_open(lambda: print("Connection established."))
bridge.on_close(lambda reason: print(f"Connection closed: {reason}"))
bridge.on_error(lambda error: print(f"Error: {error}"))

# An SVG circle to represent the robot, in metres.
circle = webmap.svg.circle(cx=0, cy=0, r=0.2, stroke="black", fill="red")

bob = webmap.Robot("Bob", circle)
bob.set_odometry_topic(bridge, "/odom")
bob.set_twist_topic(bridge, "/cmd_vel", stops_within=0.25)  # the base stops by itself
bob.add_module("LaserScanner", bridge, "/base_scan")


@webmap.page("/")
def main(page):
    """Build the page for one viewer."""
    # A map of 700 pixels wide and 500 pixels high.
    map = webmap.Map(page.element("webmap_container"), 700, 500)

    # Drag to move, wheel to zoom, shift and wheel to turn.
    map.add_module("MouseViewControl")

    # Drive the selected robot with W, A, S and D. The parameters are linear velocity
    # and angular velocity.
    map.add_module("Teleop", 1.0, 1.5)

    # The background image, in metres.
    map.add_image("background.png", -21.0, -13.5, 42.0, 27.0)

    # A nice initial view that centers the background as large as possible.
    map.scale(700 / 42.0, map.canvas_width * 0.5, map.canvas_height * 0.5)

    map.add_robot(bob)


webmap.run()
