"""Points, outlines and numbers for layers; public as ``webmap.drawing``.

Lengths are in metres and angles in radians.
"""

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from webmap.base.errors import ProtocolError
from webmap.base.geometry import FARTHEST, Vector3
from webmap.ros.messages import PointMsg
from webmap.ros.tf import Transform

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Point = tuple[float, float]

RIM = 24
"""Points of the outline of a round shape."""

UNIT = 0.001
"""Metres per unit of dots, while all points fit in 16 bits."""

MOST = 32767
"""The greatest number of units in 16 bits."""


def in_space(points: Iterable[Vector3 | PointMsg]) -> list[Vector3]:
    """Return points with heights; a height that is not a finite number becomes 0.

    Raises:
        ProtocolError: If a height is beyond the limit.

    """
    found = [Vector3(p.x, p.y, p.z if math.isfinite(p.z) else 0.0) for p in points]
    for point in found:
        if abs(point.z) > FARTHEST:
            raise ProtocolError(
                f"points must be within {FARTHEST:g} m of the plane, got a height of "
                f"{point.z:g}"
            )
    return found


def flat(points: Iterable[Vector3], tilt: Transform) -> list[Point]:
    """Return points in the plane.

    Args:
        points: In metres, in the coordinates that ``tilt`` takes.
        tilt: The transform to coordinates whose z points up.

    """
    if tilt.upright and tilt.rotation.z == 0.0:
        by = tilt.translation
        return [(point.x + by.x, point.y + by.y) for point in points]
    (a, b, c, x), (d, e, f, y), _ = tilt.rows
    return [
        (a * p.x + b * p.y + c * p.z + x, d * p.x + e * p.y + f * p.z + y)
        for p in points
    ]


def levelled(
    points: "NDArray[np.float64]", tilt: Transform
) -> "tuple[NDArray[np.float64], NDArray[np.float64]]":
    """Return many points in the plane, and their heights.

    Args:
        points: Of shape (N, 2) in the plane of ``tilt``'s own coordinates, or (N, 3),
            in metres.
        tilt: The transform to coordinates whose z points up.

    Returns:
        Points of shape (N, 2) and heights of shape (N,), in metres.

    """
    import numpy as np

    if tilt.upright and tilt.rotation.z == 0.0:
        by = tilt.translation
        heights = points[:, 2] if points.shape[1] == 3 else np.zeros(len(points))
        return points[:, :2] + (by.x, by.y), heights + by.z
    rows = np.array(tilt.rows)
    turned = points @ rows[:, : points.shape[1]].T + rows[:, 3]
    return turned[:, :2], turned[:, 2]


def hull(points: Iterable[Point]) -> list[Point]:
    """Return the corners of the convex hull of points.

    They are in counter-clockwise order, and none lies on a side.
    """
    found = sorted(set(points))
    if len(found) < 3:
        return found

    def side(ordered: Iterable[Point]) -> list[Point]:
        kept: list[Point] = []
        for point in ordered:
            while len(kept) > 1 and _turns_left(kept[-2], kept[-1], point) <= 1e-12:
                kept.pop()
            kept.append(point)
        return kept[:-1]

    return side(found) + side(reversed(found))


def cone(reach: float, half: float, tilt: Transform) -> list[Point]:
    """Return the outline of a cone about x with a round end.

    Args:
        reach: The distance from its tip to its end, in metres.
        half: Half the angle at its tip, in radians.
        tilt: The transform from its coordinates to those whose z points up.

    """
    rings = (half * share / 4 for share in range(5))
    end = [
        Vector3(
            reach * math.cos(aside),
            reach * math.sin(aside) * math.cos(turn),
            reach * math.sin(aside) * math.sin(turn),
        )
        for aside in rings
        for turn in _round()
    ]
    return hull(flat([Vector3(), *end], tilt))


