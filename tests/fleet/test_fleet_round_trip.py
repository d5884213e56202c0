"""A fleet file that discovery writes shows the same as ``webmap view``."""

import asyncio

import pytest

from webmap import Bridge
from webmap.console import Console
from webmap.discovery import discover
from webmap.discovery.fleet_toml import fleet_toml
from webmap.features.layers.on_maps import OnMaps
from webmap.fleet.fleet_file import prepare
from webmap.fleet.periodic_search import LayerSearch
from webmap.fleet.robot_options import Candidate
from webmap.fleet.view_robots import ViewRobots

URL = "ws://hall:9090"

OF_A_ROBOT = {
    "odom": "nav_msgs/Odometry",
    "cmd_vel": "geometry_msgs/Twist",
    "front/scan": "sensor_msgs/LaserScan",
    "rear/scan": "sensor_msgs/LaserScan",
    "battery_state": "sensor_msgs/BatteryState",
    "camera/image_raw/compressed": "sensor_msgs/CompressedImage",
    "points": "sensor_msgs/PointCloud2",
    "map": "nav_msgs/OccupancyGrid",
    "keepout": "nav_msgs/OccupancyGrid",
    "local_costmap/costmap": "nav_msgs/OccupancyGrid",
    "plan": "nav_msgs/Path",
    "local_plan": "nav_msgs/Path",
    "trajectory": "nav_msgs/Path",
    "particlecloud": "geometry_msgs/PoseArray",
    "amcl_pose": "geometry_msgs/PoseWithCovarianceStamped",
    "local_costmap/footprint": "geometry_msgs/PolygonStamped",
    "zone": "geometry_msgs/PolygonStamped",
    "move_base/current_goal": "geometry_msgs/PoseStamped",
    "dock": "geometry_msgs/PoseStamped",
    "lookahead_point": "geometry_msgs/PointStamped",
    "clicked_point": "geometry_msgs/PointStamped",
    "local_costmap/inflated_obstacles": "nav_msgs/GridCells",
    "sonar": "sensor_msgs/Range",
    "markers": "visualization_msgs/MarkerArray",
    "fix": "sensor_msgs/NavSatFix",
}
SHARED = {
    "/map": "nav_msgs/OccupancyGrid",
    "/other_map": "nav_msgs/OccupancyGrid",
    "/tf": "tf2_msgs/TFMessage",
    "/diagnostics": "diagnostic_msgs/DiagnosticArray",
}


def topics(*spaces):
    return SHARED | {
        f"{space}/{name}": type for space in spaces for name, type in OF_A_ROBOT.items()
    }


def viewed(found):
    """The robots and the maps that ``webmap view`` makes of these topics."""
    bridge, console = Bridge(URL), Console()
    late = ViewRobots(console)
    findings = discover(found, "bob")
    for robot in findings.robots:
        late.add(Candidate(bridge, robot))
    asyncio.run(LayerSearch(bridge, late).take(found))
    return console.robots, {topic for _, topic in console.grids}


def shown(robot):
    """The modules of a robot: their names, topics and classes."""
    listed = []
    for module in robot.modules:
        if isinstance(module, OnMaps):
            (_, topic), options = module._arguments
            received = {key: value for key, value in options.items() if key != "robot"}
            received = {key: value for key, value in received.items() if value != ""}
            listed.append((module.module, topic, str(sorted(received.items()))))
        else:
            drawn = getattr(module, "svg", None)
            classes = [] if drawn is None else list(drawn.classes)
            topic = getattr(module, "topic", "")
            listed.append((type(module).__name__, topic, " ".join(classes)))
    return sorted(listed)


@pytest.mark.parametrize("spaces", [("/a", "/b"), ("",)])
def test_the_fleet_file_of_discover_shows_the_same_layers_as_view(tmp_path, spaces):
    found = topics(*spaces)
    file = tmp_path / "fleet.toml"
    file.write_text(fleet_toml([("hall", URL, discover(found, "bob"))]))
    ready = prepare(file)
    robots, maps = viewed(found)
    try:
        assert len(robots) == len(spaces)
        for kept, seen in zip(ready.robots, robots, strict=True):
            assert kept.name == seen.name
            assert shown(kept) == shown(seen)
            assert len(shown(seen)) > 20, "few modules were compared"
        assert {line.topic for line in ready.fleet.map} == maps
    finally:
        for robot in (*robots, *ready.robots):
            robot.destroy()


def test_the_fleet_file_lists_topics_beyond_the_limit_as_comments(tmp_path):
    many = topics("") | {f"/path_{n}": "nav_msgs/Path" for n in range(9)}
    text = fleet_toml([("hall", URL, discover(many, "bob"))])
    assert "# not drawn, beyond the limit for its kind: /path_8\n" in text
