"""Clouds of points, drawn from above."""

import base64
import json
import math

import numpy as np
import pytest
from module_fakes import dots, header, pose, to_root

from webmap.features.layers.point_cloud import PointCloud2Msg
from webmap.ros.rosbridge.events import Publish

FLOAT32, FLOAT64, UINT8 = 7, 8, 2


def cloud(points, *, dtype="<f4", pad=0, rows=1, row_pad=0, ros2=False, **extra):
    """Return a cloud from rows of x, y, z and optionally an intensity."""
    points = np.asarray(points, dtype)
    points = points.reshape(-1, points.shape[-1] if points.size else 3)
    names = ["x", "y", "z", "intensity"][: points.shape[1]]
    size = points.dtype.itemsize
    kind = FLOAT32 if size == 4 else FLOAT64
    step = size * len(names) + pad
    raw = np.full((len(points), step), 0xEE, np.uint8)
    raw[:, : size * len(names)] = points.view(np.uint8)
    width = len(points) // rows
    raw = raw.reshape(rows, width * step)
    raw = np.pad(raw, ((0, 0), (0, row_pad)))
    fields = [
        {"name": name, "offset": i * size, "datatype": kind, "count": 1}
        for i, name in enumerate(names)
    ]
    return {
        "header": header("laser", ros2=ros2),
        "height": rows,
        "width": width,
        "fields": fields,
        "is_bigendian": dtype.startswith(">"),
        "point_step": step,
        "row_step": width * step + row_pad,
        "data": base64.b64encode(raw.tobytes()).decode(),
        "is_dense": False,
        **extra,
    }


def on_map(path) -> list[tuple[float, float]]:
    place = to_root(path)
    return sorted(place.apply(x, y) for x, y in dots(path))


def near(points):
    return [pytest.approx(point, abs=2e-3) for point in sorted(points)]


POINTS = [[1.0, 0.0, 0.1], [2.5, -3.0, 0.2], [-4.0, 5.5, 0.3], [0.25, 0.75, 1.9]]
FLAT = [(x, y) for x, y, _ in POINTS]


@pytest.mark.parametrize("ros2", [False, True])
@pytest.mark.parametrize(
    "layout",
    [{}, {"pad": 5}, {"rows": 2, "row_pad": 7}, {"dtype": ">f4"}, {"dtype": "<f8"}],
)
def test_every_point_is_a_dot_at_its_position(link, robot, layout, ros2):
    module = robot.add_module("PointCloud", link, "/points")
    link.publish("/points", cloud(POINTS, ros2=ros2, **layout))
    (path,) = module.dots
    assert on_map(path) == near(FLAT)
    assert "dot" in path.classes
    assert "pointcloud" in module.svg.classes


def test_a_single_row_needs_no_row_step(link, robot):
    module = robot.add_module("PointCloud", link, "/points")
    link.publish("/points", cloud(POINTS, pad=5, row_step=0))
    (path,) = module.dots
    assert on_map(path) == near(FLAT)
    link.publish("/points", cloud(POINTS, rows=2, row_step=0))
    (problem,) = robot.problems.values()
    assert "does not fit into rows of 0 bytes" in problem


def test_point_data_may_be_bytes_in_cbor_or_a_list_of_numbers(link, robot):
    module = robot.add_module("PointCloud", link, "/points")
    message = cloud(POINTS)
    raw = base64.b64decode(message["data"])
    message["data"] = raw
    link.publish("/points", message, cbor=True)
    assert on_map(module.dots[0]) == near(FLAT)
    message = cloud(POINTS[:2])
    message["data"] = list(base64.b64decode(message["data"]))
    link.publish("/points", message)
    assert on_map(module.dots[0]) == near(FLAT[:2])


def test_a_cloud_is_placed_by_the_sensor_on_the_robot(link, robot):
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
    module = robot.add_module("PointCloud", link, "/points", 0.5, 0.0, 90.0)
    link.publish("/odom", {"header": header(), "pose": pose(10, 20, math.pi / 2)})
    link.publish("/points", cloud([[1.0, 0.0, 0.0]]))
    # Half a metre ahead of a robot that looks north, and a metre to the west.
    assert on_map(module.dots[0]) == near([(9, 20.5)])


def test_a_cloud_in_the_map_frame_stays_in_place_and_is_precise_far_away(link, robot):
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
    module = robot.add_module("PointCloud", link, "/points", frame="map")
    far = [[50_000.125, -70_000.25, 0], [50_001.5, -70_002.0, 0]]
    link.publish("/points", cloud(far, dtype="<f8"))
    link.publish("/odom", {"header": header(), "pose": pose(3, 4, 1.0)})
    assert on_map(module.dots[0]) == near([tuple(point[:2]) for point in far])


def test_only_points_between_z_min_and_z_max_are_drawn(link, robot):
    module = robot.add_module("PointCloud", link, "/points", z_min=0.15, z_max=1.0)
    link.publish("/points", cloud(POINTS))
    assert on_map(module.dots[0]) == near(FLAT[1:3])