def box(size: Sequence[float], tilt: Transform) -> list[Point]:
    """Return the outline of a box about the origin, from its three sides in metres."""
    x, y, z = (side / 2 for side in size)
    corners = [
        Vector3(i * x, j * y, k * z) for i in _BOTH for j in _BOTH for k in _BOTH
    ]
    return hull(flat(corners, tilt))


def cylinder(size: Sequence[float], tilt: Transform) -> list[Point]:
    """Return the outline of a cylinder about z, from its three sizes in metres."""
    x, y, z = (side / 2 for side in size)
    rims = [
        Vector3(x * math.cos(turn), y * math.sin(turn), k * z)
        for turn in _round()
        for k in _BOTH
    ]
    return hull(flat(rims, tilt))


def ellipsoid(size: Sequence[float], tilt: Transform) -> tuple[float, float, float]:
    """Return the ellipse that an ellipsoid about the origin looks like.

    Args:
        size: Its three sizes, in metres.
        tilt: The transform from its coordinates to those whose z points up.

    Returns:
        Both half axes in metres, and the angle from x to the first one in radians.

    """
    one, other, _ = tilt.rows
    xs = [part * side / 2 for part, side in zip(one, size, strict=False)]
    ys = [part * side / 2 for part, side in zip(other, size, strict=False)]
    xx, yy = math.hypot(*xs) ** 2, math.hypot(*ys) ** 2
    xy = sum(x * y for x, y in zip(xs, ys, strict=True))
    middle, apart = (xx + yy) / 2, math.hypot((xx - yy) / 2, xy)
    yaw = 0.5 * math.atan2(2 * xy, xx - yy)
    return math.sqrt(middle + apart), math.sqrt(max(0.0, middle - apart)), yaw


def in_units(points: "NDArray[np.float64]") -> "tuple[NDArray[np.int16], float]":
    """Return points in whole units, and the size of a unit in metres.

    Args:
        points: Of shape (N, 2), in metres.

    Returns:
        Little-endian numbers of the same shape, whose bytes are for
        :meth:`webmap.Element.set_dots`, and the unit.

    """
    farthest = float(abs(points).max()) if len(points) else 0.0
    unit = max(UNIT, farthest / MOST)
    return (points / unit).round().astype("<i2"), unit


def rounded(value: float) -> float:
    """Return metres rounded to the millimetre, to shorten messages."""
    return round(value, 3) + 0.0


def check_finite(points: list[tuple[float, float]], what: str) -> None:
    """Check that points can be drawn.

    Raises:
        ProtocolError: If a point is not finite or too far away; the message has its
            number.

    """
    for number, (x, y) in enumerate(points):
        if not (math.isfinite(x) and math.isfinite(y)):
            raise ProtocolError(
                f"{what} must be of finite numbers, got ({x}, {y}) as point {number} "
                f"of {len(points)}"
            )
        if max(abs(x), abs(y)) > FARTHEST:
            raise ProtocolError(
                f"{what} must be within {FARTHEST:g} m of the origin, got ({x:g}, "
                f"{y:g}) as point {number} of {len(points)}"
            )


def thinned(count: int, most: int) -> range | list[int]:
    """Return which of ``count`` items to keep: evenly chosen, and the last one."""
    if count <= most:
        return range(count)
    step = count / most
    return [*(int(i * step) for i in range(most - 1)), count - 1]


def sector(radius: float, half: float) -> str | None:
    """Return the path of a sector about x; None if it has no size.

    Args:
        radius: In metres.
        half: Half its angle, in radians; a full circle from pi on.

    """
    if radius <= 0 or half < 1e-4:
        return None
    half = min(half, math.pi - 1e-3)
    x, y = radius * math.cos(half), radius * math.sin(half)
    large = int(half > math.pi / 2)
    return (
        f"M0 0L{x:.4f} {-y:.4f}A{radius:.4f} {radius:.4f} 0 {large} 1 {x:.4f} {y:.4f}z"
    )


_BOTH = (-1.0, 1.0)


def _round() -> Iterable[float]:
    return (math.tau * number / RIM for number in range(RIM))


def _turns_left(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
