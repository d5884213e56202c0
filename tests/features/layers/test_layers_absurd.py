"""Finite but absurd numbers are refused with a reason and never sent to a browser."""

import warnings

import numpy as np
import pytest
from module_fakes import header, pose
from test_layers_cloud import cloud
from test_layers_fix import DATUM, fix
from test_layers_frames import send_transforms, transform
from test_layers_grid import CORNERS, grid
from test_layers_markers import (
    ARROW,
    CUBE,
    CUBES,
    LINES,
    POINTS,
    SPHERE,
    SPHERES,
    STRIP,
    TEXT,
    marker,
)
from test_layers_poses import covariance, doubtful, polygon, sonar
from test_layers_robot import scan
from test_layers_ways import path

from equipment.ray_points import points_of
from webmap.features.layers.laser_scanner import scan_rays

FAR = 1e300
ENDLESS = {"stamp": {"secs": 10**400, "nsecs": 0}, "frame_id": "map"}
SCAN = {
    "header": header("laser"),
    "angle_min": 0.0,
    "angle_increment": 0.1,
    "range_min": 0.1,
    "range_max": 10.0,
    "ranges": [1.0, 2.0],
}
LOG = {"level": 8, "name": "/node", "msg": "oh", "file": "", "function": "", "line": 1}
X, Y = ({"name": n, "offset": 0, "datatype": 7, "count": 1} for n in "xy")


def high(z: float) -> dict:
    """Return a pose with a height."""
    at = pose(0, 0)
    return {
        "header": header(),
        "pose": {**at, "position": {"x": 0.0, "y": 0.0, "z": z}},
    }


@pytest.mark.parametrize(
    ("module", "message", "expected"),
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
        (
            "Polygon",
            polygon([]) | {"polygon": {"points": [{"x": 0, "y": 0, "z": FAR}]}},
            "points must be within 1e+07 m of the plane, got a height of 1e+300",
        ),
        ("Path", path([]) | {"poses": [high(2e7)]}, "got a height of 2e+07"),
        ("PoseStamped", high(-FAR), "of the plane, got a height of -1e+300"),
        (
            "PoseWithCovariance",
            doubtful(pose(0, 0), covariance(FAR, 1)),
            "the covariance (1e+300, 0; 0, 1) in the plane has a spread of more than",
        ),
        (
            "PoseWithCovariance",
            doubtful(pose(0, 0), covariance(1.7e308, 1.7e308)),
            "has a spread of more than 1e+07 m",
        ),
        (
            "PoseWithCovariance",
            doubtful(pose(0, 0), covariance(1, 9e13)),
            "an ellipse must be within 1e+07 m, got a half axis of 1.89737e+07 m",
        ),
        (
            "Range",
            sonar(1e30, high=3.4e38),
            "a cone is at most 1e+07 m long, got a max_range of 3.4e+38 m with",
        ),
        (
            "LaserScanner",
            {**SCAN, "angle_increment": FAR},
            "rays must be within 1000 radians, got an angle_min of 0 and an "
            "angle_increment of 1e+300 for 2 rays",
        ),
        ("LaserScanner", {**SCAN, "angle_min": 1.7e308}, "an angle_min of 1.7e+308"),
        (
            "PointCloud",
            cloud([[1, 2, 3]]) | {"fields": [{**X, "offset": 10**30}, Y]},
            "the fields x, y do not fit into points of 12 bytes",
        ),
        *(
            (name, {**message, "header": ENDLESS}, "seconds of hundreds of digits")
            for name, message in {
                "LaserScanner": SCAN,
                "Path": path([(0, 0)]),
                "PoseArray": {"poses": [pose(0, 0)]},
                "Range": sonar(1.0),
                "Rosout": LOG,
            }.items()
        ),
    ],
)
def test_robot_messages_with_absurdly_large_values_are_refused(
    link, robot, module, message, expected
):
    robot.add_module(module, link, "/topic")
    link.publish("/topic", message)
    (problem,) = robot.problems.values()
    assert expected in problem


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        (marker(CUBE, at=(FAR, 0, 0)), "a pose must be within 1e+07 m"),
        (marker(SPHERES, [(0, 0)], at=(FAR, 0, 0)), "a pose must be within 1e+07 m"),
        (marker(STRIP, [(0, 0), (0, FAR)]), "points must be within 1e+07 m"),
        (marker(STRIP, [(0, 0, FAR), (0, 1)]), "got a height of 1e+300"),
        (marker(CUBE, pose=high(FAR)["pose"]), "got a height of 1e+300"),
        (marker(TEXT, pose=high(FAR)["pose"]), "got a height of 1e+300"),
        (marker(CUBE, scale=(1, FAR, 1)), "scale.y must be at most 1e+07 m, got 1"),
        (marker(SPHERE, scale=(2e7, 1, 1)), "scale.x must be at most 1e+07 m"),
        (marker(ARROW, scale=(FAR, 1, 1)), "scale.x must be at most 1e+07 m"),
        (marker(TEXT, text="a", scale=(1, 1, FAR)), "scale.z must be at most 1e+07 m"),
        *(
            (
                marker(type, [(0, 0), (1, 1)], scale=(FAR, 1, 1)),
                "scale.x must be at most 1",
            )
            for type in (STRIP, LINES, CUBES, SPHERES, POINTS)
        ),
        (marker(CUBE, lifetime={"secs": 10**400}), "seconds of hundreds of digits"),
        (marker(CUBE, header=ENDLESS), "seconds of hundreds of digits"),
    ],
)
def test_markers_with_absurdly_large_values_are_refused(
    map, link, channel, message, expected
):
    layer = map.add_module("Markers", link, "/markers").layer
    link.publish("/markers", {"markers": [message]})
    assert not layer.svg.children
    (error,) = channel.errors
    assert expected in error


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        (grid(CORNERS, 1e308), "sides of at most 1e+07 m, got 3 x 2 cells of 1e+"),
        (grid(CORNERS, 3.4e6), "3 x 2 cells of 3.4e+06 m"),
        (grid(CORNERS, origin=pose(FAR, 0)), "within 1e+07 m of the origin"),
    ],
)
def test_a_grid_with_absurdly_large_values_is_refused(
    map, link, channel, message, expected
):
    map.add_module("OccupancyGrid", link, "/map")
    link.publish("/map", message)
    (error,) = channel.errors
    assert expected in error


