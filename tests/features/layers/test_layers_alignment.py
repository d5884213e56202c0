"""Robots whose maps differ from the common map."""

import math

import pytest
from module_fakes import Link, pose, to_root
from test_layers_frames import send_transforms, transform
from test_layers_grid import CORNERS, grid

from webmap import Robot
from webmap.base.errors import ConfigError
from webmap.base.geometry import Pose
from webmap.poses.alignment import align_bridge, toml_line

QUARTER = math.pi / 2


def header(seconds=100.0, frame="map") -> dict:
    return {"stamp": {"secs": int(seconds), "nsecs": 0}, "frame_id": frame}


@pytest.fixture
def link():
    return Link()


@pytest.fixture
def bob(link):
    robot = Robot("Bob")
    robot.set_odometry_topic(link, "/odom", 0, type="geometry_msgs/PoseStamped")
    yield robot
    robot.destroy()


def go(link, x, y, yaw=0.0, seconds=100.0) -> None:
    link.publish("/odom", {"header": header(seconds), "pose": pose(x, y, yaw)})


def where(robot):
    return pytest.approx((robot.position.x, robot.position.y, robot.yaw), abs=1e-9)


def test_a_robot_is_drawn_at_its_aligned_pose(link, bob):
    bob.set_alignment(10.0, 5.0, 90.0)
    go(link, 2.0, 0.0, 0.5)
    assert where(bob) == (10.0, 7.0, QUARTER + 0.5)
    placed = to_root(bob.svg)
    assert placed.apply(0, 0) == pytest.approx((10.0, 7.0))


def test_a_new_alignment_moves_the_robot_at_once(link, bob):
    go(link, 2.0, 0.0)
    moved = []
    bob.add_module(lambda robot: Watch(moved))
    bob.set_alignment(0.0, 1.0, 0.0)
    assert where(bob) == (2.0, 1.0, 0.0)
    assert len(moved) == 1
    assert bob.problems == {}, "an alignment is no jump of the robot"
    bob.unset_alignment()
    assert where(bob) == (2.0, 0.0, 0.0)


class Watch:
    def __init__(self, moved):
        self.moved = moved

    def on_odometry_update(self):
        self.moved.append(1)


def test_a_bridge_alignment_moves_all_robots_without_their_own_alignment(link, bob):
    ann = Robot("Ann")
    ann.set_odometry_topic(link, "/ann/odom", 0, type="geometry_msgs/PoseStamped")
    ann.set_alignment(0.0, 0.0, 0.0)
    align_bridge(link, 3.0, 0.0, 0.0)
    go(link, 1.0, 0.0)
    link.publish("/ann/odom", {"header": header(), "pose": pose(1.0, 0.0)})
    assert where(bob) == (4.0, 0.0, 0.0)
    assert where(ann) == (1.0, 0.0, 0.0)
    align_bridge(link, 5.0, 0.0, 0.0)
    assert where(bob) == (6.0, 0.0, 0.0)
    ann.unset_alignment()
    assert where(ann) == (6.0, 0.0, 0.0)
    ann.destroy()


def test_a_bridge_alignment_applies_only_to_robots_of_that_bridge(bob):
    go_on = Link()
    align_bridge(go_on, 3.0, 0.0, 0.0)
    assert bob.pose_source.alignment == Pose()
    bob.set_odometry_topic(go_on, "/odom", 0, type="geometry_msgs/PoseStamped")
    go(go_on, 1.0, 0.0)
    assert where(bob) == (4.0, 0.0, 0.0)


def test_the_path_and_the_sonar_cone_are_aligned_with_the_robot(link, bob):
    way = bob.add_module("Path", link, "/plan")
    cone = bob.add_module("Range", link, "/sonar")
    bob.set_alignment(10.0, 0.0, 90.0)
    go(link, 2.0, 0.0)
    points = [{"header": header(), "pose": pose(x, 0.0)} for x in (2.0, 4.0)]
    link.publish("/plan", {"header": header(), "poses": points})
    sonar = {"radiation_type": 0, "field_of_view": 0.5, "range": 1.0}
    limits = {"min_range": 0.1, "max_range": 5.0}
    link.publish("/sonar", {"header": header(), **sonar, **limits})
    assert to_root(way.line).apply(4.0, 0.0) == pytest.approx((10.0, 4.0))
    assert to_root(cone.cone).apply(1.0, 0.0) == pytest.approx((10.0, 3.0))
    bob.set_alignment(0.0, 0.0, 0.0)
    assert to_root(way.line).apply(4.0, 0.0) == pytest.approx((4.0, 0.0))
    assert to_root(cone.cone).apply(1.0, 0.0) == pytest.approx((3.0, 0.0))


