"""Markers: each type has its place and size."""

import asyncio
import math

import pytest
from module_fakes import header, numbers, pose, to_root

from equipment.waiting import until
from webmap import Map

ARROW, CUBE, SPHERE, CYLINDER, STRIP, LINES = range(6)
CUBES, SPHERES, POINTS, TEXT, MESH, TRIANGLES = range(6, 12)
RED, BLUE = {"r": 1, "g": 0, "b": 0, "a": 1}, {"r": 0, "g": 0, "b": 1.0, "a": 0.5}
AT = (3.0, -2.0, math.pi / 2)
"""A pose at which a metre ahead of a marker is a metre to the north."""


def vector(x=0.0, y=0.0, z=0.0) -> dict:
    return {"x": x, "y": y, "z": z}


def marker(type, points=(), *, scale=(1, 1, 1), at=AT, ros2=False, **more) -> dict:
    moment = {"sec": 0, "nanosec": 0} if ros2 else {"secs": 0, "nsecs": 0}
    return {
        "header": header(ros2=ros2),
        "ns": "test",
        "id": 1,
        "type": type,
        "action": 0,
        "pose": pose(*at),
        "scale": vector(*scale),
        "color": RED,
        "lifetime": moment,
        "frame_locked": False,
        "points": [vector(*point) for point in points],
        "colors": [],
        "text": "",
        "mesh_resource": "",
        "mesh_use_embedded_materials": False,
        **more,
    }


def publish(link, *markers) -> None:
    link.publish("/markers", {"markers": list(markers)})


@pytest.fixture
def layer(map, link):
    return map.add_module("Markers", link, "/markers").layer


def only(layer):
    (shape,) = layer.svg.children
    return shape


def corners(element, text: str) -> list[tuple[float, float]]:
    flat, place = numbers(text), to_root(element)
    return [place.apply(x, y) for x, y in zip(flat[::2], flat[1::2], strict=True)]


def near(points):
    return [pytest.approx(point, abs=2e-3) for point in points]


@pytest.mark.parametrize("ros2", [False, True])
def test_a_cube_is_a_box_centred_on_its_pose(link, layer, ros2):
    publish(link, marker(CUBE, scale=(2, 0.5, 9), ros2=ros2))
    (box,) = only(layer).children
    x, y, wide, high = (float(box.get(n)) for n in ("x", "y", "width", "height"))
    place = to_root(box)
    assert place.apply(x, y) == pytest.approx((3.25, -3.0))
    assert place.apply(x + wide, y + high) == pytest.approx((2.75, -1.0))
    assert box.get("fill") == "#ff0000"
    assert set(only(layer).classes) == {"marker", "cube"}


@pytest.mark.parametrize(("type", "name"), [(SPHERE, "sphere"), (CYLINDER, "cylinder")])
def test_spheres_and_cylinders_are_ellipses_with_their_two_diameters(
    link, layer, type, name
):
    publish(link, marker(type, scale=(2, 1, 1), color=BLUE))
    (ellipse,) = only(layer).children
    assert (ellipse.get("rx"), ellipse.get("ry")) == ("1", "0.5")
    assert (ellipse.get("fill"), ellipse.get("fill-opacity")) == ("#0000ff", "0.5")
    assert to_root(ellipse).apply(1, 0) == pytest.approx((3, -1))
    assert name in only(layer).classes


def test_an_arrow_has_the_length_of_its_scale(link, layer):
    publish(link, marker(ARROW, scale=(2.0, 0.1, 0.1)))
    (arrow,) = only(layer).children
    outline = corners(arrow, arrow.get("points"))
    assert outline[3] == pytest.approx((3, 0))
    assert outline[0] == pytest.approx((2.95, -2))
    assert max(x for x, _ in outline) == pytest.approx(3.1)


