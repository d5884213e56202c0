"""Scan assist: slows a robot down before obstacles that a laser scanner sees (S17).

Scan assist is no safety function: a planar scanner sees neither glass, nor stairs, nor
a table's edge, and its scans pass a network.

The footprint is swept along the commanded motion, a straight line or an arc, until it
meets the first point of the scan. In the robot's own frame the points move, each on a
circle about the centre of the turn, so their times of contact with the edges of the
footprint are exact.

This runs with every command, and all robots of the gate wait for it. So a scan is
folded to few beams on arrival (see :mod:`webmap.gate.rules.scan_geometry`), and points
that are too far away to matter are left out first.
"""

import math
from collections.abc import Iterable, Sequence

import msgspec

from webmap.base.geometry import Twist
from webmap.base.outline import Point
from webmap.config.motion import ScanAssistConfig
from webmap.gate.events import Scan
from webmap.gate.rules import scan_geometry
from webmap.gate.rules.aliases import Aliases
from webmap.gate.rules.scan_geometry import (
    ScanDirections,
    looks_ahead,
    time_straight,
    time_turning,
)

FRESH = 0.3
"""The greatest age of a scan that counts, in seconds since it arrived."""

KNOWN = 0.5
"""The least share of known rays among the rays towards the motion."""

REACTION = 0.2
"""Seconds after a scan during which the robot still moves as before."""

_SECTOR = math.radians(60)
_STRAIGHT = 1e-4
_ON_THE_SPOT = 1e-6
_ROUNDING = 1e-9


class AllowedShare(msgspec.Struct, frozen=True):
    """The share of a commanded velocity that scan assist allows."""

    scale: float
    """Between 0 and 1."""
    why: str | None
    """The reason as text, if the share is less than 1."""


FREE = AllowedShare(1.0, None)


def assist(
    spec: ScanAssistConfig, sweep: Scan | None, wanted: Twist, now: float
) -> AllowedShare:
    """Return the share of a velocity that the scan allows.

    Args:
        spec: The robot and its scanner.
        sweep: The newest scan, if there is one.
        wanted: The commanded velocity.
        now: The time, on the clock of ``sweep.arrived``.

    """
    speed = _reach_speed(spec, wanted)
    if speed == 0.0:
        return FREE
    if sweep is not None and spec.upside_down:
        sweep = _turned_over(sweep)
    if reason := _blindness(spec, sweep, wanted, now):
        return _blind(spec, speed, reason)
    assert sweep is not None
    points = points_of(spec, sweep, _horizon(spec, speed))
    gap = free_way(spec.corners, points, wanted) * speed
    room = gap - spec.stop_distance - REACTION * speed
    allowed = math.sqrt(2 * spec.brake * room) if room > 0 else 0.0
    if allowed >= speed:
        return FREE
    return AllowedShare(allowed / speed, f"scan assist: obstacle {gap:.1f} m away")


def points_of(
    spec: ScanAssistConfig, sweep: Scan, within: float = math.inf
) -> list[Point]:
    """Return the hits of a scan in the robot's frame, without hits of its own body.

    Args:
        spec: The robot and its scanner.
        sweep: The scan; a folded beam gives at most one point.
        within: The greatest distance of a point from the robot's origin, in metres.

    """
    place, corners = spec.sensor, spec.corners
    far = within + math.hypot(place[0], place[1])
    points = []
    for ray, reach in enumerate(sweep.ranges):
        if reach > far:
            continue
        point = _point(place, corners, sweep, ray, reach)
        if point is None and sweep.fold is not None:
            # The nearest hit may be the robot's own body: look behind it.
            ranges = sweep.fold.behind[ray]
            behind = (_point(place, corners, sweep, ray, each) for each in ranges)
            point = next((there for there in behind if there is not None), None)
        if point is not None and math.hypot(*point) <= within:
            points.append(point)
    return points


