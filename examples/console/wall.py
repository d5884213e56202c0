"""The console of ``webmap view``, and a page of one's own for a screen on the wall.

Start a rosbridge on the robot, or the simulator in its place, and then this::

    webmap sim --flat
    webmap run examples/console/wall.py

The console is at ``/``, the page for the wall at ``/wall``.
"""

import webmap
from webmap.console import open_console

bridge = webmap.Bridge("ws://localhost:9090")
bob = webmap.RobotConfig.from_dict(
    {
        "name": "Bob",
        "bridge": bridge.url,
        "odometry": "/odom",
        "twist": {"topic": "/cmd_vel", "stops_within": 0.25},
        "scan": "/base_scan",
    }
)
console = open_console([bridge], [bob])


@webmap.page("/wall", title="Hall")
def wall(page):
    """Show the robots of the console; no module of this page moves a robot."""
    map = webmap.Map(page.element("webmap_container"))
    for robot in console.shown_robots():
        map.add_robot(robot)


if __name__ == "__main__":
    webmap.run()
