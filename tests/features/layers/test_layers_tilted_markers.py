"""Tilted markers and markers of tilted frames, drawn from above."""

import math

import numpy as np
import pytest
from module_fakes import numbers, to_root
from test_layers_at_stamp import stamp
from test_layers_frames import send_transforms
from test_layers_markers import (
    ARROW,
    CUBE,
    CUBES,
    CYLINDER,
    LINES,
    POINTS,
    SPHERE,
    SPHERES,
    STRIP,
    TEXT,
    TRIANGLES,
    marker,
    publish,
)
from test_layers_tilted import TURNS
from tilted_frames import OPTICAL, OVER, frame, matrix, posed, transformed

BODY = frame("map", "base_link", (3.0, 1.0, 0.2), (0.05, 0.1, 2.0), 100.0)
SIZE = (1.2, 0.5, 0.8)
THERE, SELF = (0.4, -0.3, 2.0), (0.3, -0.2, 1.1)
"""The pose of a marker in its frame."""

CORNERS = [(1.0, 0.2, 2.0), (-0.5, 0.1, 1.0), (0.3, -1.5, 3.0)]


@pytest.fixture(autouse=True)
def no_patience(monkeypatch):
    monkeypatch.setattr("webmap.poses.placing.PROBLEM_DELAY", 0.0)
    monkeypatch.setattr("webmap.poses.frames.GRACE", 0.0)


@pytest.fixture
def layer(map, link):
    return map.add_module("Markers", link, "/markers").layer


@pytest.fixture(params=TURNS.values(), ids=TURNS)
def mounted(request, link, layer) -> dict:
    """Mount a turned sensor on a tilted robot."""
    publish(
        link, marker(CUBE, header={"frame_id": "sensor"})
    )  # the layer needs frames now, so it receives them
    found = frame("base_link", "sensor", (0.3, 0.1, 0.8), request.param)
    send_transforms(link, found, static=True)
    send_transforms(link, BODY)
    return found


def seen(link, layer, type, points=(), *, at=THERE, turns=SELF, **more):
    """Publish a marker in the sensor's frame, and return its drawing."""
    header = {"stamp": stamp(100.0), "frame_id": "sensor"}
    more = {"scale": SIZE, "header": header, "pose": posed(at, turns), **more}
    publish(link, marker(type, points, **more))
    (drawn,) = layer.shapes["test", 1].children
    return drawn


def corners(element, text) -> np.ndarray:
    flat, place = numbers(text), to_root(element)
    pairs = zip(flat[::2], flat[1::2], strict=True)
    return np.array([place.apply(x, y) for x, y in pairs])


def outline(element) -> np.ndarray:
    if element.get("points") is not None:
        return corners(element, element.get("points"))
    rx, ry, place = float(element.get("rx")), float(element.get("ry")), to_root(element)
    turns = np.linspace(0, math.tau, 400)
    return np.array([place.apply(rx * math.cos(a), ry * math.sin(a)) for a in turns])


def whole(mounted) -> tuple[np.ndarray, np.ndarray]:
    """Return the true place and rotation of the marker."""
    own = frame("sensor", "marker", THERE, SELF)
    middle, *axes = transformed([(0, 0, 0), *np.eye(3)], BODY, mounted, own)
    return middle, np.array(axes) - middle


def reach(type, axes, way) -> float:
    """Return how far a solid extends from its centre in a direction of the plane."""
    x, y, z = (axes[:, :2] @ way) * np.array(SIZE) / 2
    if type in (CUBE, CUBES):
        return abs(x) + abs(y) + abs(z)
    if type == CYLINDER:
        return math.hypot(x, y) + abs(z)
    return math.hypot(x, y, z)


WAYS = [np.array([math.cos(a), math.sin(a)]) for a in np.linspace(0, math.tau, 24)]


@pytest.mark.parametrize("type", [CUBE, SPHERE, CYLINDER])
def test_a_tilted_solid_has_its_outline_from_above(link, layer, mounted, type):
    found = outline(seen(link, layer, type))
    middle, axes = whole(mounted)
    for way in WAYS:
        there = middle[:2] @ way + reach(type, axes, way)
        assert (found @ way).max() == pytest.approx(there, abs=0.008)


@pytest.mark.parametrize("type", [CUBES, SPHERES])
def test_each_solid_of_a_tilted_list_has_its_outline_from_above(
    link, layer, mounted, type
):
    path = seen(link, layer, type, CORNERS)
    own = frame("sensor", "marker", THERE, SELF)
    _, axes = whole(mounted)
    shapes = path.get("d").strip("z").split("z")
    for shape, middle in zip(
        shapes, transformed(CORNERS, BODY, mounted, own), strict=True
    ):
        found = corners(path, shape)
        for way in WAYS:
            there = middle[:2] @ way + reach(type, axes, way)
            assert (found @ way).max() == pytest.approx(there, abs=0.015)