def _point(
    place: tuple[float, float, float],
    corners: Sequence[Point],
    sweep: Scan,
    ray: int,
    reach: float,
) -> Point | None:
    """Return the hit of a ray; ``None`` for no hit, or one of the robot's own body."""
    if reach == -math.inf:
        reach = max(sweep.range_min, 0.0)
    elif not (sweep.range_min <= reach < math.inf):
        # A hit beyond range_max counts: range_max may be wrong or missing.
        return None
    x0, y0, yaw0 = place
    bearing = yaw0 + sweep.angle_min + ray * sweep.angle_increment
    point = (x0 + reach * math.cos(bearing), y0 + reach * math.sin(bearing))
    return None if inside(corners, point) else point


def free_way(
    footprint: Sequence[Point], points: Iterable[Point], twist: Twist
) -> float:
    """Return the time in seconds until the footprint touches the first point.

    Args:
        footprint: Its corners, in the robot's frame, in metres.
        points: In the same frame, none inside the footprint.
        twist: The motion, which stays the same.

    Returns:
        Infinity if it touches no point, or none within one turn if it turns.

    """
    edges = list(zip(footprint, (*footprint[1:], footprint[0]), strict=True))
    if abs(twist.wz) < _STRAIGHT:
        times = (
            time_straight(point, edge, twist) for point in points for edge in edges
        )
    else:
        center = (-twist.vy / twist.wz, twist.vx / twist.wz)
        times = (
            time_turning(point, edge, center, twist.wz)
            for point in points
            for edge in edges
        )
    return min(times, default=math.inf)


def inside(corners: Sequence[Point], point: Point) -> bool:
    """Return whether a point lies within a polygon."""
    x, y = point
    odd = False
    for (ax, ay), (bx, by) in zip(corners, (*corners[1:], corners[0]), strict=True):
        if (ay > y) != (by > y) and x < ax + (y - ay) / (by - ay) * (bx - ax):
            odd = not odd
    return odd


def _turned_over(sweep: Scan) -> Scan:
    """Return the scan of an upside-down scanner as if the scanner was upright."""
    return msgspec.structs.replace(
        sweep,
        angle_min=-sweep.angle_min,
        angle_increment=-sweep.angle_increment,
    )


def _reach_speed(spec: ScanAssistConfig, twist: Twist) -> float:
    """Return an upper bound of the speed of every corner, in metres per second."""
    return math.hypot(twist.vx, twist.vy) + abs(twist.wz) * _outer(spec)


def _horizon(spec: ScanAssistConfig, speed: float) -> float:
    """Return the greatest distance from the origin at which a point matters.

    No part of the robot moves faster than ``speed``, so it stops before a point that is
    farther from its outline than the stopping distance at that speed.
    """
    length = REACTION * speed + speed * speed / (2 * spec.brake) + spec.stop_distance
    return (_outer(spec) + length) * (1 + _ROUNDING) + _ROUNDING


def _outer(spec: ScanAssistConfig) -> float:
    return max(math.hypot(x, y) for x, y in spec.corners)


def _blindness(
    spec: ScanAssistConfig, sweep: Scan | None, wanted: Twist, now: float
) -> str | None:
    if sweep is None:
        return "no scan yet"
    age = now - sweep.arrived
    if not 0 <= age <= FRESH:
        return f"the scan is {age:.1f} s old"
    if spec.frame and sweep.frame != spec.frame:
        named = f"frame {sweep.frame!r}" if sweep.frame else "no frame"
        return f"the scan has {named}, expected {spec.frame!r}"
    if sweep.refused is not None:
        return sweep.refused
    step = sweep.angle_increment
    if not (math.isfinite(sweep.angle_min) and math.isfinite(step) and step != 0.0):
        return "the scan has no angles"
    towards = _rays_towards(spec, sweep, wanted)
    known, total = scan_geometry.known(sweep, towards)
    if not total:
        return "the scan does not cover the direction of motion"
    if known < KNOWN * total:
        return "most of the scan is unknown"
    if not _covers_path(spec, sweep, wanted):
        return "the scan covers only a part of the path"
    return None