@pytest.mark.parametrize("low", [-1e39, 0.1])
def test_range_limits_beyond_single_precision_are_applied_without_warnings(low):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        points = points_of(scan_rays(scan([1.0, 2.0, 1e30], low=low, high=1e39)))
        assert len(points_of(scan_rays(scan([1.0], low=1e39, high=1e39)))) == 0
    assert np.allclose(points, [[1, 0], [0, 2]])


def test_a_tilted_marker_with_an_absurd_height_is_refused(map, link, channel):
    layer = map.add_module("Markers", link, "/markers").layer
    on_its_side = {"x": 0, "y": 0.6, "z": 0, "w": 0.8}
    for number, type in enumerate((CUBE, SPHERE, CUBES, SPHERES)):
        turned = {**pose(0, 0), "orientation": on_its_side}
        tall = marker(type, [(0, 0)], pose=turned, scale=(1, 1, FAR), id=number)
        link.publish("/markers", {"markers": [tall]})
        (problem,) = layer.problems.values()
        assert f"marker {number} of 'test': scale.z must be at most 1e+07 m" in problem
    assert not layer.svg.children


def test_a_fix_with_an_absurd_deviation_is_drawn_without_its_circle(link, robot):
    module = robot.add_module("NavSatFix", link, datum=DATUM)
    link.publish("/fix", fix(50.0, 14.0, spread=[4.0, 0, 0, 0, 4.0, 0, 0, 0, 9.0]))
    assert float(module.covariance.get("r")) == 2.0
    link.publish("/fix", fix(50.001, 14.0, spread=[FAR, 0, 0, 0, 4.0, 0, 0, 0, 9.0]))
    assert float(module.covariance.get("r")) == 0.0
    assert module.position == pytest.approx((0, 111.229), abs=0.01)
    (problem,) = robot.problems.values()
    assert (
        "the standard deviation of a fix must be at most 1e+07 m, got 1e+150 m; its"
        in problem
    )
    link.publish("/fix", fix(50.001, 14.0))
    assert not robot.problems


def test_a_sonar_with_a_huge_max_range_is_accepted(link, robot):
    module = robot.add_module("Range", link, "/sonar")
    link.publish("/sonar", sonar(1.5, high=3.4e38))
    assert module.distance == 1.5
    assert not robot.problems


def test_a_refused_path_keeps_the_last_path(link, robot):
    module = robot.add_module("Path", link, "/plan")
    link.publish("/plan", path([(0, 0), (1, 0)]))
    link.publish("/plan", path([(0, 0), (5, 0)]) | {"header": ENDLESS})
    assert module.length == 1.0
    link.publish("/plan", path([]) | {"poses": [high(0), high(FAR)]})
    assert module.length == 1.0


@pytest.mark.parametrize("limits", [{}, {"low": 0.0, "high": 1.0}])
def test_points_with_absurd_intensities_are_drawn_in_the_outermost_colours(
    link, robot, limits
):
    module = robot.add_module(
        "PointCloud", link, "/points", colour_by="intensity", **limits
    )
    points = [[at, 0, 0, value] for at, value in enumerate((-1.7e308, 0.0, 1.7e308))]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        link.publish("/points", cloud(points, dtype="<f8"))
    counts = [len(band._dots.points) // 4 for band in module.dots]
    assert counts == ([2, 0, 0, 0, 0, 0, 0, 1] if limits else [3, *[0] * 7])
    assert not robot.problems


def test_a_transform_with_an_absurd_translation_is_ignored_and_logged(
    link, robot, caplog
):
    robot.set_tf(link)
    send_transforms(link, transform("map", "base_link", 3.0, 0.0, 0.0, 100))
    assert robot.position.x == 3.0
    send_transforms(link, transform("map", "base_link", FAR, 0.0, 0.0, 101))
    assert robot.position.x == 3.0
    assert "a frame must be within 1e+07 m, got (1e+300, 0, 0)" in caplog.text
