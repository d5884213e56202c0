"""Sensor data is drawn where the robot was when the sensor measured."""

import math

import numpy as np
import pytest
from module_fakes import dots, pose, to_root
from test_layers_cloud import cloud
from test_layers_frames import send_transforms
from test_layers_poses import sonar

from webmap.base.geometry import Affine

# A robot that turns on the spot at (4, 3) with 1 rad/s, from 100.0 s on.
AT = (4.0, 3.0)
WALL = [(2.0, 0.0), (2.0, 0.5), (1.0, -1.0)]
"""The points of the sensor, in its own frame, when the robot looks along x."""


def stamp(seconds: float) -> dict:
    return {"sec": int(seconds), "nanosec": round(seconds % 1 * 1e9)}


def transform(parent, child, x, y, yaw, seconds, *, roll=0.0) -> dict:
    at = pose(x, y, yaw)
    turn = at["orientation"]
    if roll:
        turn = {"x": math.cos(yaw / 2), "y": math.sin(yaw / 2), "z": 0.0, "w": 0.0}
    return {
        "header": {"stamp": stamp(seconds), "frame_id": parent},
        "child_frame_id": child,
        "transform": {"translation": at["position"], "rotation": turn},
    }


def odometry(link, seconds, frame="odom") -> None:
    """Publish the pose of the robot at a time."""
    header = {"stamp": stamp(seconds), "frame_id": frame}
    link.publish("/odom", {"header": header, "pose": pose(*AT, seconds - 100.0)})


def scan(points, seconds, frame="laser", *, increment=0.0) -> dict:
    """Return a scan with one ray for each point, at an angle in whole degrees."""
    rays: list[float | None] = [None] * 360
    for x, y in points:
        rays[round(math.degrees(math.atan2(y, x)) * 1) % 360] = math.hypot(x, y)
    return {
        "header": {"stamp": stamp(seconds), "frame_id": frame},
        "angle_min": 0.0,
        "angle_max": math.tau,
        "angle_increment": math.radians(1),
        "time_increment": increment,
        "scan_time": 0.1,
        "range_min": 0.1,
        "range_max": 10.0,
        "ranges": rays,
        "intensities": [],
    }


def seen_from(yaw, offset=(0.0, 0.0), *, points=WALL):
    """Return the sensor's points on the map, with the robot turned by an angle."""
    matrix = Affine.translation(*AT) @ Affine.rotation(yaw)
    return sorted(matrix.apply(x + offset[0], y + offset[1]) for x, y in points)


def on_map(element) -> list[tuple[float, float]]:
    return sorted(to_root(element).apply(*point) for point in dots(element))


def near(points):
    return pytest.approx(np.array(points), abs=0.03)  # a degree at 2 m


@pytest.fixture(autouse=True)
def no_patience(monkeypatch):
    monkeypatch.setattr("webmap.poses.placing.PROBLEM_DELAY", 0.0)
    monkeypatch.setattr("webmap.poses.frames.GRACE", 0.0)


@pytest.fixture
def scanner(robot, link):
    robot.set_odometry_topic(link, "/odom", 0, type="geometry_msgs/PoseStamped")
    return robot.add_module("LaserScanner", link, "/scan", max_dots=None)


def dot_of(scanner):
    (dot,) = scanner.svg.children
    return dot


def test_a_scan_stays_in_place_while_the_robot_turns(link, scanner, robot):
    for seconds in (100.0, 100.1):
        odometry(link, seconds)
    link.publish("/scan", scan(WALL, 100.05))
    for seconds in (100.2, 100.5, 101.0):
        odometry(link, seconds)
        assert np.array(on_map(dot_of(scanner))) == near(seen_from(0.05)), seconds
    assert robot.problems == {}
    assert scanner.svg.parent is robot.svg


def test_a_scan_newer_than_the_poses_is_corrected_when_poses_arrive(link, scanner):
    for seconds in (100.0, 100.1):
        odometry(link, seconds)
    link.publish("/scan", scan(WALL, 100.25))
    # As if the robot kept turning at the same speed.
    assert np.array(on_map(dot_of(scanner))) == near(seen_from(0.25))
    header = {"stamp": stamp(100.3), "frame_id": "odom"}
    link.publish("/odom", {"header": header, "pose": pose(*AT, 0.0)})
    # In fact the robot turned back: from 0.1 at 100.1 to 0.0 at 100.3.
    assert np.array(on_map(dot_of(scanner))) == near(seen_from(0.025))


def test_a_scan_without_a_stamp_moves_with_the_robot(link, scanner):
    odometry(link, 100.0)
    link.publish("/scan", scan(WALL, 0.0))
    odometry(link, 101.0)
    assert np.array(on_map(dot_of(scanner))) == near(seen_from(1.0))


def test_a_scan_of_another_clock_moves_with_the_robot_and_is_a_problem(
    link, scanner, robot
):
    robot.set_tf(link, quiet=True)
    send_transforms(
        link, transform("base_link", "laser", 0.0, 0.0, 0.0, 0), static=True
    )
    odometry(link, 100.0)
    odometry(link, 100.1)
    link.publish("/scan", scan(WALL, 163.0))
    assert np.array(on_map(dot_of(scanner))) == near(seen_from(0.1))
    odometry(link, 100.2)
    assert np.array(on_map(dot_of(scanner))) == near(seen_from(0.2))
    (problem,) = robot.problems.values()
    assert "are the clocks of the sensor and of the odometry the same?" in problem
    assert "62.900 s before the requested" in problem
    link.publish("/scan", scan(WALL, 100.15))
    assert robot.problems == {}


