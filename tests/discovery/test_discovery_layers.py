"""Which other topics are drawn, by rules for names and types."""

import pytest

from webmap import Bridge
from webmap.core.module_arguments import check_arguments
from webmap.core.registry import map_modules, robot_modules
from webmap.discovery.findings import FoundLayer
from webmap.discovery.layers import Drawing, drawing, find_layers
from webmap.modules.declaration import declarations

URL = "ws://hall:9090"
FRAMES = {"map_frame": "map", "namespace": "/a"}

NAV2 = {
    "/tb/local_costmap/costmap": "nav_msgs/msg/OccupancyGrid",
    "/tb/local_costmap/costmap_updates": "map_msgs/msg/OccupancyGridUpdate",
    "/tb/local_costmap/costmap_raw": "nav2_msgs/msg/Costmap",
    "/tb/global_costmap/costmap": "nav_msgs/msg/OccupancyGrid",
    "/tb/local_costmap/published_footprint": "geometry_msgs/msg/PolygonStamped",
    "/tb/global_costmap/published_footprint": "geometry_msgs/msg/PolygonStamped",
    "/tb/particle_cloud": "nav2_msgs/msg/ParticleCloud",
    "/tb/amcl_pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/tb/initialpose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/tb/local_plan": "nav_msgs/msg/Path",
    "/tb/plan": "nav_msgs/msg/Path",
    "/tb/lookahead_point": "geometry_msgs/msg/PointStamped",
    "/tb/camera/depth/points": "sensor_msgs/msg/PointCloud2",
    "/tb/waypoints": "visualization_msgs/msg/MarkerArray",
    "/tb/gps/fix": "sensor_msgs/msg/NavSatFix",
    "/tb/ir_left": "sensor_msgs/msg/Range",
    "/tb/map": "nav_msgs/msg/OccupancyGrid",
    "/tb/odd": "no type",
    "not a topic": "sensor_msgs/msg/Range",
}


def kinds(found) -> dict[str, str]:
    return {layer.topic.removeprefix("/tb"): layer.kind for layer in found}


@pytest.mark.parametrize("first", ["/diagnostics", "/diagnostics_agg"])
def test_aggregated_diagnostics_are_drawn_if_there_are_no_plain_diagnostics(first):
    topics = {"/diagnostics_agg": "diagnostic_msgs/DiagnosticArray"}
    topics[first] = "diagnostic_msgs/DiagnosticArray"
    assert [layer.topic for layer in find_layers(topics, [""])[""].drawn] == [first]


@pytest.mark.parametrize("space", ["/a", "/z"])
def test_the_diagnostics_of_a_robot_are_preferred_to_shared_diagnostics(space):
    topics = dict.fromkeys(
        ["/diagnostics", f"{space}/diagnostics"], "diagnostic_msgs/DiagnosticArray"
    )
    (layer,) = find_layers(topics, [space])[space].drawn
    assert layer.topic == f"{space}/diagnostics"
    assert drawing(layer, space, None).options == {"namespace": ""}


def test_shared_diagnostics_are_limited_to_the_namespace_of_the_robot():
    layer = FoundLayer("health", "/diagnostics", "diagnostic_msgs/DiagnosticArray", "")
    drawn = drawing(layer, "/a", None)
    assert drawn == Drawing("Diagnostics", {"namespace": "/a"})


@pytest.mark.parametrize("type", ["gps_common/GPSFix", "gps_msgs/msg/GPSFix"])
def test_a_gps_fix_message_is_drawn_if_there_is_no_nav_sat_fix(type):
    topics = {"/gps/detailed": type}
    (layer,) = find_layers(topics, [""])[""].drawn
    assert (layer.kind, layer.topic) == ("fix", "/gps/detailed")
    assert drawing(layer, "", None) == Drawing("NavSatFix", {"type": type})
    topics["/gps/plain"] = "sensor_msgs/NavSatFix"
    (layer,) = find_layers(topics, [""])[""].drawn
    assert drawing(layer, "", None) == Drawing("NavSatFix")


