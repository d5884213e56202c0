import math

import numpy as np
import pytest
from simulated import room

from webmap.base.geometry import Pose
from webmap.sim.maps import Obstacles, chebyshev_distance, dilate
from webmap.sim.scanner import Scanner, ScannerOptions, cast_rays


def wall_distance(width, height, x, y, angle, thickness=0.05):
    """How far the inner faces of a room are, by geometry."""
    cos, sin = math.cos(angle), math.sin(angle)
    ways = []
    if abs(cos) > 1e-12:
        ways.append(((width - thickness if cos > 0 else thickness) - x) / cos)
    if abs(sin) > 1e-12:
        ways.append(((height - thickness if sin > 0 else thickness) - y) / sin)
    return min(ways)


@pytest.mark.parametrize(
    "pose", [Pose(3.0, 2.0), Pose(1.111, 4.9, 0.7), Pose(8, 1, -2)]
)
def test_scan_ranges_match_the_geometry_of_the_room(pose):
    scanner = Scanner(Obstacles(room(10, 6)), ScannerOptions(range_max=30))
    (ranges,) = scanner.sweep([pose])
    expected = [
        wall_distance(10, 6, pose.x, pose.y, pose.yaw - math.pi + i * math.tau / 360)
        for i in range(360)
    ]
    assert ranges == pytest.approx(expected, abs=1e-4)


def test_no_ray_passes_through_a_thin_box():
    plan = room(10, 6, boxes=[(5.0, 0.0, 5.05, 6.0)])
    scanner = Scanner(Obstacles(plan), ScannerOptions(range_max=30))
    (ranges,) = scanner.sweep([Pose(2.0, 3.0)])
    ahead = ranges[180 - 60 : 180 + 61]
    angles = np.radians(np.arange(-60, 61))
    reach = np.minimum(3.0 / np.cos(angles), 2.95 / np.abs(np.sin(angles) + 1e-12))
    assert ahead == pytest.approx(reach, abs=1e-4)


def test_a_ray_without_an_obstacle_in_range_gives_infinity():
    scanner = Scanner(Obstacles(room(30, 30)), ScannerOptions(range_max=8))
    (ranges,) = scanner.sweep([Pose(15, 15)])
    assert np.isinf(ranges).all()
    assert (ranges > 0).all()


def test_a_ray_that_leaves_the_map_gives_infinity():
    plan = room(4, 4)
    plan.occupancy[:, -1] = 0
    scanner = Scanner(Obstacles(plan), ScannerOptions(range_max=8))
    (ranges,) = scanner.sweep([Pose(2, 2)])
    assert math.isinf(ranges[180])
    assert ranges[0] == pytest.approx(1.95)


def test_an_obstacle_below_the_minimum_range_gives_minus_infinity():
    scanner = Scanner(Obstacles(room(4, 4)), ScannerOptions(range_min=0.5))
    (ranges,) = scanner.sweep([Pose(0.3, 2.0)])
    assert ranges[0] == -math.inf


def test_other_robots_appear_as_circles_in_a_scan():
    scanner = Scanner(Obstacles(room(10, 6)), ScannerOptions())
    (ranges,) = scanner.sweep([Pose(2, 3)], [[(5.0, 3.0, 0.25)]])
    assert ranges[180] == pytest.approx(2.75)
    beside = math.radians(4)
    across = 3 * math.sin(beside)
    expected = 3 * math.cos(beside) - math.sqrt(0.25**2 - across**2)
    assert ranges[184] == pytest.approx(expected, abs=1e-4)
    assert ranges[186] > 5


def test_another_robot_behind_a_wall_is_not_seen():
    plan = room(10, 6, boxes=[(4.0, 0.0, 4.1, 6.0)])
    scanner = Scanner(Obstacles(plan), ScannerOptions())
    (ranges,) = scanner.sweep([Pose(2, 3)], [[(6.0, 3.0, 0.25)]])
    assert ranges[180] == pytest.approx(2.0)


