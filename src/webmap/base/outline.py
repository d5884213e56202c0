"""The outline of a robot: a polygon with an area and without crossing edges.

Scan assist computes which points lie inside the outline and when a point touches an
edge. Configuration and gate check it with the same function.
"""

import itertools
import math
from collections.abc import Sequence
from typing import TypeAlias

Point: TypeAlias = tuple[float, float]
"""x (forward) and y (left) in metres, in the robot's own frame."""

MOST_CORNERS = 100
"""The most corners of an outline: each costs time with every command."""

LEAST_AREA = 1e-4
"""The least area in square metres: a square of one centimetre."""

FARTHEST = 1000.0
"""The most metres from the robot's origin to a corner, along x and along y."""


def polygon_around(radius: float, corners: int = 12) -> tuple[Point, ...]:
    """Return the corners of a regular polygon around a disc, in order."""
    outer = radius / math.cos(math.pi / corners)
    turns = (math.tau * corner / corners for corner in range(corners))
    return tuple((outer * math.cos(turn), outer * math.sin(turn)) for turn in turns)


def why_no_outline(corners: Sequence[Point]) -> str | None:
    """Return why corners make no outline, as text to follow a colon.

    Args:
        corners: The corners in order; finite, in metres.

    Returns:
        ``None`` if they make an outline.

    """
    number = len(corners)
    if not 3 <= number <= MOST_CORNERS:
        return f"expected 3 to {MOST_CORNERS} corners, got {number}"
    if any(abs(x) > FARTHEST or abs(y) > FARTHEST for x, y in corners):
        return f"expected corners within {FARTHEST:g} m of the robot's origin"
    for (i, one), (j, other) in itertools.combinations(enumerate(corners, 1), 2):
        if one == other:
            return f"corners {i} and {j} are the same point; leave one of them out"
    for i, j in itertools.combinations(range(number), 2):
        if _cross(corners, i, j):
            return (
                f"the edge from corner {i + 1} meets the edge from corner {j + 1}; "
                "give the corners in their order around the robot"
            )
    area = abs(_area(corners))
    if area < LEAST_AREA:
        return (
            f"it has an area of {area:g} m²; expected {LEAST_AREA:g} m² or more, with "
            "lengths in metres"
        )
    return None


def _cross(corners: Sequence[Point], i: int, j: int) -> bool:
    """Return whether two edges meet, other than neighbours in their common corner."""
    number = len(corners)
    a, b = corners[i], corners[(i + 1) % number]
    c, d = corners[j], corners[(j + 1) % number]
    if b == c:  # neighbours share a corner, and cross if one runs back over the other
        return _turn(a, b, d) == 0.0 and _ahead(a, b, d) < 0.0
    if d == a:
        return _turn(c, d, b) == 0.0 and _ahead(c, d, b) < 0.0
    apart = _turn(a, b, c) * _turn(a, b, d) > 0.0 or _turn(c, d, a) * _turn(c, d, b) > 0
    return not apart and _boxes_meet(a, b, c, d)


def _turn(a: Point, b: Point, c: Point) -> float:
    """Return on which side of the line from a to b the point c lies; 0 on it."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _ahead(a: Point, b: Point, c: Point) -> float:
    """Return how far c lies ahead of b, seen from a; negative if behind."""
    return (b[0] - a[0]) * (c[0] - b[0]) + (b[1] - a[1]) * (c[1] - b[1])


def _boxes_meet(a: Point, b: Point, c: Point, d: Point) -> bool:
    return all(
        max(a[k], b[k]) >= min(c[k], d[k]) and max(c[k], d[k]) >= min(a[k], b[k])
        for k in (0, 1)
    )


def _area(corners: Sequence[Point]) -> float:
    """Return the area inside; negative if the corners are in clockwise order."""
    pairs = itertools.pairwise((*corners, corners[0]))
    return sum(ax * by - bx * ay for (ax, ay), (bx, by) in pairs) / 2
