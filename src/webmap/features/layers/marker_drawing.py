"""``visualization_msgs/Marker``: its message, and how each type looks from above."""

import math
from collections.abc import Callable, Iterable
from itertools import pairwise
from typing import Any, ClassVar

import msgspec

from webmap.base.errors import ProtocolError
from webmap.base.geometry import FARTHEST, Affine, Vector3
from webmap.modules.drawing import (
    Point,
    box,
    check_finite,
    cylinder,
    ellipsoid,
    flat,
    in_space,
    rounded,
)
from webmap.ros.messages import Header, PointMsg, PoseMsg, Stamped, Time
from webmap.ros.tf import Transform
from webmap.scene import svg
from webmap.scene.element import Element

ARROW, CUBE, SPHERE, CYLINDER, LINE_STRIP, LINE_LIST = range(6)
CUBE_LIST, SPHERE_LIST, POINTS, TEXT_VIEW_FACING, MESH_RESOURCE, TRIANGLE_LIST = range(
    6, 12
)

ADD, DELETE, DELETE_ALL = 0, 2, 3


class ColorMsg(msgspec.Struct, frozen=True, gc=False):
    """``std_msgs/ColorRGBA``; each component from 0 to 1."""

    r: float
    g: float
    b: float
    a: float = 1.0


class MarkerHeader(Header, frozen=True, gc=False):
    """A header with ``seq``, by which markers of ROS 1 are recognized."""

    seq: int | None = None
    """The number of the message; only ROS 1 has one."""


class MarkerMsg(Stamped, frozen=True, kw_only=True):
    """``visualization_msgs/Marker``."""

    header: MarkerHeader = MarkerHeader()
    type: int
    action: int
    pose: PoseMsg
    scale: PointMsg
    """In metres; the meaning of each depends on the type."""

    color: ColorMsg
    ns: str = ""
    id: int = 0
    lifetime: Time = Time()
    """Time for which the marker is shown; 0 for ever."""

    points: list[PointMsg] = msgspec.field(default_factory=list)
    """In the frame of :attr:`pose`."""

    colors: list[ColorMsg] = msgspec.field(default_factory=list)
    """One for each point, or none."""

    text: str = ""
    frame_locked: bool = False
    """Whether the marker moves with its frame."""

    def clears(self, ns: str) -> bool:
        """Return whether the action :data:`DELETE_ALL` deletes markers of a namespace.

        In ROS 2, a namespace limits it to the markers of this namespace. ROS 1 deletes
        all markers of the topic, whatever the namespace.
        """
        return self.ns in ("", ns) or self.header.seq is not None


class MarkerArrayMsg(msgspec.Struct, frozen=True):
    """``visualization_msgs/MarkerArray``."""

    separable: ClassVar = True
    markers: list[MarkerMsg]


SHADES = 16
"""Number of steps to which the colours of single points are rounded, from 0 to 1."""


def area_style(colour: ColorMsg) -> dict[str, Any]:
    """Return the SVG attributes of an area without an outline."""
    return {"fill": _rgb(colour), "fill_opacity": _alpha(colour)}


def line_style(colour: ColorMsg, width: float) -> dict[str, Any]:
    """Return the attributes of a line with a colour and a width in metres."""
    return {
        "stroke": _rgb(colour),
        "stroke_opacity": _alpha(colour),
        "stroke_width": width,
        "stroke_linejoin": "round",
    }


def colours(marker: MarkerMsg) -> list[ColorMsg]:
    """Return a colour for each point: its own, or that of the marker."""
    return marker.colors or [marker.color] * len(marker.points)


def by_colour(
    parts: Iterable[tuple[str, ColorMsg]],
    style: Callable[[ColorMsg], dict[str, Any]],
) -> Iterable[Element]:
    """Return one path for each colour, with all parts of that colour."""
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
    """Return a component of a colour within 0 to 1; 0 if it is not finite."""
    return min(1.0, max(0.0, part)) if math.isfinite(part) else 0.0


def _rgb(colour: ColorMsg) -> str:
    parts = (round(255 * _share(part)) for part in (colour.r, colour.g, colour.b))
    return "#" + "".join(f"{part:02x}" for part in parts)


def _alpha(colour: ColorMsg) -> float:
    return round(_share(colour.a), 3)


MAX_TEXT = 500
"""Greatest number of characters that are shown of a text."""

LETTERS = 16.0
"""The size of letters before they are scaled: browsers round sizes below 1."""

CLASSES = {
    ARROW: "arrow",
    CUBE: "cube",
    SPHERE: "sphere",
    CYLINDER: "cylinder",
    LINE_STRIP: "line-strip",
    LINE_LIST: "line-list",
    CUBE_LIST: "cube-list",
    SPHERE_LIST: "sphere-list",
    POINTS: "points",
    TEXT_VIEW_FACING: "text",
    TRIANGLE_LIST: "triangle-list",
}
"""The CSS class of each type that can be drawn."""


