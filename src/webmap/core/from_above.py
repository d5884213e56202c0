"""What lies in space, as it is seen from above."""

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Protocol

from webmap.errors import ProtocolError
from webmap.geometry import Vector3
from webmap.geometry.reach import FARTHEST
from webmap.tf import Transform

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Point = tuple[float, float]

RIM = 24
"""Points that stand for what is round."""


class _Numbers(Protocol):
    @property
    def x(self) -> float: ...
    @property
    def y(self) -> float: ...
    @property
    def z(self) -> float: ...


def in_space(points: Iterable[_Numbers]) -> list[Vector3]:
    """Return points with a height; one whose height is no number lies in the plane.

    Raises:
        ProtocolError: If one is higher or lower than anything can be.

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
    """Return where points are in the plane.

    Args:
        points: In metres, in the coordinates that ``tilt`` takes.
        tilt: What takes them to coordinates whose z points up.

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
        tilt: What takes them to coordinates whose z points up.

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
    """Return the corners of the least convex outline around points.

    They go counter-clockwise, and none lies on a side.
    """
    found = sorted(set(points))
    if len(found) < 3:
        return found

    def side(way: Iterable[Point]) -> list[Point]:
        kept: list[Point] = []
        for point in way:
            while len(kept) > 1 and _turns_left(kept[-2], kept[-1], point) <= 1e-12:
                kept.pop()
            kept.append(point)
        return kept[:-1]

    return side(found) + side(reversed(found))


def cone(reach: float, half: float, tilt: Transform) -> list[Point]:
    """Return the outline of a cone about x with a round end.

    Args:
        reach: From its tip to its end, in metres.
        half: Half the angle at its tip, in radians.
        tilt: What takes its coordinates to those whose z points up.

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
    """Return the outline of a box about the origin, by its three sides in metres."""
    x, y, z = (side / 2 for side in size)
    corners = [
        Vector3(i * x, j * y, k * z) for i in _BOTH for j in _BOTH for k in _BOTH
    ]
    return hull(flat(corners, tilt))


def cylinder(size: Sequence[float], tilt: Transform) -> list[Point]:
    """Return the outline of a cylinder about z, by its three sizes in metres."""
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
        tilt: What takes its coordinates to those whose z points up.

    Returns:
        Both half axes in metres, and how far the first is turned from x in radians.

    """
    one, other, _ = tilt.rows
    xs = [part * side / 2 for part, side in zip(one, size, strict=False)]
    ys = [part * side / 2 for part, side in zip(other, size, strict=False)]
    xx, yy = math.hypot(*xs) ** 2, math.hypot(*ys) ** 2
    xy = sum(x * y for x, y in zip(xs, ys, strict=True))
    middle, apart = (xx + yy) / 2, math.hypot((xx - yy) / 2, xy)
    yaw = 0.5 * math.atan2(2 * xy, xx - yy)
    return math.sqrt(middle + apart), math.sqrt(max(0.0, middle - apart)), yaw


_BOTH = (-1.0, 1.0)


def _round() -> Iterable[float]:
    return (math.tau * number / RIM for number in range(RIM))


def _turns_left(a: Point, b: Point, c: Point) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