def test_without_frames_stamps_less_than_a_minute_off_are_no_problem(
    link, scanner, robot
):
    odometry(link, 100.0)
    link.publish("/scan", scan(WALL, 159.0))
    odometry(link, 100.2)
    assert np.array(on_map(dot_of(scanner))) == near(seen_from(0.2))
    assert robot.problems == {}


def test_without_frames_stamps_more_than_a_minute_off_are_a_problem(
    link, scanner, robot
):
    odometry(link, 100.0)
    link.publish("/scan", scan(WALL, 163.0))
    (problem,) = robot.problems.values()
    assert "63.000 s before the requested 163.000 s; are the clocks" in problem


def test_a_scan_of_a_robot_without_new_poses_is_no_problem(link, scanner, robot):
    odometry(link, 100.0)
    robot.pose_source.received_at -= 90.0
    link.publish("/scan", scan(WALL, 190.0))
    assert np.array(on_map(dot_of(scanner))) == near(seen_from(0.0))
    assert robot.problems == {}


def test_a_scan_is_corrected_for_the_rotation_during_its_sweep(link, scanner):
    for seconds in (100.0, 100.1, 100.2):
        odometry(link, seconds)
    took, wall = 0.1, []
    for degrees in (10, 120, 230, 350):
        turned = took * degrees / 360
        x, y = 2 * math.cos(math.radians(degrees)), 2 * math.sin(math.radians(degrees))
        wall.append((x, y))
        assert turned < took
    # The points are in the sensor's frame at the time of each ray.
    link.publish("/scan", scan(wall, 100.05, increment=took / 360))
    turned = [
        Affine.rotation(took * degrees / 360).apply(*point)
        for degrees, point in zip((10, 120, 230, 350), wall, strict=True)
    ]
    wanted = seen_from(0.05, points=turned)
    assert np.array(on_map(dot_of(scanner))) == pytest.approx(
        np.array(wanted), abs=0.002
    )


@pytest.mark.parametrize("named", ["map", "nowhere"])
def test_static_frames_place_a_sensor_on_a_turning_robot(link, scanner, robot, named):
    robot.set_tf(link, map_frame=named, quiet=True)
    send_transforms(
        link, transform("base_link", "laser", 0.5, 0.0, math.pi / 2, 0), static=True
    )
    for step in range(3):
        yaw = step / 10
        send_transforms(link, transform("map", "odom", 0, 0, 0, 100 + yaw))
        send_transforms(link, transform("odom", "base_link", *AT, yaw, 100 + yaw))
        odometry(link, 100 + yaw)
    link.publish("/scan", scan([(2.0, 0.0)], 100.15))
    for seconds in (100.3, 101.0):
        odometry(link, seconds)
        assert np.array(on_map(dot_of(scanner))) == near(
            seen_from(0.15, points=[(0.5, 2.0)])
        )


def test_a_scan_of_an_upside_down_sensor_is_mirrored(link, scanner, robot):
    robot.set_tf(link)
    over = transform("base_link", "laser", 0.2, 0.0, 0.0, 0, roll=math.pi)
    send_transforms(link, over, static=True)
    for seconds in (100.0, 100.1):
        send_transforms(link, transform("map", "odom", 0, 0, 0, seconds))
        send_transforms(
            link, transform("odom", "base_link", *AT, seconds - 100, seconds)
        )
        odometry(link, seconds)
    link.publish("/scan", scan([(2.0, 0.5), (1.0, -1.0)], 100.1))
    wanted = seen_from(0.1, (0.2, 0.0), points=[(2.0, -0.5), (1.0, 1.0)])
    odometry(link, 100.6)
    assert np.array(on_map(dot_of(scanner))) == near(wanted)


def test_a_configured_sensor_position_overrides_the_frames_for_a_scan(link, robot):
    robot.set_odometry_topic(link, "/odom", 0, type="geometry_msgs/PoseStamped")
    robot.set_tf(link)
    scanner = robot.add_module("LaserScanner", link, "/scan", 0.3, 0.0, 180.0)
    send_transforms(
        link, transform("base_link", "laser", 9.0, 9.0, 1.0, 0), static=True
    )
    for seconds in (100.0, 100.1):
        odometry(link, seconds, "map")
    link.publish("/scan", scan([(1.0, 0.0)], 100.05))
    odometry(link, 101.0, "map")
    (found,) = on_map(dot_of(scanner))
    (wanted,) = seen_from(0.05, points=[(-0.7, 0.0)])
    assert found == pytest.approx(wanted, abs=0.002)


def test_clouds_and_sonar_cones_stay_where_they_were_measured(link, robot):
    robot.set_odometry_topic(link, "/odom", 0, type="geometry_msgs/PoseStamped")
    cone = robot.add_module("Range", link, "/sonar")
    points = robot.add_module("PointCloud", link, "/points")
    for seconds in (100.0, 100.1):
        odometry(link, seconds)
    header = {"stamp": stamp(100.05), "frame_id": "sensor"}
    link.publish("/sonar", {**sonar(1.0), "header": header})
    link.publish("/points", {**cloud([[2.0, 0.0, 0.0]]), "header": header})
    odometry(link, 101.0)
    tip, point = seen_from(0.05, points=[(1.0, 0.0)])[0], on_map(points.dots[0])[0]
    assert to_root(cone.cone).apply(1.0, 0.0) == pytest.approx(tip, abs=1e-6)
    (wanted,) = seen_from(0.05, points=[(2.0, 0.0)])
    assert point == pytest.approx(wanted, abs=0.002)


def test_a_removed_module_has_no_listener_on_the_robot(link, scanner, robot):
    odometry(link, 100.0)
    link.publish("/scan", scan(WALL, 100.2))
    robot.remove_module(scanner)
    assert robot.pose_source._listeners == {}
    odometry(link, 100.3)
