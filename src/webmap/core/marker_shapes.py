"""Markers as elements: what each type of ``visualization_msgs/Marker`` looks like."""

import math
from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import Any

from webmap.core.placed import check_finite, put, rounded
from webmap.core.whereabouts import affine
from webmap.errors import ProtocolError
from webmap.geometry import Affine
from webmap.ros import messages_marker as kinds
from webmap.ros.messages_marker import ColorMsg, MarkerMsg
from webmap.scene import svg
from webmap.scene.element import Element

Point = tuple[float, float]

MAX_POINTS = 20_000
"""The most points that one marker may have."""

MAX_TEXT = 500
"""The most characters that are shown of a text."""

LETTERS = 16.0
"""The size of letters before they are scaled: browsers round what is below 1."""

SHADES = 16
"""How finely the colours of single points are told apart, from 0 to 1."""

AS_IT_COMES = Affine()
"""The frame of a marker that is drawn with its own numbers."""

CLASSES = {
    kinds.ARROW: "arrow",
    kinds.CUBE: "cube",
    kinds.SPHERE: "sphere",
    kinds.CYLINDER: "cylinder",
    kinds.LINE_STRIP: "line-strip",
    kinds.LINE_LIST: "line-list",
    kinds.CUBE_LIST: "cube-list",
    kinds.SPHERE_LIST: "sphere-list",
    kinds.POINTS: "points",
    kinds.TEXT_VIEW_FACING: "text",
    kinds.TRIANGLE_LIST: "triangle-list",
}
"""The class of each type that can be drawn."""


def shape_of(marker: MarkerMsg, frame: Affine = AS_IT_COMES) -> Element:
    """Return a marker as a group in its place, seen from above.

    Args:
        marker: The marker.
        frame: As :func:`place` has it.

    Raises:
        ProtocolError: If its type cannot be drawn, or a number makes no sense.

    """
    name = CLASSES.get(marker.type)
    if name is None:
        raise ProtocolError(f"markers of type {marker.type} are not drawn")
    if len(marker.points) > MAX_POINTS:
        raise ProtocolError(
            f"it has {len(marker.points)} points; {MAX_POINTS} are the limit"
        )
    if marker.colors and len(marker.colors) != len(marker.points):
        raise ProtocolError(
            f"it has {len(marker.colors)} colours for {len(marker.points)} points"
        )
    group = svg.g(class_=f"marker {name}")
    place(group, marker, frame)
    group.append(*_DRAWN[marker.type](marker))
    return group


def look_of(marker: MarkerMsg) -> tuple[object, ...]:
    """Return what a marker's shape depends on, but for its place."""
    m = marker
    return (m.type, m.scale, m.color, m.points, m.colors, m.text)


def place(shape: Element, marker: MarkerMsg, frame: Affine = AS_IT_COMES) -> None:
    """Put a shape where the marker has it.

    Args:
        shape: The shape.
        marker: Its marker.
        frame: What takes coordinates of the marker's frame to those of the map.

    Raises:
        ProtocolError: If its pose makes no sense.

    """
    if marker.type == kinds.TEXT_VIEW_FACING:
        # Its orientation means nothing, and often nobody has set it.
        at = (marker.pose.position.x, marker.pose.position.y)
        check_finite([at], "the place of a text")
        # The world has y upward; letters have it downward.
        size = _sizes(marker, "z")[0] / LETTERS
        shape.set_matrix(Affine(size, 0, 0, -size, *frame.apply(*at)))
    else:
        put(shape, frame @ affine(marker.pose.usable))


def _text(marker: MarkerMsg) -> Iterable[Element]:
    text = svg.text(
        text=marker.text[:MAX_TEXT],
        font_size=LETTERS,
        font_family="sans-serif",
        text_anchor="middle",
        dominant_baseline="central",
        text_rendering="geometricPrecision",
        **_filled(marker.color),
    )
    return (text,)


def _arrow(marker: MarkerMsg) -> Iterable[Element]:
    if not marker.points:
        length, shaft = _sizes(marker, "x", "y")
        start, end, head, wide = (0.0, 0.0), (length, 0.0), 0.23 * length, 2 * shaft
    elif len(marker.points) == 2:
        start, end = _points(marker)
        length = math.dist(start, end)
        shaft, wide = _sizes(marker, "x", "y")
        given = marker.scale.z
        head = min(length, given if given > 0 else 0.23 * length)
    else:
        raise ProtocolError(
            f"an arrow has no points, or two of them, got {len(marker.points)}"
        )
    if length == 0:
        return ()
    yaw = math.atan2(end[1] - start[1], end[0] - start[0])
    turn = Affine.translation(*start) @ Affine.rotation(yaw)
    neck = length - head
    corners = [(0, shaft), (neck, shaft), (neck, wide), (length, 0)]
    corners += [(neck, -wide), (neck, -shaft), (0, -shaft)]
    outline = [turn.apply(along, side / 2) for along, side in corners]
    return (svg.polygon(points=_rounded(outline), **_filled(marker.color)),)


def _cube(marker: MarkerMsg) -> Iterable[Element]:
    x, y = _sizes(marker, "x", "y")
    return (svg.rect(x=-x / 2, y=-y / 2, width=x, height=y, **_filled(marker.color)),)


def _round(marker: MarkerMsg) -> Iterable[Element]:
    x, y = _sizes(marker, "x", "y")
    return (svg.ellipse(rx=x / 2, ry=y / 2, **_filled(marker.color)),)


