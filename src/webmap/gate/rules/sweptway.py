"""Whether a scan looks everywhere where a robot is about to go. No I/O.

A scanner that looks forward through a slit says nothing of what stands beside the
slit. So the places that the footprint is about to come to are asked for one by one:
does any ray look there? What is within the stop distance of the robot's front is left
out: it was farther ahead a moment ago, and most scanners cannot see their own bumper.
"""

import math
from collections.abc import Iterator, Sequence

from webmap.base.geometry import Twist
from webmap.gate.messages import Point

_STEP = 0.1
"""Metres, or radians of a turn, between two places on the way that are asked for."""

_MOST_STEPS = 40
_STRAIGHT = 1e-6


class Fan:
    """The directions that a scan has rays in.

    Args:
        first: The angle of the first ray, in radians.
        step: From one ray to the next, which may be negative.
        count: How many there are.

    """

    def __init__(self, first: float, step: float, count: int) -> None:
        self._width = abs(step) * (count - 1)
        self._low = first if step > 0 else first - self._width
        self._slack = abs(step)

    @property
    def share(self) -> float:
        """How much of the full circle it covers, from 0 to 1."""
        return min(1.0, (self._width + self._slack) / math.tau)

    def covers(self, bearing: float) -> bool:
        """Return whether a ray looks there, or two on either side of it."""
        beyond = (bearing - self._low + self._slack) % math.tau
        return beyond <= self._width + 2 * self._slack


def looks_ahead(
    fan: Fan,
    footprint: Sequence[Point],
    sensor: tuple[float, float, float],
    twist: Twist,
    seconds: float,
    margin: float,
) -> bool:
    """Return whether the fan covers every place where the robot is about to go.

    Args:
        fan: What the scanner looks at, from its own x.
        footprint: The robot's corners in its own frame, in metres.
        sensor: Where the scanner is: x, y in metres, yaw in radians.
        twist: How the robot goes on; not on the spot.
        seconds: For how long it is asked.
        margin: Metres before the robot's front that need not be seen.

    """
    x0, y0, yaw = sensor
    return all(
        fan.covers(math.atan2(y - y0, x - x0) - yaw)
        for x, y in _way(footprint, twist, seconds, margin)
    )


def _way(
    footprint: Sequence[Point], twist: Twist, seconds: float, margin: float
) -> Iterator[Point]:
    """Go through the places ahead that the outline comes to."""
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
    """Go through the corners, and the middles between them."""
    for (ax, ay), (bx, by) in zip(
        footprint, (*footprint[1:], footprint[0]), strict=True
    ):
        yield ax, ay
        yield (ax + bx) / 2, (ay + by) / 2


def _moved(points: Sequence[Point], twist: Twist, seconds: float) -> Iterator[Point]:
    """Go through where points of the robot are after some time."""
    turned = twist.wz * seconds
    if abs(turned) < _STRAIGHT:
        dx, dy = twist.vx * seconds, twist.vy * seconds
    else:
        s, c = math.sin(turned) / twist.wz, (1.0 - math.cos(turned)) / twist.wz
        dx, dy = twist.vx * s - twist.vy * c, twist.vx * c + twist.vy * s
    sin, cos = math.sin(turned), math.cos(turned)
    for x, y in points:
        yield dx + cos * x - sin * y, dy + sin * x + cos * y
