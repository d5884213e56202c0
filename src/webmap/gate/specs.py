"""The declaration of a robot: its check, its machine, and its speed limits.

:mod:`webmap.config` has the checks of its parts: the gate makes them again, because it
trusts no message. Every limit is a :class:`Cap`; the least cap is in force. A further
reason (latency, scan assist) is one more cap in the list.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import msgspec
from msgspec import structs

from webmap.base.errors import ConfigError
from webmap.base.geometry import Twist
from webmap.config.checks import Mistakes
from webmap.config.motion import MOTION, WRITING, MotionConfig, TwistConfig
from webmap.config.reading import read
from webmap.gate.events import Key, StopRecord
from webmap.gate.protocol import RobotSpec
from webmap.ros.names import (
    has_gate,
    normalise_topic,
    normalise_url,
    same_type,
    split_type,
)

Vector = tuple[float, float, float]

SLOW_V = 0.3
"""The slow speed in m/s: without a stated limit or without a verified stop (S9)."""

SLOW_W = 0.6
"""The slow rate of turn in rad/s: without a stated limit or a verified stop (S9)."""

STOPS_WITHIN = 0.5
"""The longest command timeout of a base, in seconds, for more than slow speed (S12)."""

ERROR = 0.15
"""The most seconds that a stop test may measure too long: odometry at 10 Hz, and 50 ms
to the base and back."""


def checked(spec: RobotSpec) -> RobotSpec:
    """Return ``spec`` with its addresses and topics resolved.

    Its parts are read as those of a fleet file are, with every check of their values.

    Raises:
        ConfigError: If a value is invalid.

    """
    if not spec.id or len(spec.id) > 64 or not spec.id.isprintable() or spec.id == "*":
        raise ConfigError(f"a robot's id is a short plain text, got {spec.id!r}")
    mistakes = Mistakes()
    given = {key: msgspec.to_builtins(getattr(spec, key)) for key in MOTION}
    motion = read(MotionConfig, given, (), mistakes)
    mistakes.refuse(f"robot {spec.name!r}")
    assert motion is not None, "it is a table"
    return resolved(structs.replace(spec, **structs.asdict(motion)))


def resolved(spec: RobotSpec) -> RobotSpec:
    """Return ``spec`` with its addresses resolved; its parts are valid.

    Raises:
        ConfigError: If the gate cannot move robots behind an address, or another value
            is invalid.

    """
    try:
        return _resolved(spec)
    except ConfigError as error:
        raise ConfigError(f"robot {spec.name!r}: {error}") from None


def _resolved(spec: RobotSpec) -> RobotSpec:
    if not all(map(math.isfinite, spec.own_map)):
        raise ConfigError(
            f"its own map lies on the common one by finite numbers, got {spec.own_map}"
        )
    if spec.odometry_type:
        split_type(spec.odometry_type)
    parts: dict[str, Any] = {}
    for key in WRITING:
        part = getattr(spec, key)
        if part is not None:
            url = normalise_url(part.bridge)
            if not has_gate(url):
                raise ConfigError(
                    f"the gate cannot move robots behind {url}; they can only be "
                    "watched"
                )
            parts[key] = structs.replace(part, bridge=url)
    if not parts:
        raise ConfigError(
            f"nothing moves it: expected one of the parts {', '.join(WRITING)}"
        )
    if spec.scan_assist is not None:  # a radius becomes corners, once
        corners = list(spec.scan_assist.corners)
        parts["scan_assist"] = structs.replace(spec.scan_assist, footprint=corners)
    spec = structs.replace(spec, **parts)
    odometry = spec.odometry_url, spec.odometry_topic
    return structs.replace(
        spec,
        odometry_url=normalise_url(odometry[0]) if odometry[0] else spec.bridge_url,
        odometry_topic=normalise_topic(odometry[1]) if odometry[1] else None,
    )


def check_twist_type(spec: RobotSpec, others: Iterable[RobotSpec]) -> None:
    """Check that the velocity topic of a checked ``spec`` has one type for all robots.

    Raises:
        ConfigError: If another robot states another type for that topic.

    """
    if spec.twist is None or spec.twist_type_assumed:
        return
    for other in others:
        if (
            other.id != spec.id
            and not other.twist_type_assumed
            and key_of(other) == key_of(spec)
            and not same_type(other.twist_type, spec.twist_type)
        ):
            raise ConfigError(
                f"robot {spec.name!r}: got {spec.twist_type} for {spec.twist.topic}, "
                f"but robot {other.name!r} uses {other.twist_type} for this topic"
            )


def key_of(spec: RobotSpec) -> Key:
    """Return the key of the machine of a checked ``spec``.

    A robot without a velocity topic has the place of its goals as its key.
    """
    from webmap.gate.events import Key  # the display checks specs without the events

    if spec.twist is not None:
        return Key(spec.twist.bridge, spec.twist.topic)
    goal = spec.navigation.topic or spec.navigation.action or f"robot {spec.id}"
    return Key(spec.goal_url, f"goal {goal}")


@dataclass(frozen=True, slots=True)
class Axes:
    """The limits of motion out of the plane, axis by axis.

    An axis without a stated limit has 0: the machine does not move along it.
    """

    z: float = 0.0
    """Metres per second upward and downward."""

    rx: float = 0.0
    """Radians per second about the forward axis."""

    ry: float = 0.0
    """Radians per second about the left axis."""

    def refusal(self, twist: Twist) -> str | None:
        """Return why ``twist`` cannot be sent to the machine, as text, or ``None``."""
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
        """Return the measured velocity, reduced to the axes of the machine.

        Args:
            measured: The velocity in an odometry message, if it has one.

        Returns:
            ``None`` if the number of one of those axes is not finite.

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
"""The axes of a machine that moves only in the plane."""