def test_each_topic_of_nav2_is_drawn_once():
    found = find_layers(NAV2, ["/tb"])["/tb"].drawn
    assert kinds(found) == {
        "/local_costmap/costmap": "costmap",
        "/global_costmap/costmap": "global costmap",
        "/local_costmap/published_footprint": "footprint",
        "/particle_cloud": "particles",
        "/amcl_pose": "covariance",
        "/local_plan": "local plan",
        "/camera/depth/points": "cloud",
        "/lookahead_point": "lookahead",
        "/waypoints": "markers",
        "/gps/fix": "fix",
        "/ir_left": "range",
        "/plan": "path",
        "/map": "map",
    }
    local, whole = (drawing(layer, "/tb", None) for layer in found[:2])
    assert local.module == whole.module == "OccupancyGrid"
    assert whole.options["order"] < 20.0, "it is drawn under the local costmap"
    assert whole.options["throttle"] > local.options["throttle"], (
        "it is requested less often"
    )


@pytest.mark.parametrize("space", ["", "/tb"])
@pytest.mark.parametrize("above", ["", "/move_base"])
def test_a_global_costmap_is_recognised_without_a_local_costmap(space, above):
    topic = f"{space}{above}/global_costmap/costmap"
    (found,) = find_layers({topic: "nav_msgs/OccupancyGrid"}, [space])[space].drawn
    assert (found.kind, found.topic) == ("global costmap", topic)


def test_topics_of_move_base_are_recognised():
    topics = {
        "/move_base/local_costmap/costmap": "nav_msgs/OccupancyGrid",
        "/move_base/local_costmap/footprint": "geometry_msgs/PolygonStamped",
        "/move_base/DWAPlannerROS/local_plan": "nav_msgs/Path",
        "/particlecloud": "geometry_msgs/PoseArray",
    }
    found = find_layers(topics, [""])[""].drawn
    assert sorted(layer.kind for layer in found) == [
        "costmap",
        "footprint",
        "local plan",
        "particles",
    ]


def test_inflated_local_cells_are_drawn_first_and_unknown_cells_are_not_drawn():
    names = "obstacles", "inflated_obstacles", "unknown_space"
    costmaps = "/a/global_costmap", "/a/local_costmap"
    topics = {
        f"{costmap}/{name}": "nav_msgs/GridCells"
        for costmap in costmaps
        for name in names
    }
    assert [layer.topic for layer in find_layers(topics, ["/a"])["/a"].drawn] == [
        "/a/local_costmap/inflated_obstacles",
        "/a/local_costmap/obstacles",
        "/a/global_costmap/inflated_obstacles",
    ]
    (other,) = find_layers(topics, ["/a"])["/a"].left_out
    assert other.topic == "/a/global_costmap/obstacles"


def test_a_lookahead_point_without_known_frames_is_drawn_in_the_robot_frame():
    topics = {"/lookahead_point": "geometry_msgs/msg/PointStamped"}
    (layer,) = find_layers(topics, [""])[""].drawn
    options = drawing(layer, "", None).options
    assert (options["name"], options["frame"]) == ("lookahead", "robot")


