"""Published points and the cells of grids are drawn at their places."""

import math
import random

import numpy as np
import pytest
from module_fakes import header, matrix_of, numbers, pose, to_root
from test_layers_frames import send_transforms
from test_layers_tilted import MAP, SLOPE, mount, sensed
from tilted_frames import frame, transformed

from webmap.features.layers.grid_cells import rows_of

FAR = 1e300
ENDLESS = {"stamp": {"secs": 10**400, "nsecs": 0}, "frame_id": "map"}


@pytest.fixture
def robot(robot, link):
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
    link.publish("/odom", {"header": header(), "pose": pose(4, -2, 0.7)})
    return robot


def at(x, y, z=0.0) -> dict:
    return {"x": x, "y": y, "z": z}


def point(x, y, z=0.0, *, frame="map", ros2=False) -> dict:
    return {"header": header(frame, ros2=ros2), "point": at(x, y, z)}


def spot(module) -> tuple[float, float]:
    """Return where a point is drawn on the map."""
    return to_root(module.spot).apply(0, 0)


@pytest.mark.parametrize("ros2", [False, True])
def test_a_point_keeps_its_position_on_the_map_while_the_robot_moves(link, robot, ros2):
    module = robot.add_module("PointStamped", link, "/clicked_point", name="far")
    assert list(module.svg.classes) == ["pointstamped", "far"]
    assert module.svg.get("visibility") == "hidden", "there is no point yet"
    link.publish("/clicked_point", point(-3, 40, ros2=ros2))
    assert module.svg.get("visibility") is None
    assert spot(module) == pytest.approx((-3, 40), abs=2e-3)
    link.publish("/odom", {"header": header(), "pose": pose(-3, 40, 3.0)})
    assert spot(module) == pytest.approx((-3, 40), abs=2e-3)
    link.publish("/clicked_point", point(1, 1, ros2=ros2))
    assert spot(module) == pytest.approx((1, 1), abs=2e-3)


def test_a_point_in_the_base_frame_is_placed_at_its_stamp(link, robot):
    robot.set_tf(link)
    module = robot.add_module("PointStamped", link, "/lookahead_point", frame="robot")
    turned = (0.0, 0.0, math.pi / 2)
    for seconds, x in ((2.9, 4.9), (3.1, 5.1)):
        send_transforms(link, frame("map", "base_link", (x, 0.0, 0.0), turned, seconds))
    link.publish("/lookahead_point", point(1.0, 0.5, frame="base_link"))
    assert spot(module) == pytest.approx((4.5, 1.0), abs=2e-3)
    assert robot.problems == {}


def test_without_frames_a_point_in_the_base_frame_is_placed_on_the_robot(link, robot):
    module = robot.add_module("PointStamped", link, "/lookahead_point", frame="robot")
    link.publish("/lookahead_point", point(1, 0, frame="base_link"))
    wanted = (4 + math.cos(0.7), -2 + math.sin(0.7))
    assert spot(module) == pytest.approx(wanted, abs=2e-3)


def test_a_point_of_a_tilted_sensor_is_rotated_in_3d_and_projected(link, robot):
    robot.set_tf(link)
    send_transforms(link, MAP, SLOPE)
    mounted = mount(link, (0.3, 0.1, 0.8), (0.7, -0.9, 2.5))
    module = robot.add_module("PointStamped", link, "/seen")
    link.publish("/seen", sensed({"point": at(1.0, 0.2, 2.0)}))
    ((x, y, _),) = transformed([[1.0, 0.2, 2.0]], MAP, SLOPE, mounted)
    assert spot(module) == pytest.approx((x, y), abs=3e-3)


def test_a_point_with_a_nan_height_is_drawn_in_the_plane(link, robot):
    module = robot.add_module("PointStamped", link, "/seen")
    link.publish("/seen", point(1, 2, math.nan))
    assert spot(module) == pytest.approx((1, 2), abs=2e-3)
    assert robot.problems == {}