def test_the_trail_of_an_aligned_robot_ends_at_the_robot(link, bob):
    bob.set_alignment(10.0, 0.0, 90.0)
    trail = bob.add_module("Trail")
    for step in range(4):
        go(link, step / 8, 0.0, seconds=100.0 + step)
    ((*_, last),) = trail.points
    assert to_root(trail.svg).apply(*last) == pytest.approx((10.0, 0.375))


@pytest.mark.parametrize("map_frame", [None, "map"])
def test_grids_and_markers_of_a_robot_are_aligned_with_the_robot(
    map, link, bob, map_frame
):
    map.add_robot(bob)
    received = {"map_frame": map_frame}
    bob.add_module("OnMaps", "OccupancyGrid", link, "/bob/costmap", **received)
    bob.add_module("OnMaps", "Markers", link, "/bob/markers", **received)
    map.add_module("OccupancyGrid", link, "/map")
    costmap, markers, common = (
        next(m.layer for m in map.modules if getattr(m, "layer", link).topic == topic)
        for topic in ("/bob/costmap", "/bob/markers", "/map")
    )
    align_bridge(link, 1.0, 0.0, 0.0)
    for layer in (costmap, markers, common):
        assert to_root(layer.svg).apply(2.0, 0.0) == pytest.approx((3.0, 0.0))
    bob.set_alignment(10.0, 0.0, 90.0)
    for layer in (costmap, markers):
        assert to_root(layer.svg).apply(2.0, 0.0) == pytest.approx((10.0, 2.0))
        assert layer.svg.get("data-layer-of") == bob.id
        assert layer.svg.get("data-bridge") is None, "the page moves it with the robot"
    assert to_root(common.svg).apply(2.0, 0.0) == pytest.approx((3.0, 0.0))
    bob.unset_alignment()
    for layer in (costmap, markers):
        assert to_root(layer.svg).apply(2.0, 0.0) == pytest.approx((3.0, 0.0))


def test_a_costmap_in_the_odometry_frame_is_aligned_with_its_robot(map, link, bob):
    map.add_robot(bob)
    bob.add_module("OnMaps", "OccupancyGrid", link, "/bob/costmap", map_frame="map")
    bob.set_alignment(10.0, 0.0, 90.0)
    (layer,) = (m.layer for m in map.modules if hasattr(m, "layer"))
    link.publish("/bob/costmap", {**grid(CORNERS, 1.0), "header": header(frame="odom")})
    send_transforms(link, transform("map", "odom", 3.0, 0.0, 0.0))
    assert to_root(layer.svg).apply(1.0, 0.0) == pytest.approx((10.0, 4.0))


def test_layers_of_a_removed_robot_leave_no_listeners(map, link, bob):
    map.add_robot(bob)
    bob.add_module("OnMaps", "Markers", link, "/bob/markers")
    map.remove_robot(bob)
    assert bob.pose_source._listeners == {}


def test_the_motion_spec_for_the_gate_contains_the_alignment(link, bob):
    link.protect = lambda topic, carries: None
    bob.set_move_topic(link, "/goal")
    assert bob.motion.spec().own_map == (0.0, 0.0, 0.0)
    bob.set_alignment(1.0, 2.0, 90.0)
    assert bob.motion.spec().own_map == (1.0, 2.0, QUARTER)
    bob.unset_alignment()
    align_bridge(link, 7.0, 0.0, 0.0)
    assert bob.motion.spec().own_map == (7.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "wrong", [(math.nan, 0, 0), (0, math.inf, 0), (0, 0, "north"), (True, 0, 0)]
)
def test_an_invalid_alignment_is_refused_and_the_robot_does_not_move(link, bob, wrong):
    go(link, 1.0, 0.0)
    with pytest.raises(ConfigError, match="metres and an angle in degrees"):
        bob.set_alignment(*wrong)
    assert where(bob) == (1.0, 0.0, 0.0)


def test_the_toml_line_of_an_alignment_names_its_units():
    line = toml_line(Pose(1.23456, -2.0, QUARTER))
    assert line == "alignment = [1.235, -2.0, 90.0] # metres, metres, degrees"
