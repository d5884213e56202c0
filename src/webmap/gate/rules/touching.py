"""When a point that a robot moves towards meets an edge of its footprint. No I/O.

All is in the robot's own frame, where the robot stands and the points move.
"""

import math

from webmap.base.geometry import Twist
from webmap.gate.messages import Point

_TOUCHING = 1e-9


def time_straight(point: Point, edge: tuple[Point, Point], twist: Twist) -> float:
    """Return when a point that comes by ``-twist`` crosses an edge."""
    (ax, ay), (bx, by) = edge
    dx, dy = -twist.vx, -twist.vy
    ex, ey = bx - ax, by - ay
    across = dx * ey - dy * ex
    if across == 0.0:
        return math.inf
    px, py = ax - point[0], ay - point[1]
    time = (px * ey - py * ex) / across
    along = (px * dy - py * dx) / across
    return time if time >= 0 and 0 <= along <= 1 else math.inf


def time_turning(
    point: Point, edge: tuple[Point, Point], center: Point, turn: float
) -> float:
    """Return when a point that goes round ``center`` at ``-turn`` crosses an edge."""
    cx, cy = center
    (ax, ay), (bx, by) = edge
    px, py = point[0] - cx, point[1] - cy
    ax, ay, bx, by = ax - cx, ay - cy, bx - cx, by - cy
    ex, ey = bx - ax, by - ay
    length = ex * ex + ey * ey
    middle = ax * ex + ay * ey
    apart = ax * ax + ay * ay - (px * px + py * py)
    root = middle * middle - length * apart
    if length == 0.0 or root < 0:
        return math.inf
    start = math.atan2(py, px)
    best = math.inf
    for sign in (-1.0, 1.0):
        along = (-middle + sign * math.sqrt(root)) / length
        if 0 <= along <= 1:
            at = math.atan2(ay + along * ey, ax + along * ex)
            angle = (start - at if turn > 0 else at - start) % math.tau
            if math.tau - angle < _TOUCHING:
                angle = 0.0
            best = min(best, angle / abs(turn))
    return best
