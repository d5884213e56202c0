"""The geometry of scan assist: scans, footprints and paths. No I/O.

The gate evaluates a scan with every command, and all its robots wait for that. So a
dense scan is folded once, on arrival. A beam of the fold replaces the beams up to its
neighbours on either side: it has the shortest range among them. So each hit of the scan
lies on a beam of the fold, or between two beams with ranges at most as long: a hit can
move aside, at a range r by less than r times the fold's step, but only to both sides at
once, and never out of the path of a robot that is wider than that. The free space
beside a hit looks narrower by as much: with 720 beams or more all around, less than a
degree.

Hits of the robot's own body are left out only when the scan is evaluated. Other hits of
the same beam of the fold may lie behind such a hit: the nearest hits of the next three
things, each more than two centimetres behind the one before it, are kept too.

A scanner that looks forward through a slit sees nothing beside the slit. So each place
that the footprint is about to reach is checked: does any ray point there? Places within
the stop distance of the robot's front are left out: they were farther ahead a moment
ago, and most scanners cannot see their own bumper.

All coordinates are in the robot's own frame, in which the points move.
"""

import math
from collections.abc import Iterator, Sequence

import msgspec

from webmap.base.geometry import Twist
from webmap.base.outline import Point
from webmap.gate.events import Scan, ScanFold

MOST = 720
"""The most beams of a folded scan."""

LIMIT = 100_000
"""The most beams of a scan that is accepted."""

DEPTH = 0.02
"""Metres behind a hit beyond which the next hit is of another thing."""

_THINGS = 4
_MOST_TURNS = 2.0


def folded(sweep: Scan) -> Scan:
    """Return a scan of at most 720 beams with no range longer than in ``sweep``.

    A scan of more than 100,000 beams, or a dense scan of more than two turns, is
    returned without ranges and with the reason in ``refused``.
    """
    count = len(sweep.ranges)
    if count <= MOST:
        return sweep
    if reason := _refusal(count, sweep.angle_increment):
        return _without(sweep, reason)
    each = math.ceil((count - 1) / (MOST - 1))
    return _folded(sweep, each)


def too_long(count: int) -> str | None:
    """Return why a scan of ``count`` beams is refused, as text, or ``None``."""
    if count <= LIMIT:
        return None
    return f"the scan has {count} beams, more than {LIMIT}"


def _refusal(count: int, step: float) -> str | None:
    if abs(step) * count > _MOST_TURNS * math.tau:
        return f"the {count} beams of the scan cover more than two turns"
    return too_long(count)


def _without(sweep: Scan, reason: str) -> Scan:
    return msgspec.structs.replace(sweep, ranges=(), refused=reason)


def _folded(sweep: Scan, each: int) -> Scan:
    ranges, near = sweep.ranges, sweep.range_min
    first, behind, known, total = [], [], [], []
    before: list[float] = []
    for start in range(0, len(ranges) + each - 1, each):
        group = ranges[start : start + each]
        answered = _known_count(group, near)
        hits = _hits(group, near)
        nearest, *others = _things([*before, *hits]) or (math.inf,)
        unknown = nearest == math.inf and 2 * answered < len(group)
        first.append(math.nan if unknown else nearest)
        behind.append(others)
        known.append(answered)
        total.append(len(group))
        # The beam at the position of the fold's beam is no neighbour of the next one.
        before = hits[1:] if _hits(group[:1], near) else hits
    return msgspec.structs.replace(
        sweep,
        angle_increment=sweep.angle_increment * each,
        ranges=first,
        fold=ScanFold(each, len(ranges), behind, known, total),
    )


def _hits(group: Sequence[float], near: float) -> list[float]:
    """Return the hits of beams; ``-inf``, too near to measure, is a hit."""
    return [r for r in group if near <= r < math.inf or r == -math.inf]


def _known_count(group: Sequence[float], near: float) -> int:
    return sum([_is_known(r, near) for r in group])


def known(sweep: Scan, rays: Sequence[int]) -> tuple[int, int]:
    """Return the number of known rays among ``rays``, and the number of all of them.

    In a folded scan, the rays before the fold are counted.
    """
    if (fold := sweep.fold) is not None:
        count = sum(fold.known[ray] for ray in rays)
        return count, sum(fold.total[ray] for ray in rays)
    return _known_count([sweep.ranges[ray] for ray in rays], sweep.range_min), len(rays)