@pytest.mark.parametrize(
    ("wrong", "expected"),
    [
        (point(math.nan, 2), "a point must be of finite numbers, got (nan, 2.0)"),
        (point(1, math.inf), "a point must be of finite numbers, got (1.0, "),
        (point(0, -FAR), "within 1e+07 m of the origin, got (0, -1e+300)"),
        (point(0, 0, 2e7), "within 1e+07 m of the plane, got a height of 2e+07"),
        (point(5, 5) | {"header": ENDLESS}, "seconds of hundreds of digits"),
    ],
)
def test_an_invalid_point_is_refused_and_the_last_point_stays(
    link, robot, wrong, expected
):
    module = robot.add_module("PointStamped", link, "/seen")
    link.publish("/seen", point(1, 2))
    before = matrix_of(module.spot)
    link.publish("/seen", wrong)
    assert matrix_of(module.spot) == before
    (problem,) = robot.problems.values()
    assert expected in problem
    link.publish("/seen", point(3, 4))
    assert robot.problems == {}


@pytest.mark.parametrize("radius", [0, -1, math.inf, math.nan])
def test_an_invalid_radius_is_refused(link, robot, radius):
    with pytest.raises(ValueError, match="radius must be metres above 0"):
        robot.add_module("PointStamped", link, "/seen", radius=radius)


def cells(middles, width=0.5, height=0.25, *, ros2=False) -> dict:
    return {
        "header": header(ros2=ros2),
        "cell_width": width,
        "cell_height": height,
        "cells": [at(*middle) for middle in middles],
    }


def boxes(module) -> list[list[tuple[float, float]]]:
    """Return the corners on the map of each drawn rectangle."""
    place = to_root(module.drawn)
    found = []
    for text in (module.drawn.get("d") or "").split("z")[:-1]:
        x, y, *steps = numbers(text)
        corners = [(x, y)]
        for along, aside in zip(steps[::2], steps[1::2], strict=True):
            x, y = x + along, y + aside
            corners.append((x, y))
        found.append([place.apply(*corner) for corner in corners])
    return found


def box(x, y, width, height) -> list:
    """Return the corners around a centre, in the form of :func:`boxes`."""
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return [
        pytest.approx((x + i * width / 2, y + j * height / 2), abs=2e-3)
        for i, j in corners
    ]


@pytest.mark.parametrize("ros2", [False, True])
def test_a_cell_is_a_box_centred_on_its_point_that_stays_on_the_map(link, robot, ros2):
    module = robot.add_module("GridCells", link, "/cells", name="frontiers")
    assert list(module.svg.classes) == ["gridcells", "frontiers"]
    link.publish("/cells", cells([(1, 2), (4, -1)], ros2=ros2))
    wanted = [box(4, -1, 0.5, 0.25), box(1, 2, 0.5, 0.25)]
    assert boxes(module) == wanted
    link.publish("/odom", {"header": header(), "pose": pose(-40, 2, 3.0)})
    assert boxes(module) == wanted
    link.publish("/cells", cells([], 0, 0))
    assert boxes(module) == []


def test_cells_that_touch_along_x_are_one_box_in_any_order(link, robot):
    module = robot.add_module("GridCells", link, "/cells")
    side = float(np.float32(0.05))
    middles = [(7 + 0.05 * i, 3 + 0.05 * j) for i in range(40) for j in range(3)]
    middles.remove((7 + 0.05 * 20, 3 + 0.05 * 1))
    random.Random(1).shuffle(middles)
    link.publish("/cells", cells(middles, side, side))
    assert boxes(module) == [
        box(7.975, 3.0, 2.0, 0.05),
        box(7.475, 3.05, 1.0, 0.05),
        box(8.5, 3.05, 0.95, 0.05),
        box(7.975, 3.1, 2.0, 0.05),
    ]


