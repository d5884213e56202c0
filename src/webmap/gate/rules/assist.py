"""Scan assist: slower before what a laser scanner sees in the way.

It assists a driver and is no safety function: a planar scanner sees neither glass, nor
stairs, nor a table's edge, and what it says passes a network.

The footprint is swept along the commanded motion, a straight line or an arc, until it
meets the first point of the scan. In the robot's own frame it is the points that move,
each on a circle about the centre of the turn, so that where they meet the edges of the
footprint is exact.
"""

import math
from collections.abc import Iterable, Sequence

import msgspec

from webmap.gate.events import Sweep
from webmap.gate.messages import AssistSpec, Point
from webmap.gate.rules.sweptway import Fan, looks_ahead
from webmap.geometry import Twist

FRESH = 0.3
"""The oldest scan that counts, in seconds since it arrived."""

KNOWN = 0.5
"""The least share of rays towards the motion that must say anything."""

REACTION = 0.2
"""Seconds in which the robot goes on as before after the scan was taken."""

_SECTOR = math.radians(60)
_STRAIGHT = 1e-4
_ON_THE_SPOT = 1e-6
_TOUCHING = 1e-9


class Verdict(msgspec.Struct, frozen=True):
    """How much of a commanded velocity is let through."""

    scale: float
    """Between 0 and 1."""
    why: str | None
    """In words, if it is less than 1."""


FREE = Verdict(1.0, None)


def assist(spec: AssistSpec, sweep: Sweep | None, wanted: Twist, now: float) -> Verdict:
    """Return how much of a velocity the scan allows.

    Args:
        spec: The robot and its scanner.
        sweep: The newest scan, if there is one.
        wanted: The velocity that is asked for.
        now: On the clock that the scan arrived by.

    """
    speed = _reach_speed(spec, wanted)
    if speed == 0.0:
        return FREE
    if sweep is not None and spec.upside_down:
        sweep = _turned_over(sweep)
    if reason := _blindness(spec, sweep, wanted, now):
        return _blind(spec, speed, reason)
    assert sweep is not None
    gap = free_way(spec.footprint, points_of(spec, sweep), wanted) * speed
    room = gap - spec.stop_distance - REACTION * speed
    allowed = math.sqrt(2 * spec.brake * room) if room > 0 else 0.0
    if allowed >= speed:
        return FREE
    return Verdict(allowed / speed, f"scan assist: something {gap:.1f} m ahead")


def points_of(spec: AssistSpec, sweep: Sweep) -> list[Point]:
    """Return what the scan hit, in the robot's frame; hits of its own body left out."""
    x0, y0, yaw0 = spec.sensor
    points = []
    for ray, reach in enumerate(sweep.ranges):
        if reach == -math.inf:
            reach = max(sweep.range_min, 0.0)
        elif not (sweep.range_min <= reach < math.inf):
            # What is beyond the stated reach counts: that may be wrong, or not stated.
            continue
        bearing = yaw0 + sweep.angle_min + ray * sweep.angle_increment
        point = (x0 + reach * math.cos(bearing), y0 + reach * math.sin(bearing))
        if not inside(spec.footprint, point):
            points.append(point)
    return points


def free_way(
    footprint: Sequence[Point], points: Iterable[Point], twist: Twist
) -> float:
    """Return the time in seconds until the footprint touches the first point.

    Args:
        footprint: Its corners, in the robot's frame, in metres.
        points: In the same frame, none inside the footprint.
        twist: The motion, which goes on unchanged.

    Returns:
        Infinity if it never touches one; within one turn, if it turns.

    """
    edges = list(zip(footprint, (*footprint[1:], footprint[0]), strict=True))
    if abs(twist.wz) < _STRAIGHT:
        times = (
            _time_straight(point, edge, twist) for point in points for edge in edges
        )
    else:
        center = (-twist.vy / twist.wz, twist.vx / twist.wz)
        times = (
            _time_turning(point, edge, center, twist.wz)
            for point in points
            for edge in edges
        )
    return min(times, default=math.inf)


