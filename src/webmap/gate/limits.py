"""How fast a machine may go now, and why not faster.

Every reason to be slow is a :class:`Cap`; the least of them is in force. A further
reason (latency, scan assist) is one more cap in the list.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from webmap.base.geometry import Twist
from webmap.gate.events import StopRecord
from webmap.gate.protocol import RobotSpec

Vector = tuple[float, float, float]

SLOW_V = 0.3
"""Metres per second for a machine of which too little is known (S9)."""

SLOW_W = 0.6
"""Radians per second for a machine of which too little is known (S9)."""

STOPS_WITHIN = 0.5
"""A base that stops by itself within this time, in seconds, may go faster (S12)."""


@dataclass(frozen=True, slots=True)
class Axes:
    """How fast a machine may move out of the plane, axis by axis.

    An axis that nobody states a limit for has 0: the machine does not move along it.
    """

    z: float = 0.0
    """Metres per second upward and downward."""

    rx: float = 0.0
    """Radians per second about the forward axis."""

    ry: float = 0.0
    """Radians per second about the left axis."""

    def refusal(self, twist: Twist) -> str | None:
        """Return why the machine cannot be told ``twist``, in words, or ``None``."""
        for axis, wanted, unit, limit in (
            ("z", twist.vz, "m/s", self.z),
            ("rx", twist.wx, "rad/s", self.rx),
            ("ry", twist.wy, "rad/s", self.ry),
        ):
            if wanted != 0 and limit == 0:
                return (
                    f"got {axis} = {wanted:g} {unit}, but no limit of the robot is "
                    f"known for {axis}: state {axis}_max with its twist topic"
                )
        return None

    def seen(self, measured: Twist | None) -> Twist | None:
        """Return what odometry says of the axes that the machine moves along.

        Args:
            measured: The velocity that it tells, if it tells one.

        Returns:
            ``None`` if it tells no finite number for one of those axes.

        """
        if measured is None:
            return None
        seen = Twist(
            measured.vx,
            measured.vy,
            measured.wz,
            measured.vz if self.z else 0.0,
            measured.wx if self.rx else 0.0,
            measured.wy if self.ry else 0.0,
        )
        return seen if seen.is_finite else None


PLANE = Axes()
"""The axes of a machine that moves in the plane alone."""


def axes_of(specs: Iterable[RobotSpec]) -> Axes:
    """Return the axes of a machine that everybody states a limit for, and the least.

    Args:
        specs: The robots that are the machine.

    """
    limits = [
        (spec.z_max or 0.0, spec.rx_max or 0.0, spec.ry_max or 0.0) for spec in specs
    ]
    return Axes(*map(min, zip(*limits, strict=True)))


@dataclass(frozen=True, slots=True)
class Cap:
    """One upper bound: metres and radians per second, and its reason in words."""

    v: float
    w: float
    why: str


@dataclass(frozen=True, slots=True)
class Speed:
    """The speeds in force and the reasons that bind them."""

    v: float
    w: float
    why: tuple[str, ...]


def caps_of(spec: RobotSpec, tested: StopRecord | None = None) -> list[Cap]:
    """Return what the robot itself does not allow to exceed.

    Args:
        spec: The robot.
        tested: What its stop test found; that counts more than what was stated.

    """
    caps = []
    seconds = spec.stops_within if tested is None else tested.seconds
    if seconds is None and tested is not None:
        why = f"stop test failed on {tested.date}"
        caps.append(Cap(SLOW_V, SLOW_W, why))
    elif seconds is None:
        caps.append(Cap(SLOW_V, SLOW_W, "stop not verified"))
    elif seconds > STOPS_WITHIN:
        why = f"command timeout of the base over {STOPS_WITHIN:g} s: {seconds:g} s"
        caps.append(Cap(SLOW_V, SLOW_W, why))
    v = math.inf if spec.v_max is None else spec.v_max
    w = math.inf if spec.w_max is None else spec.w_max
    caps.append(Cap(v, w, "limit of the robot"))
    return caps


def page_cap(v: float = math.inf, w: float = math.inf) -> Cap:
    """Return what a page asks for at most; nonsense means standstill."""
    return Cap(v if v >= 0 else 0.0, w if w >= 0 else 0.0, "limit of the page")


def least(caps: Iterable[Cap]) -> Speed:
    """Return the least of ``caps``; infinity where none of them says anything."""
    caps = list(caps)
    v = min((cap.v for cap in caps), default=math.inf)
    w = min((cap.w for cap in caps), default=math.inf)
    why = dict.fromkeys(
        cap.why
        for cap in caps
        if (cap.v == v and v < math.inf) or (cap.w == w and w < math.inf)
    )
    return Speed(v, w, tuple(why))


def in_force(speed: Speed) -> Speed:
    """Return ``speed``, or what is slow where it says nothing."""
    if math.inf not in (speed.v, speed.w):
        return speed
    v, w = min(speed.v, SLOW_V), min(speed.w, SLOW_W)
    return Speed(v, w, (*speed.why, "no limit stated"))


def speed_in_force(caps: Iterable[Cap]) -> Speed:
    """Return the least of ``caps``; slow where none of them says anything."""
    return in_force(least(caps))


def offered(own: Speed, page: Cap) -> Speed:
    """Return the speeds that would be in force if a page took a free robot.

    Args:
        own: What the robot allows by itself, perhaps without end.
        page: What the page asks for at most.

    """
    v, w = min(own.v, page.v), min(own.w, page.w)
    binds = (own.v == v and v < math.inf) or (own.w == w and w < math.inf)
    why = own.why if binds else ()
    if page.v < own.v or page.w < own.w:
        why = (*why, page.why)
    return in_force(Speed(v, w, why))


def fit(wanted: Twist, speed: Speed, *, holonomic: bool, axes: Axes = PLANE) -> Twist:
    """Return ``wanted`` within ``speed`` and ``axes``, in the same direction.

    Args:
        wanted: A velocity of finite numbers.
        speed: The speeds in force, whatever the direction.
        holonomic: Whether the base can move sideways; if not, ``vy`` is exactly 0.
        axes: The limits of the axes that lead out of the plane. A velocity along an
            axis that has none becomes zero as a whole.

    """
    vx, vy = wanted.vx, wanted.vy if holonomic else 0.0
    vx, vy, vz = _within((vx, vy, wanted.vz), speed.v, (math.inf, math.inf, axes.z))
    wx, wy, wz = _within(
        (wanted.wx, wanted.wy, wanted.wz), speed.w, (axes.rx, axes.ry, math.inf)
    )
    return Twist(vx, vy, wz, vz, wx, wy)


def _within(parts: Vector, most: float, each: Vector) -> Vector:
    """Return ``parts``, shortened until its length and each part are small enough.

    A velocity along one axis is clamped exactly, without rounding. No quotient here is
    larger than 1: with an infinity a zero would make a NaN.
    """
    length = math.hypot(*parts)
    found = list(parts)
    if length > most:
        found = [part / length * most for part in parts]
    for axis, limit in enumerate(each):
        if abs(found[axis]) > limit:
            shorter = limit / abs(found[axis])
            clamped = math.copysign(limit, found[axis])
            found = [part * shorter for part in found]
            found[axis] = clamped
    x, y, z = (part + 0.0 for part in found)  # no negative zeros on the wire
    return (x, y, z)


def ramp(last: Twist, wanted: Twist, a_max: float, elapsed: float) -> Twist:
    """Return ``wanted`` or, if that speeds up too much, what is allowed of it.

    Slowing down is never held back; turning round counts as speeding up from
    standstill. The turning rates are not ramped.

    Args:
        last: What was written last.
        wanted: What is wanted now.
        a_max: Greatest growth of the speed, in m/s², along each axis and in all.
        elapsed: Seconds since ``last`` was written.

    """
    step = a_max * elapsed
    vx, vy = _towards(last.vx, wanted.vx, step), _towards(last.vy, wanted.vy, step)
    vz = _towards(last.vz, wanted.vz, step)
    allowed, length = last.speed + step, math.hypot(vx, vy, vz)
    if (vx, vy, vz).count(0.0) < 2 and length > allowed:  # aslant, on several axes
        vx, vy, vz = (part / length * allowed for part in (vx, vy, vz))
    return Twist(vx, vy, wanted.wz, vz, wanted.wx, wanted.wy)


def _towards(last: float, wanted: float, step: float) -> float:
    base = abs(last) if last * wanted > 0 else 0.0
    return math.copysign(min(abs(wanted), base + step), wanted)