def _covers_path(spec: ScanAssistConfig, sweep: Scan, wanted: Twist) -> bool:
    """Return whether the scan covers the robot's path until it could stop."""
    fan = _fan(sweep)
    speed = math.hypot(wanted.vx, wanted.vy)
    if speed < _ON_THE_SPOT:
        return fan.share >= KNOWN
    length = REACTION * speed + speed * speed / (2 * spec.brake) + spec.stop_distance
    return looks_ahead(
        fan, spec.corners, spec.sensor, wanted, length / speed, spec.stop_distance
    )


def _fan(sweep: Scan) -> ScanDirections:
    """Return the directions of the scanner's rays, also of a folded scan."""
    if (fold := sweep.fold) is not None:
        return ScanDirections(
            sweep.angle_min, sweep.angle_increment / fold.each, fold.beams
        )
    return ScanDirections(sweep.angle_min, sweep.angle_increment, len(sweep.ranges))


def _rays_towards(spec: ScanAssistConfig, sweep: Scan, wanted: Twist) -> Sequence[int]:
    """Return the rays towards the motion; all rays if it turns on the spot."""
    rays = range(len(sweep.ranges))
    if math.hypot(wanted.vx, wanted.vy) < _ON_THE_SPOT:
        return rays
    ahead = math.atan2(wanted.vy, wanted.vx) - spec.sensor[2]
    first, step = sweep.angle_min - ahead, sweep.angle_increment
    return [
        ray
        for ray in rays
        if abs(math.remainder(first + ray * step, math.tau)) <= _SECTOR
    ]


def _blind(spec: ScanAssistConfig, speed: float, reason: str) -> AllowedShare:
    why = f"scan assist: {reason}"
    if spec.blind == "stop":
        return AllowedShare(0.0, why)
    return FREE if speed <= spec.creep else AllowedShare(spec.creep / speed, why)


MIXED = 2.0
"""Seconds for which no scan of a topic counts after its frame changed."""


class ScanAssist:
    """Keeps the newest scans of one machine and slows it down before obstacles.

    Args:
        robots: The robots that are declared for the machine; each may have a scanner.

    """

    def __init__(self, robots: Aliases) -> None:
        self._robots = robots
        self._sweeps: dict[str, Scan] = {}
        self._changed: dict[str, float] = {}
        """When the frame of a topic's scans last changed."""
        self._verdict = FREE

    @property
    def why(self) -> tuple[str, ...]:
        """Why the last command was slowed down, as text."""
        return () if self._verdict.why is None else (self._verdict.why,)

    def observe(self, topic: str, sweep: Scan) -> None:
        """Note a scan; if two scanners publish to the topic, no scan of it counts."""
        before = self._sweeps.get(topic)
        if before is not None and before.frame != sweep.frame:
            self._changed[topic] = sweep.arrived
        changed = self._changed.get(topic)
        if changed is not None and sweep.arrived - changed < MIXED:
            sweep = msgspec.structs.replace(
                sweep, refused="the scans have two different frames"
            )
        self._sweeps[topic] = sweep

    def forget(self) -> None:
        """Forget all scans: the gate no longer subscribes to them."""
        self._sweeps.clear()
        self._changed.clear()
        self._verdict = FREE

    def limit(self, wanted: Twist, now: float) -> Twist:
        """Return the velocity that the scans of all robots allow."""
        verdict = min(
            (
                assist(about, self._sweeps.get(about.topic), wanted, now)
                for spec in self._robots.specs.values()
                if (about := spec.scan_assist) is not None
            ),
            key=_scale,
            default=FREE,
        )
        self._verdict = verdict
        if verdict.scale >= 1.0:
            return wanted
        s = verdict.scale
        return Twist(*(s * part for part in wanted.numbers))


def _scale(verdict: AllowedShare) -> float:
    return verdict.scale
