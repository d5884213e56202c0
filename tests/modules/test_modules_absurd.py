"""Numbers that are finite and absurd: refused in words, before a browser sees them."""

import warnings

import numpy as np
import pytest
from module_fakes import header, pose
from test_modules_grid import CORNERS, grid
from test_modules_markers import CUBE, SPHERES, STRIP, marker
from test_modules_poses import ZEROS
from test_modules_robot import scan
from test_modules_ways import path

from webmap.modules.robot.laser_scanner import scan_points

FAR = 1e300


@pytest.mark.parametrize(
    ("module", "message", "said"),
    [
        ("Path", path([(0, 0), (FAR, 1)]), "got (1e+300, 1) as point 1 of 2"),
        (
            "PoseStamped",
            {"header": header(), "pose": pose(0, -FAR)},
            "a pose must be within 1e+07 m of the origin, got (0, -1e+300)",
        ),
        (
            "PoseArray",
            {"header": header(), "poses": [pose(1.1e7, 0)]},
            "a pose must be within 1e+07 m of the origin, got (1.1e+07, 0)",
        ),
        (
            "Polygon",
            {
                "header": header(),
                "polygon": {"points": [{"x": 0, "y": 0}, {"x": 0, "y": 1e38}]},
            },
            "a polygon must be within 1e+07 m of the origin",
        ),
    ],
)
def test_what_a_robot_has_beyond_the_size_of_a_planet_is_refused(
    link, robot, module, message, said
):
    robot.add_module(module, link, "/topic")
    link.say("/topic", message)
    (problem,) = robot.problems.values()
    assert said in problem


@pytest.mark.parametrize(
    ("message", "said"),
    [
        (marker(CUBE, at=(FAR, 0, 0)), "a pose must be within 1e+07 m"),
        (marker(SPHERES, [(0, 0)], at=(FAR, 0, 0)), "a pose must be within 1e+07 m"),
        (marker(STRIP, [(0, 0), (0, FAR)]), "points must be within 1e+07 m"),
    ],
)
def test_markers_beyond_the_size_of_a_planet_are_refused(
    map, link, channel, message, said
):
    layer = map.add_module("Markers", link, "/markers").layer
    link.say("/markers", {"markers": [message]})
    assert not layer.svg.children
    (error,) = channel.errors
    assert said in error


@pytest.mark.parametrize(
    ("message", "said"),
    [
        (grid(CORNERS, 1e308), "sides of 1e+07 m at the most, got 3 x 2 cells of 1e+"),
        (grid(CORNERS, 3.4e6), "3 x 2 cells of 3.4e+06 m"),
        (grid(CORNERS, origin=pose(FAR, 0)), "within 1e+07 m of the origin"),
    ],
)
def test_a_grid_beyond_the_size_of_a_planet_is_refused(
    map, link, channel, message, said
):
    map.add_module("OccupancyGrid", link, "/map")
    link.say("/map", message)
    (error,) = channel.errors
    assert said in error


@pytest.mark.parametrize("low", [-1e39, 0.1])
def test_limits_that_single_precision_cannot_hold_are_no_limits(low):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        points, _ = scan_points(scan([1.0, 2.0, 1e30], low=low, high=1e39))
        assert len(scan_points(scan([1.0], low=1e39, high=1e39))[0]) == 0
    assert np.allclose(points, [[1, 0], [0, 2]])


def test_a_pose_that_turns_nowhere_is_left_out_and_the_others_are_drawn(link, robot):
    module = robot.add_module("PoseArray", link, "/particles")
    nowhere = {**pose(1, 2), "orientation": ZEROS}
    poses = [pose(3, 4), nowhere, pose(5, 6), nowhere]
    link.say("/particles", {"header": header(), "poses": poses})
    assert [(each.x, each.y) for each in module.poses] == [(3, 4), (5, 6)]
    (problem,) = robot.problems.values()
    assert "2 of 4 poses have a quaternion of zeros" in problem
    link.say("/particles", {"header": header(), "poses": poses[:1]})
    assert not robot.problems