def test_an_arrow_goes_from_its_first_point_to_its_second(link, layer):
    publish(link, marker(ARROW, [(1, 1), (4, 5)], scale=(0.1, 0.3, 1.0)))
    (arrow,) = only(layer).children
    outline = corners(arrow, arrow.get("points"))
    # Turned by a right angle about (3, -2).
    assert outline[3] == pytest.approx((3 - 5, -2 + 4), abs=2e-3)
    begin = [(a + b) / 2 for a, b in zip(outline[0], outline[6], strict=True)]
    assert begin == pytest.approx((3 - 1, -2 + 1), abs=2e-3)


def test_a_line_strip_is_one_line_and_a_line_list_is_many_lines(link, layer):
    points = [(0, 0), (1, 0), (1, 1), (2, 1)]
    there = [(3, -2), (3, -1), (2, -1), (2, 0)]
    publish(link, marker(STRIP, points, scale=(0.05, 0, 0)))
    (strip,) = only(layer).children
    assert corners(strip, strip.get("points")) == near(there)
    assert strip.get("stroke-width") == "0.05"
    assert strip.get("fill") == "none"
    publish(link, marker(LINES, points, scale=(0.05, 0, 0)))
    (lines,) = only(layer).children
    assert corners(lines, lines.get("d")) == near(there)
    assert lines.get("d").count("M") == 2


@pytest.mark.parametrize("type", [CUBES, POINTS])
def test_cube_lists_and_points_are_rectangles_centred_on_their_points(
    link, layer, type
):
    publish(link, marker(type, [(0, 0), (5, 1)], scale=(0.4, 0.2, 1)))
    (path,) = only(layer).children
    first, second = path.get("d").split("z")[:2]
    x, y, wide, high, back = numbers(second)
    assert (wide, high, back) == (0.4, 0.2, -0.4)
    middle = to_root(path).apply(x + wide / 2, y + high / 2)
    assert middle == pytest.approx((3 - 1, -2 + 5))
    assert first.startswith("M-0.2")


def test_sphere_lists_are_circles_centred_on_their_points(link, layer):
    publish(link, marker(SPHERES, [(1, 2)], scale=(0.4, 0.4, 0.4)))
    (path,) = only(layer).children
    x, y, rx, ry, *_ = numbers(path.get("d"))
    assert to_root(path).apply(x + rx, y) == pytest.approx((3 - 2, -2 + 1))
    assert (rx, ry) == (0.2, 0.2)


def test_triangles_are_closed_paths_through_their_points(link, layer):
    publish(link, marker(TRIANGLES, [(0, 0), (1, 0), (0, 1)]))
    (path,) = only(layer).children
    assert corners(path, path.get("d")) == near([(3, -2), (3, -1), (2, -2)])
    assert path.get("d").endswith("z")


@pytest.mark.parametrize("type", [POINTS, CUBES, SPHERES, LINES, STRIP, TRIANGLES])
def test_points_with_their_own_colours_are_drawn_in_these_colours(link, layer, type):
    count = 6
    points = [(i, i * i) for i in range(count)]
    colours = [RED] * 3 + [BLUE] * 3
    publish(link, marker(type, points, colors=colours, scale=(0.1, 0.1, 0.1)))
    fills = {path.get("fill") or path.get("stroke") for path in only(layer).children}
    if type in (STRIP, LINES):
        fills = {path.get("stroke") for path in only(layer).children}
    assert fills == {"#ff0000", "#0000ff"}


def test_a_text_marker_is_upright_and_contains_only_text(link, layer):
    words = "<script>alert(1)</script> Küche"
    zeros = {"x": 0, "y": 0, "z": 0, "w": 0}
    at = {"position": vector(1, 2), "orientation": zeros}
    publish(link, marker(TEXT, text=words, scale=(0, 0, 0.3), pose=at))
    (text,) = only(layer).children
    assert text.text == words
    size = float(text.get("font-size"))
    assert to_root(text).apply(0, 0) == (1, 2)
    letter = to_root(text).apply(0, -size)
    assert letter == pytest.approx((1, 2.3)), "letters have their y axis downward"


