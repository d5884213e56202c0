"""A program for ``webmap run``: the robots of a rosbridge of ``stamped``, on a map.

``BRIDGED_URL`` is the address of the rosbridge, ``BRIDGED_ROBOTS`` the number of its
robots. They have scans if ``BRIDGED_SCANS`` is set. ``BRIDGED_VIEWERS`` is the greatest
number of pages. If ``BRIDGED_FRAME_RATE`` is set, it is the number of frames a second
for each page, and all users are viewers: they can stop robots, but not drive.
"""

import os

import webmap
from benchmarks.stamped import topics
from webmap.core.operators import Viewer
from webmap.server.runner import serve

bridge = webmap.Bridge(os.environ["BRIDGED_URL"])
fleet = []
for number in range(int(os.environ["BRIDGED_ROBOTS"])):
    odom, velocity, scans = topics(number)
    robot = webmap.Robot(f"robot {number}", webmap.svg.circle(r=0.3, fill="steelblue"))
    robot.set_odometry_topic(bridge, odom, type="nav_msgs/Odometry")
    robot.set_twist_topic(bridge, velocity, stops_within=0.5)
    if os.environ.get("BRIDGED_SCANS"):
        robot.add_module("LaserScanner", bridge, scans)
    fleet.append(robot)


@webmap.page("/")
def main(page: webmap.Page) -> None:
    """Show all robots in the window."""
    map = webmap.Map(page.element("webmap_container"), 1200, 900)
    map.add_module("Teleop", 1.0, 1.5)
    map.fit(-3.0, -50.0, 103.0, 50.0)
    for robot in fleet:
        map.add_robot(robot)
    map.set_selected(fleet[0])


pages = int(os.environ.get("BRIDGED_VIEWERS", "100"))
rate = os.environ.get("BRIDGED_FRAME_RATE")
if rate:
    looks = Viewer("someone", "Someone", "viewer")
    app = webmap.asgi_app(
        authenticate=lambda scope: looks, max_pages=pages, frame_rate=float(rate)
    )
    serve(app, port=0)
    raise SystemExit  # otherwise ``webmap run`` would also serve the pages
webmap.run(max_pages=pages)