def test_a_topic_with_an_unusual_name_is_drawn_by_its_type():
    topics = {
        "/a/front": "sensor_msgs/LaserScan",
        "/a/rear": "sensor_msgs/LaserScan",
        "/a/map": "nav_msgs/OccupancyGrid",
        "/a/keepout": "nav_msgs/OccupancyGrid",
        "/a/trajectory": "nav_msgs/Path",
        "/a/transformed_global_plan": "nav_msgs/Path",
        "/a/velodyne": "sensor_msgs/PointCloud2",
        "/a/trees": "geometry_msgs/PoseArray",
        "/a/zone": "geometry_msgs/PolygonStamped",
        "/a/move_base/current_goal": "geometry_msgs/PoseStamped",
        "/a/move_base_simple/goal": "geometry_msgs/PoseStamped",
        "/a/dock": "geometry_msgs/PoseStamped",
        "/a/clicked_point": "geometry_msgs/PointStamped",
        "/a/frontiers": "nav_msgs/GridCells",
        "/a/ekf_pose": "geometry_msgs/PoseWithCovarianceStamped",
        "/a/initialpose": "geometry_msgs/PoseWithCovarianceStamped",
    }
    found = find_layers(topics, ["/a"])["/a"].drawn
    assert {layer.topic.removeprefix("/a/"): layer.kind for layer in found} == {
        "front": "scan",
        "rear": "scan",
        "map": "map",
        "keepout": "grid",
        "trajectory": "path",
        "transformed_global_plan": "path",
        "velodyne": "cloud",
        "trees": "poses",
        "zone": "polygon",
        # A second topic with the same goal is left out; pose topics are no layers.
        "move_base/current_goal": "goal",
        "dock": "pose",
        "clicked_point": "point",
        "frontiers": "cells",
        "ekf_pose": "covariance",
    }
    (other,) = find_layers(topics, ["/a"])["/a"].left_out
    assert other.topic == "/a/move_base_simple/goal"


def test_the_map_of_each_robot_and_the_shared_map_are_drawn_once():
    grid = "nav_msgs/OccupancyGrid"
    topics = {"/map": grid, "/a/map": grid, "/b/map": grid, "/b/static_map": grid}
    found = find_layers(topics, ["/a", "/b"])
    drawn = {
        (layer.topic, drawing(layer, space, FRAMES).shared)
        for space, layers in found.items()
        for layer in layers.drawn
    }
    assert drawn == {
        ("/map", True),
        ("/a/map", False),
        ("/b/map", False),
        ("/b/static_map", False),
    }
    own = drawing(found["/a"].drawn[0], "/a", FRAMES)
    assert (own.module, own.of_maps, own.options) == ("OccupancyGrid", True, FRAMES)


KINDS = [
    (kind, type)
    for declared in declarations()
    for kind in declared.kinds
    for type in kind.types
]


@pytest.mark.parametrize(("kind", "type"), KINDS, ids=str)
def test_every_layer_kind_has_a_module_that_accepts_its_arguments(kind, type):
    layer = FoundLayer(kind.name, "/a/topic", type)
    drawn = drawing(layer, "/a", FRAMES, 2)
    factory = (map_modules if drawn.of_maps or drawn.shared else robot_modules)[
        drawn.module
    ]
    check_arguments(factory, (Bridge(URL), "/a/topic"), drawn.options)
    assert all(kind.names.values()), "the names are shown to users"


def test_each_robot_gets_its_own_range_and_the_shared_diagnostics():
    topics = {
        "/a/sonar": "sensor_msgs/Range",
        "/b/sonar": "sensor_msgs/Range",
        "/sonar": "sensor_msgs/Range",
        "/diagnostics": "diagnostic_msgs/DiagnosticArray",
    }
    found = find_layers(topics, ["/a", "/b"])
    for space, layers in found.items():
        drawn = [layer.topic for layer in layers.drawn]
        assert drawn == [f"{space}/sonar", "/diagnostics"]
    alone = find_layers({"/sonar": "sensor_msgs/Range"}, ["/a"])["/a"].drawn
    assert [layer.topic for layer in alone] == ["/sonar"], "there is only one robot"


@pytest.mark.parametrize(
    ("type", "most"),
    [
        ("sensor_msgs/Range", 8),
        ("sensor_msgs/PointCloud2", 2),
        ("visualization_msgs/MarkerArray", 3),
    ],
)
def test_the_number_of_layers_of_one_kind_is_limited(type, most):
    topics = {f"/cloud_points_{number}": type for number in range(20)}
    assert len(find_layers(topics, [""])[""].drawn) == most


def test_without_robots_no_layers_are_found():
    assert find_layers(NAV2, []) == {}