def test_markers_are_replaced_and_deleted_by_namespace_and_id(link, layer):
    publish(
        link,
        marker(CUBE, id=1),
        marker(CUBE, id=2),
        marker(SPHERE, id=1, ns="other"),
    )
    first, second, other = layer.svg.children
    assert (other.get("data-ns"), other.get("data-id")) == ("other", "1")
    publish(link, marker(SPHERE, id=1))
    assert [list(shape.classes)[1] for shape in layer.svg.children] == [
        "sphere",
        "cube",
        "sphere",
    ]
    publish(link, marker(CUBE, id=1, action=2), marker(CUBE, id=77, action=2))
    assert layer.svg.children == (second, other)
    publish(link, marker(CUBE, action=3))
    assert layer.svg.children == ()
    assert first.parent is None


def test_a_moved_marker_keeps_its_element(link, layer):
    publish(link, marker(CUBE))
    before = only(layer)
    publish(link, marker(CUBE, at=(7, 8, 0)))
    assert only(layer) is before
    assert to_root(before).apply(0, 0) == (7, 8)


def test_a_single_marker_message_is_drawn(map, link, channel):
    layer = map.add_module(
        "Markers", link, "/marker", type="visualization_msgs/msg/Marker"
    ).layer
    link.publish("/marker", marker(CUBE))
    assert "cube" in only(layer).classes
    link.publish("/marker", marker(CUBE, scale=(0, 1, 1)))
    (error,) = channel.errors
    assert error.endswith("marker 1 of 'test': scale.x must be metres above 0, got 0.0")


ZEROS = {"position": vector(), "orientation": {"x": 0, "y": 0, "z": 0, "w": 0}}
ALMOST_ZEROS = {**ZEROS, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1e-9}}
BAD = {
    "a quaternion of length 1e-09": marker(CUBE, pose=ALMOST_ZEROS),
    "a pose must be of finite": marker(CUBE, pose=pose(math.nan, 0)),
    "place of a text": marker(TEXT, pose=pose(math.inf, 0), text="x"),
    "scale.y must be metres above 0, got nan": marker(CUBE, scale=(1, None, 1)),
    "scale.x must be metres above 0, got -1": marker(STRIP, scale=(-1, 0, 0)),
    "as point 1 of 2": marker(STRIP, [(0, 0), (None, 1)]),
    "3 ends, which is odd": marker(LINES, [(0, 0)] * 3),
    "4 corners, not three": marker(TRIANGLES, [(0, 0)] * 4),
    "no points, or two of them, got 3": marker(ARROW, [(0, 0)] * 3),
    "1 colours for 2 points": marker(POINTS, [(0, 0)] * 2, colors=[RED]),
    "20001 points; the limit is 20000": marker(POINTS, [(0, 0)] * 20_001),
    "type 10 are not drawn": marker(MESH),
    "type 99 are not drawn": marker(99),
    "got 7": marker(CUBE, action=7),
    "only url(#id)": marker(CUBE, ns="url(http://evil/)"),
}


@pytest.mark.parametrize("why", BAD)
def test_only_the_invalid_marker_of_an_array_is_left_out(link, layer, channel, why):
    publish(link, marker(SPHERE))
    before = only(layer)
    publish(link, BAD[why], marker(CUBE, id=2))
    one, other = layer.svg.children
    assert one is before
    assert "cube" in other.classes
    (error,) = channel.errors
    assert why in error
    assert "1 of 2 are left out" in error
    publish(link, marker(CUBE, id=2))
    assert layer.problems == {}


ENDS = [(0, 0), (1, 0)]