def test_non_finite_and_very_far_points_are_not_drawn(link, robot):
    module = robot.add_module("PointCloud", link, "/points")
    nowhere = [[math.nan, 0, 0], [0, math.inf, 0], [1, 1, math.nan], [1e30, 0, 0]]
    link.publish("/points", cloud([*POINTS, *nowhere]))
    assert on_map(module.dots[0]) == near(FLAT)
    link.publish("/points", cloud(nowhere))
    assert len(dots(module.dots[0])) == 0
    link.publish("/points", cloud([]))
    assert robot.problems == {}


def test_a_cloud_without_a_z_field_is_drawn_completely(link, robot):
    module = robot.add_module("PointCloud", link, "/points", z_min=0.5)
    message = cloud(POINTS)
    del message["fields"][2]
    link.publish("/points", message)
    assert on_map(module.dots[0]) == near(FLAT)


def test_points_above_each_other_in_a_cell_are_one_dot(link, robot):
    module = robot.add_module("PointCloud", link, "/points", cell=0.1)
    wall = [
        [2.0, 0.1 * i + 0.05, 0.01 * height] for i in range(20) for height in range(50)
    ]
    link.publish("/points", cloud(wall))
    assert len(dots(module.dots[0])) == 20
    every = robot.add_module("PointCloud", link, "/points", cell=0, max_points=600)
    link.publish("/points", cloud(wall))
    assert len(dots(every.dots[0])) == 600


@pytest.mark.parametrize("by", ["z", "intensity"])
def test_points_are_coloured_by_the_chosen_field(link, robot, by):
    module = robot.add_module("PointCloud", link, "/points", colour_by=by)
    values = [[float(i), 0.0, 0.0, 10.0 * i] for i in range(8)]
    if by == "z":
        values = [[x, y, x] for x, y, *_ in values]
    link.publish("/points", cloud(values))
    assert [on_map(path) for path in module.dots] == [near([(i, 0)]) for i in range(8)]
    assert [f"band-{i}" in path.classes for i, path in enumerate(module.dots)]
    bounded = robot.add_module(
        "PointCloud", link, "/points", colour_by=by, low=1e3, high=2e3
    )
    link.publish("/points", cloud(values))
    assert len(dots(bounded.dots[0])) == 8


BAD = {
    "came with 48 bytes": cloud(POINTS, height=2),
    "does not fit into rows": cloud(POINTS, width=5),
    "of 0 bytes does not fit": cloud(POINTS, point_step=0),
    "-1 x 1 points, expected 0 or more": cloud(POINTS, width=-1),
    "points, expected at most": cloud(POINTS, width=2**31, height=2**31),
    "no field 'x'; they have none": cloud(POINTS, fields=[]),
    "do not fit into points of 4 bytes": cloud(POINTS, point_step=4),
    "datatypes are 1 to 8": cloud(
        POINTS, fields=[{"name": "x", "offset": 0, "datatype": 9, "count": 1}]
    ),
    "at byte -4": cloud(
        POINTS, fields=[{"name": "x", "offset": -4, "datatype": 7, "count": 1}]
    ),
    "expected an array of numbers": cloud(POINTS, data={"a": 1}),
    "base64": cloud(POINTS, data="abc"),
}


@pytest.mark.parametrize("why", BAD)
def test_a_cloud_with_wrong_sizes_is_refused_and_the_last_cloud_stays(link, robot, why):
    module = robot.add_module("PointCloud", link, "/points")
    link.publish("/points", cloud(POINTS))
    link.publish("/points", BAD[why])
    assert on_map(module.dots[0]) == near(FLAT)
    (problem,) = robot.problems.values()
    assert why in problem


def test_a_missing_colour_field_is_a_problem_with_its_name(link, robot):
    robot.add_module("PointCloud", link, "/points", colour_by="rgb")
    link.publish("/points", cloud(POINTS))
    (problem,) = robot.problems.values()
    assert problem == "/points: points have no field 'rgb'; they have 'x', 'y', 'z'"


@pytest.mark.parametrize(
    "options",
    [{"z_min": 2, "z_max": 1}, {"cell": -1}, {"max_points": 0}, {"z_min": math.nan}],
)
def test_invalid_cloud_options_are_refused(link, robot, options):
    with pytest.raises(ValueError, match="got"):
        robot.add_module("PointCloud", link, "/points", **options)


@pytest.mark.parametrize("rows", [1, 4])
def test_the_digest_of_a_large_cloud_is_thinned_evenly(link, robot, monkeypatch, rows):
    monkeypatch.setattr("webmap.features.layers.point_cloud.MOST", 25)
    points = [[x, y, 0.0] for x in range(10) for y in range(12)]
    text = json.dumps(
        {
            "op": "publish",
            "topic": "/points",
            "msg": {**cloud(points, rows=rows, row_pad=3), "height": rows},
        }
    )
    whole = Publish("/points", text.encode()).decode(PointCloud2Msg)
    less = whole.digest()
    assert (less.height, less.width) == (1, 24)
    found = zip(*less.columns("x", "y"), strict=True)
    assert list(found) == [(x, y) for x, y, _ in points[::5]]
    assert whole.thinned(120) is whole