def test_a_sweep_of_many_poses_gives_one_row_per_pose():
    scanner = Scanner(Obstacles(room(10, 6)), ScannerOptions(range_max=30))
    poses = [Pose(2, 2), Pose(7, 4, 1.0), Pose(5, 3, -2.5)]
    together = scanner.sweep(poses)
    for row, pose in zip(together, poses, strict=True):
        assert row == pytest.approx(scanner.sweep([pose])[0])


def test_a_scan_contains_nan_only_with_the_nan_option():
    obstacles = Obstacles(room(10, 6))
    assert not np.isnan(Scanner(obstacles, ScannerOptions()).sweep([Pose(2, 2)])).any()
    noisy = Scanner(obstacles, ScannerOptions(nan=True)).sweep([Pose(2, 2)])
    assert 0 < np.isnan(noisy).mean() < 0.1


def test_rays_along_the_axes_have_correct_lengths():
    obstacles = Obstacles(room(10, 6))
    ways = cast_rays(
        obstacles,
        np.full(4, 3.0),
        np.full(4, 2.0),
        np.array([1.0, 0.0, -1.0, 0.0]),
        np.array([0.0, 1.0, 0.0, -1.0]),
        30.0,
    )
    assert ways == pytest.approx([6.95, 3.95, 2.95, 1.95], abs=1e-6)


def test_chebyshev_distances_count_diagonal_steps_as_one():
    solid = np.zeros((5, 7), bool)
    solid[2, 1] = True
    distance = chebyshev_distance(solid, 10)
    assert distance[2].tolist() == [1, 0, 1, 2, 3, 4, 5]
    assert distance[0, 6] == 5


@pytest.mark.parametrize("radius", [0.0, 0.5, 1.0, 2.5, 40.0])
@pytest.mark.parametrize("part", [0.0, 0.01, 0.1, 1.0])
def test_cells_near_a_solid_one_are_those_within_the_radius(radius, part):
    solid = np.random.default_rng(7).random((17, 29)) < part
    rows, columns = np.indices(solid.shape)
    near = np.zeros_like(solid)
    for row, column in np.argwhere(solid):
        near |= np.hypot(rows - row, columns - column) <= radius
    assert (dilate(solid, radius) == near).all()


def test_a_robot_that_stands_still_costs_no_second_ray(monkeypatch):
    cast = []

    def counted(obstacles, xs, *rest):
        cast.append(len(xs))
        return cast_rays(obstacles, xs, *rest)

    monkeypatch.setattr("webmap.sim.scanner.cast_rays", counted)
    scanner = Scanner(Obstacles(room(10, 6)), ScannerOptions(range_max=30))
    here, there = Pose(3.0, 2.0), Pose(4.0, 2.0, 1.0)
    first = scanner.sweep([here, there])
    again = scanner.sweep([there, here], discs=[[(6.0, 2.0, 0.3)], []])
    assert cast == [720]
    assert (again[1] == first[0]).all()
    assert (again[0] < first[1]).any(), "another robot is in front of the wall"
    assert (scanner.sweep([there])[0] == first[1]).all(), "a robot was kept as a wall"


def test_rays_of_many_poses_are_not_kept_forever(monkeypatch):
    monkeypatch.setattr("webmap.sim.scanner._MOST_KEPT", 1000)
    scanner = Scanner(Obstacles(room(10, 6)), ScannerOptions(range_max=30))
    for number in range(20):
        scanner.sweep([Pose(1.0 + 0.1 * number, 2.0), Pose(2.0, 3.0)])
        assert len(scanner._rays._kept) * 360 <= 1000


def test_a_sweep_from_no_pose_has_no_ranges():
    scanner = Scanner(Obstacles(room(10, 6)), ScannerOptions(range_max=30))
    assert scanner.sweep([]).shape == (0, 360)