def _line_strip(marker: MarkerMsg) -> Iterable[Element]:
    (width,) = _sizes(marker, "x")
    points = _points(marker)
    if not marker.colors:
        yield svg.polyline(
            points=_rounded(points), fill="none", **_drawn(marker.color, width)
        )
        return
    parts = (
        (_line(one, other), colour)
        for (one, other), colour in zip(pairwise(points), marker.colors, strict=False)
    )
    yield from _by_colour(parts, lambda colour: _drawn(colour, width))


def _line_list(marker: MarkerMsg) -> Iterable[Element]:
    (width,) = _sizes(marker, "x")
    points = _points(marker)
    if len(points) % 2:
        raise ProtocolError(f"a list of lines has {len(points)} ends, which is odd")
    colours = _colours(marker)
    parts = (
        (_line(points[i], points[i + 1]), colours[i]) for i in range(0, len(points), 2)
    )
    return _by_colour(parts, lambda colour: _drawn(colour, width))


def _triangle_list(marker: MarkerMsg) -> Iterable[Element]:
    points = _points(marker)
    if len(points) % 3:
        raise ProtocolError(
            f"a list of triangles has {len(points)} corners, not three for each"
        )
    colours = _colours(marker)
    parts = (
        ("M" + "L".join(f"{x:.3f} {y:.3f}" for x, y in points[i : i + 3]) + "z", colour)
        for i, colour in zip(range(0, len(points), 3), colours[::3], strict=True)
    )
    return _by_colour(parts, _filled)


def _square_list(marker: MarkerMsg) -> Iterable[Element]:
    wide, high = _sizes(marker, "x", "y")
    square = f"h{wide:.3f}v{high:.3f}h{-wide:.3f}z"
    parts = (
        (f"M{x - wide / 2:.3f} {y - high / 2:.3f}{square}", colour)
        for (x, y), colour in zip(_points(marker), _colours(marker), strict=True)
    )
    return _by_colour(parts, _filled)


def _sphere_list(marker: MarkerMsg) -> Iterable[Element]:
    wide, high = _sizes(marker, "x", "y")
    rx, ry = wide / 2, high / 2
    half = f"a{rx:.3f} {ry:.3f} 0 1 0 "
    circle = f"{half}{wide:.3f} 0{half}{-wide:.3f} 0z"
    parts = (
        (f"M{x - rx:.3f} {y:.3f}{circle}", colour)
        for (x, y), colour in zip(_points(marker), _colours(marker), strict=True)
    )
    return _by_colour(parts, _filled)


_DRAWN: dict[int, Callable[[MarkerMsg], Iterable[Element]]] = {
    kinds.ARROW: _arrow,
    kinds.CUBE: _cube,
    kinds.SPHERE: _round,
    kinds.CYLINDER: _round,
    kinds.LINE_STRIP: _line_strip,
    kinds.LINE_LIST: _line_list,
    kinds.CUBE_LIST: _square_list,
    kinds.SPHERE_LIST: _sphere_list,
    kinds.POINTS: _square_list,
    kinds.TEXT_VIEW_FACING: _text,
    kinds.TRIANGLE_LIST: _triangle_list,
}


def _sizes(marker: MarkerMsg, *axes: str) -> list[float]:
    sizes = [getattr(marker.scale, axis) for axis in axes]
    for axis, size in zip(axes, sizes, strict=True):
        if not (math.isfinite(size) and size > 0):
            raise ProtocolError(f"scale.{axis} must be metres above 0, got {size}")
    return sizes


def _points(marker: MarkerMsg) -> list[Point]:
    points = [(point.x, point.y) for point in marker.points]
    check_finite(points, "points")
    return points


def _rounded(points: list[Point]) -> list[Point]:
    return [(rounded(x), rounded(y)) for x, y in points]


def _line(one: Point, other: Point) -> str:
    return f"M{one[0]:.3f} {one[1]:.3f}L{other[0]:.3f} {other[1]:.3f}"


def _colours(marker: MarkerMsg) -> list[ColorMsg]:
    return marker.colors or [marker.color] * len(marker.points)


def _by_colour(
    parts: Iterable[tuple[str, ColorMsg]],
    style: Callable[[ColorMsg], dict[str, Any]],
) -> Iterable[Element]:
    """Return one path for each colour, whatever their number of parts."""
    paths: dict[tuple[float, ...], list[str]] = {}
    for path, colour in parts:
        key = (_shade(colour.r), _shade(colour.g), _shade(colour.b), _shade(colour.a))
        paths.setdefault(key, []).append(path)
    for shades, together in paths.items():
        colour = ColorMsg(*(part / (SHADES - 1) for part in shades))
        yield svg.path(d="".join(together), **style(colour))


def _shade(part: float) -> int:
    return round(_share(part) * (SHADES - 1))


def _share(part: float) -> float:
    """Return a part of a colour that is one; what is not a number is nothing."""
    return min(1.0, max(0.0, part)) if math.isfinite(part) else 0.0


def _rgb(colour: ColorMsg) -> str:
    parts = (round(255 * _share(part)) for part in (colour.r, colour.g, colour.b))
    return "#" + "".join(f"{part:02x}" for part in parts)


def _alpha(colour: ColorMsg) -> float:
    return round(_share(colour.a), 3)


def _filled(colour: ColorMsg) -> dict[str, Any]:
    return {"fill": _rgb(colour), "fill_opacity": _alpha(colour)}


def _drawn(colour: ColorMsg, width: float) -> dict[str, Any]:
    return {
        "stroke": _rgb(colour),
        "stroke_opacity": _alpha(colour),
        "stroke_width": width,
        "stroke_linejoin": "round",
    }
