"""A page for each dialect with all layers, on the simulators of a test.

Run by ``webmap run``; ``LAYERS_ROS1`` and ``LAYERS_ROS2`` are the addresses of the
rosbridges.
"""

import os

import webmap
from webmap import html

ABOVE = {"ros1": "/robot_0/move_base", "ros2": "/robot_0"}
FOOT = {"ros1": "footprint", "ros2": "published_footprint"}
# In ROS 2 the names of parts do not distinguish robots.
PARTS = {"ros1": "robot_0/", "ros2": ""}


def robot_of(dialect: str, bridge: webmap.Bridge) -> webmap.Robot:
    robot = webmap.Robot("Bob")
    robot.set_odometry_topic(bridge, "/robot_0/odom")
    robot.set_tf(bridge, base_frame="robot_0/base_link")
    scan = ("LaserScanner", bridge, "/robot_0/base_scan")
    robot.add_module(*scan, max_dots=None, throttle=0)
    robot.add_module("PointCloud", bridge, "/robot_0/points", colour_by="z", z_min=0.1)
    robot.add_module("Path", bridge, "/robot_0/plan")
    robot.add_module("Trail")
    robot.add_module("PoseArray", bridge, "/robot_0/particlecloud")
    robot.add_module("PoseWithCovariance", bridge, "/robot_0/amcl_pose")
    foot = f"{ABOVE[dialect]}/local_costmap/{FOOT[dialect]}"
    robot.add_module("Polygon", bridge, foot)
    robot.add_module("Range", bridge, "/robot_0/sonar")
    robot.add_module("PointStamped", bridge, "/robot_0/lookahead_point", frame="robot")
    robot.add_module("GridCells", bridge, "/robot_0/inflated_obstacles")
    robot.add_module("NavSatFix", bridge, "/robot_0/fix", datum=(48.4, 9.95))
    return robot


def build(page: webmap.Page, dialect: str, bridge: webmap.Bridge) -> None:
    if dialect not in robots:
        robots[dialect] = robot_of(dialect, bridge)
    robot, above = robots[dialect], ABOVE[dialect]
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("OccupancyGrid", bridge, "/map")
    for part in ("global", "local"):
        map.add_module(
            "OccupancyGrid",
            bridge,
            f"{above}/{part}_costmap/costmap",
            palette="costmap",
            map_frame="map",
        ).layer.svg.classes.add(part)
    map.add_module("Markers", bridge, "/robot_0/markers")
    map.add_module("LayerSwitches")
    map.add_image("page_of_export.png", 15.0, 9.0, 3.0, 2.0)
    map.add_robot(robot)
    map.fit(-20, -13, 40, 26)
    robot.add_module(Words, page, bridge, PARTS[dialect])


class Words:
    """The data beside the map: battery, health, logs and a picture."""

    def __init__(self, robot, page, bridge, parts) -> None:
        self.charge, self.view = html.p(id="charge"), html.img(id="view", alt="")
        health, log = html.ul(id="health"), html.ol(id="log")
        page.element("beside").append(self.charge, health, log, self.view)
        self.battery = robot.add_module("Battery", bridge, "/robot_0/battery_state")
        robot.add_module("Diagnostics", bridge, prefix=parts).show_in(health)
        robot.add_module("Rosout", bridge, prefix="robot_0", level="info").show_in(log)
        camera = "/robot_0/camera/image_raw/compressed"
        self.camera = robot.add_module("Camera", bridge, camera)
        self.camera.watch(self.look)

    def look(self) -> None:
        self.view.set(src=self.camera.url)

    def on_battery_update(self, battery) -> None:
        self.charge.text = f"{100 * battery.charge:.1f} %"


robots: dict[str, webmap.Robot] = {}
for name in ("ros1", "ros2"):
    link = webmap.Bridge(os.environ[f"LAYERS_{name.upper()}"], name=name)

    @webmap.page(f"/{name}", html="page_of_layers.html")
    def show(page, dialect=name, link=link) -> None:
        build(page, dialect, link)
