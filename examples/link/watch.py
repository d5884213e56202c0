"""Watch a robot over a link of your own: see ``lines_link.py`` beside this file.

Run it with the address of the robot in this file::

    webmap run examples/link/watch.py
"""

import lines_link  # noqa: F401  # adds the link

import webmap

bridge = webmap.Bridge("lines://localhost:7777")
bob = webmap.Robot("Bob", webmap.svg.circle(r=0.3, fill="teal"))
bob.set_odometry_topic(bridge, "/odom")
bob.add_module("LaserScanner", bridge, "/scan")


@webmap.page("/")
def main(page):
    """Build the page for one viewer."""
    map = webmap.Map(page.element("webmap_container"))
    map.scale(40)
    map.add_module("OccupancyGrid", bridge, "/map")
    map.add_robot(bob)


webmap.run()
