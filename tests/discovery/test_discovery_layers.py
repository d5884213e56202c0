"""Which topics are drawn besides, by rules of names and types."""

import pytest

from webmap import Bridge
from webmap.core.module_arguments import check_arguments
from webmap.core.registry import map_modules, robot_modules
from webmap.discovery.found import FoundLayer
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
def test_what_an_aggregator_says_is_shown_where_nobody_else_does(first):
    topics = {"/diagnostics_agg": "diagnostic_msgs/DiagnosticArray"}
    topics[first] = "diagnostic_msgs/DiagnosticArray"
    assert [layer.topic for layer in find_layers(topics, [""])[""].drawn] == [first]


@pytest.mark.parametrize("space", ["/a", "/z"])
def test_a_robots_own_diagnostics_come_before_those_that_all_share(space):
    topics = dict.fromkeys(
        ["/diagnostics", f"{space}/diagnostics"], "diagnostic_msgs/DiagnosticArray"
    )
    (layer,) = find_layers(topics, [space])[space].drawn
    assert layer.topic == f"{space}/diagnostics"
    assert drawing(layer, space, None).options == {"namespace": ""}


def test_of_a_topic_that_robots_share_each_gets_what_is_in_its_namespace():
    layer = FoundLayer("health", "/diagnostics", "diagnostic_msgs/DiagnosticArray", "")
    drawn = drawing(layer, "/a", None)
    assert drawn == Drawing("Diagnostics", {"namespace": "/a"})


@pytest.mark.parametrize("type", ["gps_common/GPSFix", "gps_msgs/msg/GPSFix"])
def test_a_gps_fix_is_drawn_where_there_is_no_other(type):
    topics = {"/gps/detailed": type}
    (layer,) = find_layers(topics, [""])[""].drawn
    assert (layer.kind, layer.topic) == ("fix", "/gps/detailed")
    assert drawing(layer, "", None) == Drawing("NavSatFix", {"type": type})
    topics["/gps/plain"] = "sensor_msgs/NavSatFix"
    (layer,) = find_layers(topics, [""])[""].drawn
    assert drawing(layer, "", None) == Drawing("NavSatFix")


def test_what_nav2_publishes_is_drawn_once_each():
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
    assert whole.options["order"] < 20.0, "it lies under the local one"
    assert whole.options["throttle"] > local.options["throttle"], "and comes less often"


@pytest.mark.parametrize("space", ["", "/tb"])
@pytest.mark.parametrize("above", ["", "/move_base"])
def test_the_global_costmap_is_one_of_its_own_also_without_a_local_one(space, above):
    topic = f"{space}{above}/global_costmap/costmap"
    (found,) = find_layers({topic: "nav_msgs/OccupancyGrid"}, [space])[space].drawn
    assert (found.kind, found.topic) == ("global costmap", topic)


def test_move_base_has_other_names():
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


def test_inflated_cells_of_a_local_costmap_come_first_and_the_unknown_is_none():
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


def test_what_a_controller_steers_to_is_on_the_robot_where_no_frames_are_told():
    topics = {"/lookahead_point": "geometry_msgs/msg/PointStamped"}
    (layer,) = find_layers(topics, [""])[""].drawn
    options = drawing(layer, "", None).options
    assert (options["name"], options["frame"]) == ("lookahead", "robot")


def test_what_has_an_odd_name_is_drawn_by_its_type():
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
        # The same goal a second time is left out; where a pose is told is no layer.
        "move_base/current_goal": "goal",
        "dock": "pose",
        "clicked_point": "point",
        "frontiers": "cells",
        "ekf_pose": "covariance",
    }
    (other,) = find_layers(topics, ["/a"])["/a"].left_out
    assert other.topic == "/a/move_base_simple/goal"


def test_every_map_is_drawn_a_robots_own_with_it_and_a_shared_one_once():
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
def test_every_kind_has_a_module_that_takes_its_arguments(kind, type):
    layer = FoundLayer(kind.name, "/a/topic", type)
    drawn = drawing(layer, "/a", FRAMES, 2)
    factory = (map_modules if drawn.of_maps or drawn.shared else robot_modules)[
        drawn.module
    ]
    check_arguments(factory, (Bridge(URL), "/a/topic"), drawn.options)
    assert all(kind.names.values()), "they are shown to people"


def test_each_robot_gets_its_own_and_health_is_everybodys():
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
    assert [layer.topic for layer in alone] == ["/sonar"], "whose else could it be"


@pytest.mark.parametrize(
    ("type", "most"),
    [
        ("sensor_msgs/Range", 8),
        ("sensor_msgs/PointCloud2", 2),
        ("visualization_msgs/MarkerArray", 3),
    ],
)
def test_a_robot_gets_so_many_of_a_kind_and_no_more(type, most):
    topics = {f"/cloud_points_{number}": type for number in range(20)}
    assert len(find_layers(topics, [""])[""].drawn) == most


def test_without_robots_nothing_is_drawn():
    assert find_layers(NAV2, []) == {}