def draw(marker: MarkerMsg, tilt: Transform) -> Iterable[Element]:
    """Return the elements of a marker, in the coordinates of its pose.

    Args:
        marker: The marker, of a type in :data:`CLASSES`.
        tilt: The rotation of the marker without its heading.

    Raises:
        ProtocolError: If a number is not valid.
    """
    return _DRAWN[marker.type](marker, tilt)


def sizes(marker: MarkerMsg, *axes: str) -> list[float]:
    """Return sizes of a marker along axes, in metres.

    Raises:
        ProtocolError: If a size is not above 0, or above the greatest size.
    """
    found = [getattr(marker.scale, axis) for axis in axes]
    for axis, size in zip(axes, found, strict=True):
        if not (math.isfinite(size) and size > 0):
            raise ProtocolError(f"scale.{axis} must be metres above 0, got {size}")
        _check_size(axis, size)
    return found


def _check_size(axis: str, size: float) -> None:
    if size > FARTHEST:
        raise ProtocolError(
            f"scale.{axis} must be at most {FARTHEST:g} m, got {size:g}"
        )


def _text(marker: MarkerMsg, _: Transform) -> Iterable[Element]:
    text = svg.text(
        text=marker.text[:MAX_TEXT],
        font_size=LETTERS,
        font_family="sans-serif",
        text_anchor="middle",
        dominant_baseline="central",
        text_rendering="geometricPrecision",
        **area_style(marker.color),
    )
    return (text,)


def _arrow(marker: MarkerMsg, tilt: Transform) -> Iterable[Element]:
    if not marker.points:
        length, shaft = sizes(marker, "x", "y")
        ends = [Vector3(), Vector3(length)]
        head, wide = 0.23 * length, 2 * shaft
    elif len(marker.points) == 2:
        _check(marker)
        ends = in_space(marker.points)
        length = math.dist(*((end.x, end.y, end.z) for end in ends))
        shaft, wide = sizes(marker, "x", "y")
        given = marker.scale.z
        head = min(length, given if given > 0 else 0.23 * length)
    else:
        raise ProtocolError(
            f"an arrow has no points, or two of them, got {len(marker.points)}"
        )
    start, end = flat(ends, tilt)
    seen = math.dist(start, end)
    if seen == 0:
        return ()
    yaw = math.atan2(end[1] - start[1], end[0] - start[0])
    turn = Affine.translation(*start) @ Affine.rotation(yaw)
    neck = seen - head * seen / length
    corners = [(0, shaft), (neck, shaft), (neck, wide), (seen, 0)]
    corners += [(neck, -wide), (neck, -shaft), (0, -shaft)]
    outline = [turn.apply(along, side / 2) for along, side in corners]
    return (svg.polygon(**area_style(marker.color)).set_line(_rounded(outline)),)


def _cube(marker: MarkerMsg, tilt: Transform) -> Iterable[Element]:
    x, y, z = *sizes(marker, "x", "y"), _height(marker)
    style = area_style(marker.color)
    if tilt.upright:
        return (svg.rect(x=-x / 2, y=-y / 2, width=x, height=y, **style),)
    outline = box((x, y, z), tilt)
    return (svg.polygon(**style).set_line(_rounded(outline)),)


def _sphere(marker: MarkerMsg, tilt: Transform) -> Iterable[Element]:
    x, y, z = *sizes(marker, "x", "y"), _height(marker)
    style = area_style(marker.color)
    if tilt.upright:
        return (svg.ellipse(rx=x / 2, ry=y / 2, **style),)
    rx, ry, yaw = ellipsoid((x, y, z), tilt)
    ellipse = svg.ellipse(rx=rounded(rx), ry=rounded(ry), **style)
    ellipse.set_pose(0.0, 0.0, yaw)
    return (ellipse,)


def _cylinder(marker: MarkerMsg, tilt: Transform) -> Iterable[Element]:
    x, y, z = *sizes(marker, "x", "y"), _height(marker)
    style = area_style(marker.color)
    if tilt.upright:
        return (svg.ellipse(rx=x / 2, ry=y / 2, **style),)
    outline = cylinder((x, y, z), tilt)
    return (svg.polygon(**style).set_line(_rounded(outline)),)


def _line_strip(marker: MarkerMsg, tilt: Transform) -> Iterable[Element]:
    (width,) = sizes(marker, "x")
    points = _points(marker, tilt)
    if not marker.colors:
        style = line_style(marker.color, width)
        yield svg.polyline(fill="none", **style).set_line(_rounded(points))
        return
    parts = (
        (_line(one, other), colour)
        for (one, other), colour in zip(pairwise(points), marker.colors, strict=False)
    )
    yield from by_colour(parts, lambda colour: line_style(colour, width))


