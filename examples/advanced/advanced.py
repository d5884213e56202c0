"""The advanced tutorial: models, a class of robots, HTML and CSS of your own, a log.

Start the simulator and then this::

    webmap sim
    webmap run examples/advanced/advanced.py
"""

import webmap
from webmap import svg


def circle_model(radius):
    """Return a circle with a line that shows the heading of the robot."""
    return svg.g(
        svg.circle(cx=0, cy=0, r=radius),
        svg.line(x1=0, y1=0, x2=radius, y2=0),
    )


class StageRobot(webmap.Robot):
    """A robot of the simulator; its number determines all its topics."""

    def __init__(self, name, index, bridge):
        super().__init__(name, circle_model(0.2))

        # Classes of the robot's own group, so that CSS reaches the modules too.
        self.svg.classes.add("stage")
        self.svg.classes.add(f"stage_{index}")

        # Odometry, motion, navigation and laser scanner.
        base = f"/robot_{index}"
        self.set_odometry_topic(bridge, f"{base}/odom")
        self.set_twist_topic(bridge, f"{base}/cmd_vel", stops_within=0.25)
        self.set_move_topic(bridge, f"{base}/move_base_simple/goal")
        self.add_module("LaserScanner", bridge, f"{base}/base_scan")


bridge = webmap.Bridge("ws://localhost:9090")
robots = [StageRobot("Robot 0", 0, bridge), StageRobot("Robot 1", 1, bridge)]


@webmap.page("/", html="index.html")
def main(page):
    """Build the page for one viewer."""
    log = page.element("log")

    map = webmap.Map(page.element("webmap_container"), 700, 500)
    map.add_module("MouseViewControl")

    # Show the name of the selected robot in a span of the HTML.
    map.add_module("ShowSelected", page.element("selected"))

    map.add_module("Teleop", 1.0, 1.5)
    map.add_image("background.png", -21.0, -13.5, 42.0, 27.0)
    map.scale(700 / 42.0, map.canvas_width * 0.5, map.canvas_height * 0.5)

    # These listeners end with the page.
    bridge.on_close(lambda reason: log.prepend(f"Connection closed: {reason}.\n"))
    bridge.on_error(lambda error: log.prepend(f"Error: {error}.\n"))
    bridge.on_open(lambda: log.prepend("Connection established.\n"))

    for robot in robots:
        map.add_robot(robot)


webmap.run()
