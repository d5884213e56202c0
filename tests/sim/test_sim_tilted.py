"""Sensors that are not level, compared with the true places of walls."""

import math

import numpy as np
import pytest
from simulated import Bench
from test_sim_feeds import messages_of

from webmap.base.geometry import Quaternion, Vector3
from webmap.ros.tf import Transform
from webmap.sim.feeds.sensors import CAMERA_POINT, LIDAR_POINT

DIALECTS = pytest.mark.parametrize("dialect", ["ros1", "ros2"])


def mounted(bench, name) -> Transform:
    """Return the pose of a sensor on its robot, from ``/tf_static``."""
    (message,) = messages_of(bench, "/tf_static", 0.1)
    for each in message["transforms"]:
        if each["child_frame_id"] == f"robot_0/{name}":
            assert each["header"]["frame_id"] == "robot_0/base_link"
            found = each["transform"]
            return Transform(
                Vector3(**found["translation"]), Quaternion(**found["rotation"])
            )
    raise AssertionError(name)


def on_map(bench, name, points) -> np.ndarray:
    """Return the points of a sensor on the map, of shape (N, 3)."""
    place = Transform.from_pose(bench.world.robots[0].pose) @ mounted(bench, name)
    found = (place.apply(Vector3(*map(float, point))) for point in points)
    return np.array([(p.x, p.y, p.z) for p in found])


def to_wall(points) -> np.ndarray:
    """Return the distances of points from the room's walls, in metres."""
    x, y = points[:, 0], points[:, 1]
    edge = np.minimum(np.minimum(x, 10 - x), np.minimum(y, 6 - y))
    return abs(edge - 0.05)


@DIALECTS
def test_the_scan_of_an_upside_down_scanner_lies_on_the_walls(dialect):
    bench = Bench(dialect, robots=1, tilted=True)
    scan = messages_of(bench, "/robot_0/base_scan")[-1]
    assert mounted(bench, "base_laser").rotation == Quaternion(1.0, 0.0, 0.0, 0.0)
    turns = scan["angle_min"] + scan["angle_increment"] * np.arange(360)
    rays = [
        (r * math.cos(a), r * math.sin(a), 0.0)
        for r, a in zip(scan["ranges"], turns, strict=True)
        if r is not None
    ]
    assert len(rays) > 100
    there = on_map(bench, "base_laser", rays)
    assert to_wall(there).max() < 0.01
    assert there[:, 2] == pytest.approx(0.2)


def test_the_cloud_of_an_upside_down_lidar_has_the_floor_at_the_bottom():
    bench = Bench(robots=1, tilted=True)
    cloud = messages_of(bench, "/robot_0/points", compression="cbor")[-1]
    points = np.frombuffer(cloud["data"], LIDAR_POINT)
    there = on_map(bench, "base_laser", zip(*(points[a] for a in "xyz"), strict=True))
    assert there[:, 2].min() == pytest.approx(0.0, abs=1e-3)
    assert to_wall(there[there[:, 2] > 0.01]).max() < 0.01


def test_the_cloud_of_a_depth_camera_is_in_its_optical_frame():
    bench = Bench(robots=1, tilted=True)
    cloud = messages_of(bench, "/robot_0/camera/points", compression="cbor")[-1]
    assert cloud["header"]["frame_id"] == "robot_0/camera_optical"
    points = np.frombuffer(cloud["data"], CAMERA_POINT)
    assert points["z"].min() > 0.2, "the z axis points forward"
    there = on_map(
        bench, "camera_optical", zip(*(points[a] for a in "xyz"), strict=True)
    )
    heights = there[:, 2]
    assert heights.min() == pytest.approx(0.0, abs=1e-3)
    assert heights.max() > 0.5
    assert to_wall(there[heights > 0.01]).max() < 0.01
    at = bench.world.robots[0].pose
    aside = np.arctan2(there[:, 1] - at.y, there[:, 0] - at.x) - at.yaw
    aside = (aside + math.pi) % math.tau - math.pi
    assert abs(aside).max() < math.radians(31), "only points ahead are seen"


def test_robots_without_tilted_sensors_have_no_depth_camera():
    bench = Bench(robots=1)
    assert "/robot_0/camera/points" not in bench.graph.topics