def test_rows_of_slightly_shifted_cells_stay_near_the_cells():
    step = 0.1 * 1.0005  # far within the tolerance; many are not
    middles = np.array([(number * step, 0.0, 0.0) for number in range(200)])
    rows = rows_of(middles, 0.1, 0.1)
    assert sum(rows.lengths) == 200
    assert len(rows.lengths) < 20
    drawn = [
        first[0] + number * 0.1
        for first, length in zip(rows.first, rows.lengths, strict=True)
        for number in range(length)
    ]
    assert np.abs(np.array(drawn) - middles[:, 0]).max() < 0.002


def test_cells_of_a_tilted_sensor_are_rotated_in_3d_and_projected(link, robot):
    robot.set_tf(link)
    send_transforms(link, MAP, SLOPE)
    mounted = mount(link, (0.3, 0.1, 0.8), (0.7, -0.9, 2.5))
    module = robot.add_module("GridCells", link, "/cells")
    link.publish("/cells", sensed(cells([(1.0, 0.2, 2.0), (1.5, 0.2, 2.0)])))
    low, high = 0.075, 0.325
    corners = [[0.75, low], [1.75, low], [1.75, high], [0.75, high]]
    there = transformed([[*corner, 2.0] for corner in corners], MAP, SLOPE, mounted)
    (drawn,) = boxes(module)
    assert np.array(drawn) == pytest.approx(there[:, :2], abs=3e-3)


def test_cells_beyond_max_cells_are_thinned_with_a_problem(link, robot):
    module = robot.add_module("GridCells", link, "/cells", max_cells=10)
    link.publish("/cells", cells([(i, 0) for i in range(25)]))
    drawn = sorted(corners[0][0] for corners in boxes(module))
    assert len(drawn) == 10
    assert drawn[0] == pytest.approx(-0.25, abs=2e-3)
    assert drawn[-1] == pytest.approx(23.75, abs=2e-3)
    assert max(np.diff(drawn)) < 5, "the drawn points are evenly spaced"
    (problem,) = robot.problems.values()
    assert "more than 10 cells: only that many are drawn" in problem
    link.publish("/cells", cells([(i, 0) for i in range(10)]))
    assert len(boxes(module)) == 10
    assert robot.problems == {}


@pytest.mark.parametrize(
    ("wrong", "expected"),
    [
        (cells([(1, 1), (math.nan, 1)]), "finite numbers, got (nan, 1.0) as point 1"),
        (cells([(1, math.inf)]), "cells must be of finite numbers"),
        (cells([(FAR, 0)]), "within 1e+07 m of the origin, got (1e+300, 0)"),
        (cells([(0, 0, FAR)]), "got a height of 1e+300"),
        (cells([(1, 1)], width=0), "cell_width must be from 0.0001 to 1e+07 m, got 0"),
        (cells([(1, 1)], height=-1), "cell_height must be from 0.0001 to 1e+07 m"),
        (cells([(1, 1)], height=None), "got nan"),
        (cells([(1, 1)], width=FAR), "got 1e+300"),
        (
            cells([]) | {"cells": [at(0, 0)] * 100_001},
            "100001 cells; the limit is 100000",
        ),
        (cells([(5, 5)]) | {"header": ENDLESS}, "seconds of hundreds of digits"),
    ],
)
def test_invalid_cells_are_refused_and_the_last_cells_stay(
    link, robot, wrong, expected
):
    module = robot.add_module("GridCells", link, "/cells")
    link.publish("/cells", cells([(1, 2)]))
    before = module.drawn.get("d")
    link.publish("/cells", wrong)
    assert module.drawn.get("d") == before
    (problem,) = robot.problems.values()
    assert expected in problem
    link.publish("/cells", cells([]))
    assert robot.problems == {}


def test_max_cells_of_zero_is_refused(link, robot):
    with pytest.raises(ValueError, match="max_cells must be at least 1, got 0"):
        robot.add_module("GridCells", link, "/cells", max_cells=0)