def polygon_around(radius: float, corners: int = 12) -> tuple[Point, ...]:
    """Return the corners of a regular polygon that holds a disc, in order."""
    outer = radius / math.cos(math.pi / corners)
    turns = (math.tau * corner / corners for corner in range(corners))
    return tuple((outer * math.cos(turn), outer * math.sin(turn)) for turn in turns)


def inside(corners: Sequence[Point], point: Point) -> bool:
    """Return whether a point lies within a polygon."""
    x, y = point
    odd = False
    for (ax, ay), (bx, by) in zip(corners, (*corners[1:], corners[0]), strict=True):
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            odd = not odd
    return odd


def _turned_over(sweep: Sweep) -> Sweep:
    """Return what a scanner that hangs head down would say if it stood upright."""
    return msgspec.structs.replace(
        sweep,
        angle_min=-sweep.angle_min,
        angle_increment=-sweep.angle_increment,
    )


def _reach_speed(spec: AssistSpec, twist: Twist) -> float:
    """Return how fast the fastest corner may go, in metres per second."""
    outer = max(math.hypot(x, y) for x, y in spec.footprint)
    return math.hypot(twist.vx, twist.vy) + abs(twist.wz) * outer


def _blindness(
    spec: AssistSpec, sweep: Sweep | None, wanted: Twist, now: float
) -> str | None:
    if sweep is None:
        return "no scan yet"
    age = now - sweep.arrived
    if not 0 <= age <= FRESH:
        return f"the scan is {age:.1f} s old"
    step = sweep.angle_increment
    if not (math.isfinite(sweep.angle_min) and math.isfinite(step) and step != 0.0):
        return "the scan has no angles"
    towards = _rays_towards(spec, sweep, wanted)
    if not towards:
        return "the scan does not look where the robot goes"
    known = sum(map(_says_something, towards, (sweep,) * len(towards)))
    if known < KNOWN * len(towards):
        return "most of the scan is unknown"
    if not _covers_the_way(spec, sweep, wanted):
        return "the scan covers a part of the way only"
    return None


def _covers_the_way(spec: AssistSpec, sweep: Sweep, wanted: Twist) -> bool:
    """Return whether the scan looks where the robot is until it could stand."""
    fan = Fan(sweep.angle_min, sweep.angle_increment, len(sweep.ranges))
    speed = math.hypot(wanted.vx, wanted.vy)
    if speed < _ON_THE_SPOT:
        return fan.share >= KNOWN
    way = REACTION * speed + speed * speed / (2 * spec.brake) + spec.stop_distance
    return looks_ahead(
        fan, spec.footprint, spec.sensor, wanted, way / speed, spec.stop_distance
    )


def _rays_towards(spec: AssistSpec, sweep: Sweep, wanted: Twist) -> list[float]:
    """Return the ranges that look where the robot goes; all of them if it turns."""
    if math.hypot(wanted.vx, wanted.vy) < _ON_THE_SPOT:
        return list(sweep.ranges)
    ahead = math.atan2(wanted.vy, wanted.vx) - spec.sensor[2]
    chosen = []
    for ray, reach in enumerate(sweep.ranges):
        bearing = sweep.angle_min + ray * sweep.angle_increment
        if abs(math.remainder(bearing - ahead, math.tau)) <= _SECTOR:
            chosen.append(reach)
    return chosen


def _says_something(reach: float, sweep: Sweep) -> bool:
    # Below the least range lies what a covered scanner says; -inf is a driver's word.
    return math.isinf(reach) or reach >= max(sweep.range_min, 1e-6)


def _blind(spec: AssistSpec, speed: float, reason: str) -> Verdict:
    why = f"scan assist: {reason}"
    if spec.blind == "stop":
        return Verdict(0.0, why)
    return FREE if speed <= spec.creep else Verdict(spec.creep / speed, why)


def _time_straight(point: Point, edge: tuple[Point, Point], twist: Twist) -> float:
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


def _time_turning(
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