def _line_list(marker: MarkerMsg, tilt: Transform) -> Iterable[Element]:
    (width,) = sizes(marker, "x")
    points = _points(marker, tilt)
    if len(points) % 2:
        raise ProtocolError(f"a list of lines has {len(points)} ends, which is odd")
    each = colours(marker)
    parts = (
        (_line(points[i], points[i + 1]), each[i]) for i in range(0, len(points), 2)
    )
    return by_colour(parts, lambda colour: line_style(colour, width))


def _triangle_list(marker: MarkerMsg, tilt: Transform) -> Iterable[Element]:
    points = _points(marker, tilt)
    if len(points) % 3:
        raise ProtocolError(
            f"a list of triangles has {len(points)} corners, not three for each"
        )
    each = colours(marker)
    parts = (
        (_closed(points[i : i + 3]), colour)
        for i, colour in zip(range(0, len(points), 3), each[::3], strict=True)
    )
    return by_colour(parts, area_style)


def _square_list(marker: MarkerMsg, tilt: Transform) -> Iterable[Element]:
    """Return points, which always face the camera."""
    wide, high = sizes(marker, "x", "y")
    square = f"h{wide:.3f}v{high:.3f}h{-wide:.3f}z"
    parts = (
        (f"M{x - wide / 2:.3f} {y - high / 2:.3f}{square}", colour)
        for (x, y), colour in zip(_points(marker, tilt), colours(marker), strict=True)
    )
    return by_colour(parts, area_style)


def _cube_list(marker: MarkerMsg, tilt: Transform) -> Iterable[Element]:
    size = (*sizes(marker, "x", "y"), _height(marker))
    if tilt.upright:
        return _square_list(marker, tilt)
    outline = box(size, tilt)
    return _repeated(outline, marker, tilt)


def _sphere_list(marker: MarkerMsg, tilt: Transform) -> Iterable[Element]:
    wide, high, z = *sizes(marker, "x", "y"), _height(marker)
    if not tilt.upright:
        rx, ry, yaw = ellipsoid((wide, high, z), tilt)
        turn = Affine.rotation(yaw)
        turns = (math.tau * number / 24 for number in range(24))
        outline = [turn.apply(rx * math.cos(a), ry * math.sin(a)) for a in turns]
        return _repeated(outline, marker, tilt)
    rx, ry = wide / 2, high / 2
    half = f"a{rx:.3f} {ry:.3f} 0 1 0 "
    circle = f"{half}{wide:.3f} 0{half}{-wide:.3f} 0z"
    parts = (
        (f"M{x - rx:.3f} {y:.3f}{circle}", colour)
        for (x, y), colour in zip(_points(marker, tilt), colours(marker), strict=True)
    )
    return by_colour(parts, area_style)


def _repeated(
    outline: list[Point], marker: MarkerMsg, tilt: Transform
) -> Iterable[Element]:
    """Return an outline at each of a marker's points."""
    parts = (
        (_closed([(x + dx, y + dy) for dx, dy in outline]), colour)
        for (x, y), colour in zip(_points(marker, tilt), colours(marker), strict=True)
    )
    return by_colour(parts, area_style)


def _height(marker: MarkerMsg) -> float:
    """Return the height of a marker.

    The height is visible only on a tilted marker, and a flat marker may be tilted
    later.

    Raises:
        ProtocolError: If the height is above the greatest size.
    """
    height = marker.scale.z
    if not (math.isfinite(height) and height > 0):
        return 0.0
    _check_size("z", height)
    return height


def _check(marker: MarkerMsg) -> None:
    check_finite([(point.x, point.y) for point in marker.points], "points")


def _points(marker: MarkerMsg, tilt: Transform) -> list[Point]:
    _check(marker)
    return flat(in_space(marker.points), tilt)


def _rounded(points: list[Point]) -> list[Point]:
    return [(rounded(x), rounded(y)) for x, y in points]


def _line(one: Point, other: Point) -> str:
    return f"M{one[0]:.3f} {one[1]:.3f}L{other[0]:.3f} {other[1]:.3f}"


def _closed(points: list[Point]) -> str:
    return "M" + "L".join(f"{x:.3f} {y:.3f}" for x, y in points) + "z"


_DRAWN: dict[int, Callable[[MarkerMsg, Transform], Iterable[Element]]] = {
    ARROW: _arrow,
    CUBE: _cube,
    SPHERE: _sphere,
    CYLINDER: _cylinder,
    LINE_STRIP: _line_strip,
    LINE_LIST: _line_list,
    CUBE_LIST: _cube_list,
    SPHERE_LIST: _sphere_list,
    POINTS: _square_list,
    TEXT_VIEW_FACING: _text,
    TRIANGLE_LIST: _triangle_list,
}
