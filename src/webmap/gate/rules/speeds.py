"""The speed limits in force for one machine, and the age of the control loop. No I/O.

An operator reacts only to what the page shows. So over a slow link, a robot moves at
most a quarter of a metre in the worst time from an input to its effect on the wheels:
the age of the loop, the dead-man timeout, and the base's own time to stop (S15). Over a
fast link, only the limits of the robot and of the page apply.
"""

import math

from webmap.gate.events import StopRecord
from webmap.gate.rules.aliases import Aliases
from webmap.gate.rules.check import PreDriveCheck
from webmap.gate.rules.health import Ages, LinkHealth
from webmap.gate.rules.motion import DEADMAN, MotionLimits
from webmap.gate.specs import (
    STOPS_WITHIN,
    Cap,
    Speed,
    caps_of,
    least,
    page_cap,
    speed_in_force,
)

SLOW = 0.15
"""The age in seconds above which a loop is slow: the speed limit is lower, and the page
shows why."""

QUICK = 0.13
"""The age in seconds below which it is no longer slow (hysteresis)."""

BLIND = 0.25
"""Metres that a robot may move before an operator's reaction takes effect."""


class LoopAge:
    """The age of the control loop: page to gate, and gate to bridge, both ways.

    The first part is the age of the ticks that the holder's accepted commands echo. The
    second is part of the loop because the data that a page shows came from the robot,
    and the command has yet to get there.

    Args:
        trips: The round trips of pings to the robot's bridge.

    """

    def __init__(self, trips: Ages) -> None:
        self._ticks = Ages()
        self._trips = trips
        self._slow = False

    def add(self, age: float, now: float) -> None:
        """Add the age of a tick, in seconds."""
        self._ticks.add(age, now)

    def forget_old(self, now: float) -> None:
        """Drop ages older than two seconds."""
        self._ticks.forget_old(now)
        self._trips.forget_old(now)

    def clear(self) -> None:
        """Forget the ticks: another holder has another connection to the gate."""
        self._ticks.clear()

    @property
    def p95(self) -> float | None:
        """The age in seconds that 95 of 100 commands stay below, if any came."""
        age = self._ticks.p95
        return None if age is None else age + (self._trips.p95 or 0.0)

    @property
    def slow(self) -> float | None:
        """The same age if the loop is slow, else ``None``."""
        age = self.p95
        self._slow = age is not None and age > (QUICK if self._slow else SLOW)
        return age if self._slow else None


def reaction(age: float | None, stop_time: float | None) -> float:
    """Return the seconds from an operator's input to its effect, at worst.

    Args:
        age: The age of the loop in seconds, if it is known.
        stop_time: Seconds within which the base stops by itself, if known.

    """
    own = STOPS_WITHIN if stop_time is None else stop_time
    return (age or 0.0) + DEADMAN + own


def governed(speed: Speed, slow: float | None, stop_time: float | None) -> Speed:
    """Return ``speed``, reduced if the loop is slow.

    Args:
        speed: The speeds in force over a fast link.
        slow: The age of the loop in seconds, if it is slow.
        stop_time: Seconds within which the base stops by itself, if known.

    """
    if slow is None:
        return speed
    # Rounded, so that the limit does not change with every command.
    v = math.floor(100 * BLIND / reaction(slow, stop_time)) / 100
    why = f"slow connection: {math.ceil(slow * 100) * 10} ms"
    return Speed(min(v, speed.v), speed.w, (*speed.why, why))


class MachineSpeeds:
    """The speeds in force for one machine.

    Args:
        robots: The robots of the machine.
        control: The link that carries velocities.
        check: The check before driving.

    """

    def __init__(
        self, robots: Aliases, control: LinkHealth, check: PreDriveCheck
    ) -> None:
        self.ages = LoopAge(control.trips)
        """The age of the holder's control loop."""
        self.tested: StopRecord | None = None
        """The result of the last completed stop test, however old."""
        self.page_cap = page_cap()
        """The speed limit that the holder's page asks for."""
        self._robots = robots
        self._check = check

    @property
    def own(self) -> Speed:
        """The robot's own limits, for every holder; infinity where it states none."""
        return least(self._caps())

    def _caps(self) -> list[Cap]:
        bases = self._robots.bases
        own = [cap for base in bases for cap in caps_of(base, self.tested)]
        return own + self._check.caps

    @property
    def speed(self) -> Speed:
        """The lowest of all limits, in m/s and rad/s, less over a slow connection."""
        speed = speed_in_force([*self._caps(), self.page_cap])
        return governed(speed, self.ages.slow, self.stop_time)

    @property
    def stop_time(self) -> float | None:
        """Seconds within which the machine stops by itself, if known."""
        if self.tested is not None:
            return self.tested.seconds
        return self._robots.stops_within

    def bounds(self) -> MotionLimits:
        """Return the limits that apply now."""
        robots = self._robots
        return MotionLimits(self.speed, robots.a_max, robots.holonomic, robots.axes)