def _is_known(reach: float, near: float) -> bool:
    """Return whether a beam is known, also if it hit nothing."""
    # A covered scanner reports less than range_min; a driver reports -inf on purpose.
    return math.isinf(reach) or reach >= max(near, 1e-6)


def _things(hits: list[float]) -> list[float]:
    """Return the nearest hit of each of the nearest four things, nearest first."""
    found: list[float] = []
    while hits and len(found) < _THINGS:
        nearest = min(hits)
        found.append(nearest)
        hits = [hit for hit in hits if hit > nearest + DEPTH]
    return found


_STEP = 0.1
"""Metres, or radians of a turn, between two checked places on the path."""

_MOST_STEPS = 40
_STRAIGHT = 1e-6


class ScanDirections:
    """The directions in which a scan has rays.

    Args:
        first: The angle of the first ray, in radians.
        step: The angle from one ray to the next, in radians; may be negative.
        count: The number of rays.

    """

    def __init__(self, first: float, step: float, count: int) -> None:
        self._width = abs(step) * (count - 1)
        self._low = first if step > 0 else first - self._width
        self._slack = abs(step)

    @property
    def share(self) -> float:
        """The share of the full circle that the rays cover, from 0 to 1."""
        return min(1.0, (self._width + self._slack) / math.tau)

    def covers(self, bearing: float) -> bool:
        """Return whether a ray points there, or two rays lie on either side."""
        beyond = (bearing - self._low + self._slack) % math.tau
        return beyond <= self._width + 2 * self._slack


def looks_ahead(
    fan: ScanDirections,
    footprint: Sequence[Point],
    sensor: tuple[float, float, float],
    twist: Twist,
    seconds: float,
    margin: float,
) -> bool:
    """Return whether the scan covers every place that the robot is about to reach.

    Args:
        fan: The directions of the rays, from the scanner's own x axis.
        footprint: The robot's corners in its own frame, in metres.
        sensor: The pose of the scanner: x, y in metres, yaw in radians.
        twist: The robot's velocity; not a turn on the spot.
        seconds: The duration of the motion.
        margin: Metres before the robot's front that need not be covered.

    """
    x0, y0, yaw = sensor
    return all(
        fan.covers(math.atan2(y - y0, x - x0) - yaw)
        for x, y in _path_places(footprint, twist, seconds, margin)
    )


def _path_places(
    footprint: Sequence[Point], twist: Twist, seconds: float, margin: float
) -> Iterator[Point]:
    """Yield the places ahead that the outline reaches."""
    speed = math.hypot(twist.vx, twist.vy)
    ahead = (twist.vx / speed, twist.vy / speed)
    front = max(x * ahead[0] + y * ahead[1] for x, y in footprint) + margin
    outline = list(_outline(footprint))
    length = max(speed, abs(twist.wz)) * seconds
    steps = min(_MOST_STEPS, max(1, math.ceil(length / _STEP)))
    for step in range(1, steps + 1):
        moved = _moved(outline, twist, seconds * step / steps)
        for x, y in moved:
            if x * ahead[0] + y * ahead[1] >= front:
                yield x, y


def _outline(footprint: Sequence[Point]) -> Iterator[Point]:
    """Yield the corners, and the middles between them."""
    for (ax, ay), (bx, by) in zip(
        footprint, (*footprint[1:], footprint[0]), strict=True
    ):
        yield ax, ay
        yield (ax + bx) / 2, (ay + by) / 2


def _moved(points: Sequence[Point], twist: Twist, seconds: float) -> Iterator[Point]:
    """Yield the positions of points of the robot after ``seconds``."""
    turned = twist.wz * seconds
    if abs(turned) < _STRAIGHT:
        dx, dy = twist.vx * seconds, twist.vy * seconds
    else:
        s, c = math.sin(turned) / twist.wz, (1.0 - math.cos(turned)) / twist.wz
        dx, dy = twist.vx * s - twist.vy * c, twist.vx * c + twist.vy * s
    sin, cos = math.sin(turned), math.cos(turned)
    for x, y in points:
        yield dx + cos * x - sin * y, dy + sin * x + cos * y


_TOUCHING = 1e-9


def time_straight(point: Point, edge: tuple[Point, Point], twist: Twist) -> float:
    """Return the time until a point with the velocity ``-twist`` crosses an edge."""
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
    """Return the time until a point on a circle crosses an edge.

    Args:
        point: The point.
        edge: The two ends of the edge.
        center: The centre of the circle.
        turn: The robot's rate of turn; the point moves at ``-turn``.

    """
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