def axes_of(bases: Iterable[TwistConfig]) -> Axes:
    """Return the least limit of each axis; 0 if one robot states no limit for it.

    Args:
        bases: The bases of the robots that are declared for the machine.

    """
    limits = [(b.z_max or 0.0, b.rx_max or 0.0, b.ry_max or 0.0) for b in bases]
    return Axes(*map(min, zip(*limits, strict=True)))


@dataclass(frozen=True, slots=True)
class Cap:
    """One speed limit: metres and radians per second, and its reason as text."""

    v: float
    w: float
    why: str


@dataclass(frozen=True, slots=True)
class Speed:
    """The speed limits in force and their reasons."""

    v: float
    w: float
    why: tuple[str, ...]


def caps_of(base: TwistConfig, tested: StopRecord | None = None) -> list[Cap]:
    """Return the caps of the robot itself.

    Args:
        base: The base of the robot.
        tested: The result of its stop test; it overrides the stated ``stops_within``.

    """
    caps = []
    seconds = base.stops_within if tested is None else tested.seconds
    error = 0.0 if tested is None else min(tested.error, ERROR)
    if seconds is None and tested is not None:
        why = f"stop test failed on {tested.date}"
        caps.append(Cap(SLOW_V, SLOW_W, why))
    elif seconds is None:
        caps.append(Cap(SLOW_V, SLOW_W, "stop not verified"))
    elif seconds - error > STOPS_WITHIN:
        why = f"command timeout of the base over {STOPS_WITHIN:g} s: {seconds:g} s"
        caps.append(Cap(SLOW_V, SLOW_W, why))
    v = math.inf if base.v_max is None else base.v_max
    w = math.inf if base.w_max is None else base.w_max
    caps.append(Cap(v, w, "limit of the robot"))
    return caps


def page_cap(v: float = math.inf, w: float = math.inf) -> Cap:
    """Return the cap that a page asks for; a negative or NaN limit becomes 0."""
    return Cap(v if v >= 0 else 0.0, w if w >= 0 else 0.0, "normal limit")


def least(caps: Iterable[Cap]) -> Speed:
    """Return the least of ``caps``; infinity if there is no limit."""
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
    """Return ``speed``, or slow speeds if one of its limits is infinite."""
    if math.inf not in (speed.v, speed.w):
        return speed
    v, w = min(speed.v, SLOW_V), min(speed.w, SLOW_W)
    return Speed(v, w, (*speed.why, "no limit stated"))


def speed_in_force(caps: Iterable[Cap]) -> Speed:
    """Return the least of ``caps``; slow speeds if a limit is missing."""
    return in_force(least(caps))


def offered(own: Speed, page: Cap) -> Speed:
    """Return the speeds that would be in force if a page took a free robot.

    Args:
        own: The limits of the robot itself, perhaps infinite.
        page: The limits that the page asks for.

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
            axis with the limit 0 becomes zero as a whole.

    """
    vx, vy = wanted.vx, wanted.vy if holonomic else 0.0
    vx, vy, vz = _within((vx, vy, wanted.vz), speed.v, (math.inf, math.inf, axes.z))
    wx, wy, wz = _within(
        (wanted.wx, wanted.wy, wanted.wz), speed.w, (axes.rx, axes.ry, math.inf)
    )
    return Twist(vx, vy, wz, vz, wx, wy)


def _within(parts: Vector, most: float, each: Vector) -> Vector:
    """Return ``parts``, shortened until its length and each part are within limits.

    A velocity along one axis is clamped exactly, without rounding. No quotient here is
    larger than 1: infinity times zero would be NaN.
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
    """Return ``wanted``, reduced if it accelerates too much.

    Slowing down is never limited; reversing counts as speeding up from standstill. The
    rates of turn are not ramped.

    Args:
        last: The velocity that was written last.
        wanted: The velocity that is wanted now.
        a_max: The greatest growth of the speed, in m/s², along each axis and in total.
        elapsed: Seconds since ``last`` was written.

    """
    step = a_max * elapsed
    vx, vy = _towards(last.vx, wanted.vx, step), _towards(last.vy, wanted.vy, step)
    vz = _towards(last.vz, wanted.vz, step)
    allowed, length = last.speed + step, math.hypot(vx, vy, vz)
    if (vx, vy, vz).count(0.0) < 2 and length > allowed:  # diagonal, on several axes
        vx, vy, vz = (part / length * allowed for part in (vx, vy, vz))
    return Twist(vx, vy, wanted.wz, vz, wanted.wx, wanted.wy)


def _towards(last: float, wanted: float, step: float) -> float:
    base = abs(last) if last * wanted > 0 else 0.0
    return math.copysign(min(abs(wanted), base + step), wanted)
