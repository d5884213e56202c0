"""A page with every option that places or shapes layers, and every source of poses.

Run by ``webmap run``; ``DRAWN_BRIDGE`` is the address of a :mod:`fixed_bridge`, and
``DRAWN_FILES`` a folder with ``tiles``, ``floor.yaml`` and ``picture.png``.
"""

import os

from fixed_site import DATUM

import webmap
from webmap import svg

url, files = os.environ["DRAWN_BRIDGE"], os.environ["DRAWN_FILES"]
bridge = webmap.Bridge(url, name="common")
turned = webmap.Bridge(url, name="turned")
webmap.align_bridge(turned, 2.0, 2.5, 120.0)


def arrow(colour):
    """Return a robot's model of one colour."""
    return svg.path(d="M.3 0L-.2.2V-.2Z", fill=colour, stroke="#fff")


# The pose comes from odometry and frames; layers with a frame are drawn in the frame.
anna = webmap.Robot("Anna", arrow("#1f6feb"))
anna.set_odometry_topic(bridge, "/anna/odom")
anna.set_tf(bridge, base_frame="anna/base_link")
anna.add_module("LaserScanner", bridge, "/anna/scan", max_dots=20, name="front")
rear = {"x": -0.2, "y": 0.1, "angle": 150.0, "max_dots": None, "name": "rear"}
anna.add_module("LaserScanner", bridge, "/anna/rear/ranges", **rear)
band = {"colour_by": "intensity", "low": 0.0, "high": 60.0, "z_min": 0.1, "cell": 0.2}
anna.add_module("PointCloud", bridge, "/anna/points", **band)
anna.add_module("Path", bridge, "/anna/plan", max_points=2)
anna.add_module("Path", bridge, "/anna/local_plan", name="local")
anna.add_module("Trail", length=0.6, step=0.2)
anna.add_module("PoseArray", bridge, "/anna/particlecloud", length=0.4, max_poses=6)
anna.add_module("PoseWithCovariance", bridge, "/anna/amcl_pose", deviations=1.0)
foot = "/anna/move_base/local_costmap/footprint"
anna.add_module("Polygon", bridge, foot)
anna.add_module("Range", bridge, "/anna/sonar", 0.1, 0.2, 45.0)
anna.add_module("Range", bridge, "/anna/sonar_aside")
ahead = {"name": "lookahead", "frame": "robot", "radius": 0.2}
anna.add_module("PointStamped", bridge, "/anna/lookahead_point", **ahead)
anna.add_module("PoseStamped", bridge, "/anna/dock", length=1.0, name="dock")
cells = {"max_cells": 5, "name": "grown"}
anna.add_module("GridCells", bridge, "/anna/inflated_obstacles", **cells)
anna.add_module("NavSatFix", bridge, "/anna/fix", datum=DATUM, east=30.0)
anna.add_module("Diagnostics", bridge, prefix="anna/")
local = "/anna/move_base/local_costmap/costmap"
own = {"palette": "costmap", "map_frame": "map"}
anna.add_module("OnMaps", "OccupancyGrid", bridge, local, **own)

# The pose comes only from the frames.
frames = webmap.Robot("Frames", arrow("#8250df"), base_link="anna/laser")
frames.set_tf(bridge)
frames.add_module("LaserScanner", bridge, "/anna/scan", max_dots=10)
frames.add_module("Polygon", bridge, foot, name="other")

# The pose comes only from odometry, and the mounts of sensors are set in code.
bert = webmap.Robot("Bert", arrow("#bf3989"))
bert.set_odometry_topic(bridge, "/bert/odom")
mounted = {"x": 0.3, "y": -0.1, "angle": -60.0}
bert.add_module("LaserScanner", bridge, "/bert/scan", max_dots=None, **mounted)
bert.add_module("Range", bridge, "/bert/sonar", 0.2, 0.1, 90.0)
bert.add_module("Polygon", bridge, "/bert/footprint")
bert.add_module("PoseWithCovariance", bridge, "/bert/odom", type="nav_msgs/Odometry")
bert.add_module("PointCloud", bridge, "/anna/points", frame="map", cell=0.3)

# The poses have other types, and one robot has an alignment.
carl = webmap.Robot("Carl", arrow("#116329"))
carl.set_odometry_topic(bridge, "/carl/pose")
carl.set_alignment(1.0, -0.5, 30.0)
carl.add_module("PoseWithCovariance", bridge, "/carl/pose")
carl.add_module("Path", bridge, "/anna/plan")
dora = webmap.Robot("Dora", arrow("#9a6700"))
dora.set_odometry_topic(bridge, "/dora/pose2d", type="geometry_msgs/Pose2D")
dora.add_module("LaserScanner", bridge, "/bert/scan", 0.1, 0.2, 10.0)

# The world of the bridge is rotated.
emil = webmap.Robot("Emil", arrow("#cf222e"))
emil.set_odometry_topic(turned, "/bert/odom")
emil.add_module("LaserScanner", turned, "/bert/scan", max_dots=12)
emil.add_module("Path", turned, "/anna/plan")

robots = [anna, frames, bert, carl, dora, emil]


@webmap.page("/")
def show(page: webmap.Page) -> None:
    """Show all robots on all kinds of backgrounds."""
    map = webmap.Map(page.element("webmap_container"), 1200, 760)
    map.add_module("TileLayer", f"{files}/tiles", DATUM, east=30.0, attribution="us")
    map.add_module("MetreGrid", least=50)
    map.add_module("MapFile", f"{files}/floor.yaml", order=4.0)
    map.add_image(f"{files}/picture.png", -6.0, -3.0, 2.0, 1.5)
    map.add_module("OccupancyGrid", bridge, "/map")
    map.add_module("OccupancyGrid", bridge, "/heights", palette="raw", order=30.0)
    map.add_module("OccupancyGrid", turned, "/anna/map")
    map.add_module("Markers", bridge, "/anna/markers")
    map.add_module("Markers", bridge, "/anna/marker", type="visualization_msgs/Marker")
    map.add_module("Markers", turned, "/anna/markers", map_frame=None)
    places = [
        {"name": "Dock", "x": 4.0, "y": -1.0, "icon": "charger", "yaw": 1.0},
        {"name": "Lift", "x": -5.0, "y": 0.0, "icon": "lift", "kind": "public"},
    ]
    map.add_module("Labels", places, editable=False)
    map.add_module("ScaleBar")
    for robot in robots:
        map.add_robot(robot)
    map.fit(-6.5, -4.5, 13.0, 9.0)
    map.rotate(12, 600, 380)