@pytest.mark.parametrize("type", [STRIP, LINES, TRIANGLES])
def test_tilted_lines_and_triangles_are_projected_from_above(
    link, layer, mounted, type
):
    points = CORNERS if type != LINES else CORNERS[:2]
    drawn = seen(link, layer, type, points)
    own = frame("sensor", "marker", THERE, SELF)
    there = transformed(points, BODY, mounted, own)[:, :2]
    text = drawn.get("points") or drawn.get("d")
    assert corners(drawn, text) == pytest.approx(there, abs=2e-3)


def test_a_tilted_arrow_is_projected_from_above(link, layer, mounted):
    ends = CORNERS[:2]
    drawn = seen(link, layer, ARROW, ends, scale=(0.05, 0.1, 0.2))
    own = frame("sensor", "marker", THERE, SELF)
    start, end = transformed(ends, BODY, mounted, own)[:, :2]
    found = corners(drawn, drawn.get("points"))
    assert found[3] == pytest.approx(end, abs=2e-3)
    assert (found[0] + found[6]) / 2 == pytest.approx(start, abs=2e-3)


def test_points_of_a_tilted_marker_keep_their_size(link, layer, mounted):
    path = seen(link, layer, POINTS, CORNERS)
    own = frame("sensor", "marker", THERE, SELF)
    for square, there in zip(
        path.get("d").strip("z").split("z"),
        transformed(CORNERS, BODY, mounted, own),
        strict=True,
    ):
        x, y, wide, high, _ = numbers(square)
        assert (wide, high) == SIZE[:2]
        middle = to_root(path).apply(x + wide / 2, y + high / 2)
        assert middle == pytest.approx(there[:2], abs=2e-3)


def test_a_text_of_a_tilted_marker_is_in_place_and_upright(link, layer, mounted):
    text = seen(link, layer, TEXT, text="here")
    placed = to_root(text)
    (there,) = transformed([THERE], BODY, mounted)
    assert placed.apply(0, 0) == pytest.approx(there[:2])
    assert (placed.b, placed.c) == (0, 0)
    assert placed.a == -placed.d > 0


def test_a_frame_locked_marker_is_redrawn_when_its_frame_tilts(link, layer):
    header = {"stamp": stamp(0.0), "frame_id": "gripper"}
    tall = marker(
        CUBE, scale=(1.0, 1.0, 3.0), at=(0, 0, 0), header=header, frame_locked=True
    )
    publish(link, tall)
    for seconds, turns, size in (
        (100.0, (0.0, 0.0, 0.0), (1.0, 1.0)),
        (100.1, (0.0, math.pi / 2, 0.0), (3.0, 1.0)),
        (100.2, (math.pi / 2, 0.0, 0.0), (1.0, 3.0)),
        (100.3, (0.0, 0.0, 0.0), (1.0, 1.0)),
    ):
        send_transforms(link, frame("map", "gripper", (2.0, 0.0, 1.0), turns, seconds))
        (box,) = layer.shapes["test", 1].children
        if box.get("points") is None:
            found = np.array([[0.0, 0.0], [box.get("width"), box.get("height")]], float)
        else:
            found = outline(box)
        assert np.ptp(found, axis=0) == pytest.approx(size, abs=2e-3), seconds


@pytest.mark.parametrize("type", [CUBE, SPHERE, CYLINDER, CUBES, SPHERES])
def test_a_frame_locked_marker_with_an_absurd_height_is_refused_while_flat(
    link, layer, type
):
    header = {"stamp": stamp(0.0), "frame_id": "gripper"}
    tall = {"scale": (1.0, 1.0, 1e9), "header": header, "frame_locked": True}
    publish(link, marker(type, [(0, 0)], **tall))
    assert layer.shapes == {}
    assert any(
        "scale.z must be at most" in problem for problem in layer.problems.values()
    )


def test_a_frame_locked_marker_that_only_moves_is_not_redrawn(link, layer):
    header = {"stamp": stamp(0.0), "frame_id": "camera"}
    over = marker(CYLINDER, at=(0, 0, 0), header=header, frame_locked=True)
    publish(link, over)
    shapes = []
    for step in range(4):
        turns = (*OVER[:2], 0.7 * step)
        send_transforms(
            link, frame("map", "camera", (step, 0.0, 1.0), turns, 100.0 + step / 10)
        )
        shapes.append(layer.shapes["test", 1])
        assert to_root(shapes[-1]).apply(0, 0) == pytest.approx((step, 0.0))
    assert len({id(shape) for shape in shapes[0:]}) == 1


def test_a_marker_ahead_in_an_optical_frame_is_drawn_ahead_on_the_map(link, layer):
    """In plain numbers: three metres ahead of the lens, and half a metre right."""
    header = {"stamp": stamp(0.0), "frame_id": "optical"}
    publish(link, marker(CUBE, header=header))
    send_transforms(link, frame("map", "optical", (1.0, 2.0, 0.5), OPTICAL))
    publish(link, marker(CUBE, header=header, pose=posed((0.5, 0.1, 3.0))))
    assert to_root(layer.shapes["test", 1]).apply(0, 0) == pytest.approx((4.0, 1.5))
    assert matrix(*OPTICAL) @ (0.5, 0.1, 3.0) == pytest.approx([3.0, -0.5, -0.1])