@pytest.mark.parametrize(
    ("type", "points"),
    [
        (ARROW, []),
        (ARROW, ENDS),
        (CUBE, []),
        (CYLINDER, []),
        (SPHERE, []),
        (CUBES, ENDS),
        (SPHERES, ENDS),
        (POINTS, ENDS),
        (LINES, ENDS),
        (STRIP, ENDS),
        (TRIANGLES, [*ENDS, (0, 1)]),
    ],
)
def test_a_marker_with_a_zero_quaternion_is_drawn_unrotated(
    link, layer, channel, type, points
):
    nowhere = {**pose(3, -2), "orientation": ZEROS["orientation"]}
    unset = marker(type, points, pose=nowhere)
    publish(link, unset, {**unset, "id": 2})
    publish(link, unset)
    assert len(layer.svg.children) == 2
    assert to_root(layer.svg.children[0]).apply(1, 0) == pytest.approx((4, -2))
    assert channel.errors == []


def test_markers_beyond_the_limit_are_left_out_and_counted_in_a_notice(
    map, link, channel, monkeypatch
):
    monkeypatch.setattr("webmap.features.layers.markers.MAX_MARKERS", 10)
    monkeypatch.setattr("webmap.features.layers.markers.SETTLED", 0.01)

    async def scenario():
        layer = map.add_module("Markers", link, "/markers").layer
        publish(link, *(marker(CUBE, id=i) for i in range(11)))
        publish(link, *(marker(CUBE, id=i) for i in range(12)))  # the same and one more
        assert len(layer.svg.children) == 10
        await until(lambda: channel.problems)
        (problem,) = channel.problems.values()
        assert problem == "/markers: 2 markers are left out: at most 10 are drawn"
        publish(link, marker(CUBE, id=0, action=3))  # delete all
        assert not channel.problems
        publish(link, *(marker(CUBE, id=i) for i in range(11)))
        await until(lambda: channel.problems)
        publish(link, marker(CUBE, id=1, action=2), marker(CUBE, id=10))
        await until(lambda: not channel.problems)

    asyncio.run(scenario())


def test_a_marker_with_a_very_long_namespace_is_left_out_with_a_short_notice(
    link, layer, channel
):
    publish(link, marker(CUBE, ns="n" * 100_000), marker(CUBE, id=2))
    assert len(layer.svg.children) == 1
    (problem,) = channel.problems.values()
    assert "a namespace of 100000 characters; the limit is 256" in problem
    assert len(problem) < 1100


@pytest.mark.parametrize("ros2", [False, True])
def test_a_marker_is_removed_after_its_lifetime_unless_it_is_sent_again(
    map, link, ros2
):
    brief = {"sec": 0, "nanosec": 50_000_000} if ros2 else {"secs": 0, "nsecs": 5e7}
    brief = {key: int(value) for key, value in brief.items()}

    async def scenario():
        layer = map.add_module("Markers", link, "/markers").layer
        publish(
            link,
            marker(CUBE, id=1, lifetime=brief),
            marker(CUBE, id=2),
            marker(CUBE, id=3, lifetime=brief),
        )
        publish(link, marker(CUBE, id=3))
        assert len(layer.svg.children) == 3
        await until(lambda: len(layer.svg.children) != 3)
        assert [shape.get("data-id") for shape in layer.svg.children] == ["2", "3"]

    asyncio.run(scenario())


def test_maps_share_one_marker_layer_and_its_drawing_order(page, link, channel):
    maps = [Map(page.element(f"m{i}"), 10, 10) for i in range(3)]
    layers = {map.add_module("Markers", link, "/markers").layer for map in maps}
    assert len(layers) == 1
    assert len(link.listeners["/markers"]) == 1
    (layer,) = layers
    orders = {
        channel.orders[m] for m, f in channel.mounted.items() if f is layer.fragment
    }
    assert orders == {50.0}
    page.close()
    assert link.listeners == {}


def test_a_message_type_without_markers_is_refused(map, link):
    with pytest.raises(ValueError, match="got 'nav_msgs/Path'"):
        map.add_module("Markers", link, "/markers", type="nav_msgs/Path")
