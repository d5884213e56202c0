"""The speed limits in force for one machine, and the age of the control loop. No I/O.

Nobody can react to what has not been seen yet. So over a slow link a robot is let go
no faster than what carries it a quarter of a metre in the time from a finger to its
wheels, at worst: the age of the loop, the dead-man, and the base's own time to stop
(S15). Over a quick link the robot's own limits are in force and nothing else.
"""

import math

from webmap.gate.events import StopRecord
from webmap.gate.limits import (
    STOPS_WITHIN,
    Cap,
    Speed,
    caps_of,
    least,
    page_cap,
    speed_in_force,
)
from webmap.gate.rules.aliases import Aliases
from webmap.gate.rules.health import Ages, LinkHealth
from webmap.gate.rules.motion import DEADMAN, Bounds

SLOW = 0.15
"""The age of a loop in seconds above which it is slow: it is told, and it counts."""

QUICK = 0.13
"""The age below which it is so no more; between the two nothing changes."""

BLIND = 0.25
"""Metres that a robot may go before anything that anybody does can take effect."""


class LoopAge:
    """The ages of the ticks that the holder's accepted commands echoed, and beyond.

    What a page shows came from the robot, and what it says has yet to go there. So the
    way to the robot and back is part of the loop as well.

    Args:
        trips: How long questions to the robot's bridge and answers are under way.

    """

    def __init__(self, trips: Ages) -> None:
        self._ticks = Ages()
        self._trips = trips
        self._slow = False

    def add(self, age: float, now: float) -> None:
        """Count one more tick; ``age`` in seconds."""
        self._ticks.add(age, now)

    def forget_old(self, now: float) -> None:
        """Look at the last two seconds only."""
        self._ticks.forget_old(now)
        self._trips.forget_old(now)

    def clear(self) -> None:
        """Forget the ticks: another driver has another way to the gate."""
        self._ticks.clear()

    @property
    def p95(self) -> float | None:
        """The age in seconds that 95 of 100 commands stay below, if any came."""
        age = self._ticks.p95
        return None if age is None else age + (self._trips.p95 or 0.0)

    @property
    def slow(self) -> float | None:
        """The same if the loop is slow, else None."""
        age = self.p95
        self._slow = age is not None and age > (QUICK if self._slow else SLOW)
        return age if self._slow else None


def reaction(age: float | None, stop_time: float | None) -> float:
    """Return the seconds from a finger to the robot, at worst.

    Args:
        age: The age of the loop in seconds, if it is known.
        stop_time: Seconds within which the base stops by itself, if that is known.

    """
    own = STOPS_WITHIN if stop_time is None else stop_time
    return (age or 0.0) + DEADMAN + own


def governed(speed: Speed, slow: float | None, stop_time: float | None) -> Speed:
    """Return ``speed``, or what a slow loop leaves of it.

    Args:
        speed: The speeds in force on a quick link.
        slow: The age of the loop in seconds, if it is slow.
        stop_time: Seconds within which the base stops by itself, if that is known.

    """
    if slow is None:
        return speed
    # Rounded, so that the speed in force does not tremble with every command.
    v = math.floor(100 * BLIND / reaction(slow, stop_time)) / 100
    why = f"slow connection: {math.ceil(slow * 100) * 10} ms"
    return Speed(min(v, speed.v), speed.w, (*speed.why, why))


class Speeds:
    """The speeds in force for one machine.

    Args:
        robots: The robots that it is.
        control: The link that velocity goes to.

    """

    def __init__(self, robots: Aliases, control: LinkHealth) -> None:
        self.ages = LoopAge(control.trips)
        """How old its driver's picture of it is."""
        self.tested: StopRecord | None = None
        """What the last stop test that came to an end found, whenever that was."""
        self.page_cap = page_cap()
        """What the page of its driver asks for at most."""
        self._robots = robots

    @property
    def own(self) -> Speed:
        """What the robot allows, whoever drives it; infinity where it says nothing."""
        return least(self._caps())

    def _caps(self) -> list[Cap]:
        specs = self._robots.specs.values()
        return [cap for spec in specs for cap in caps_of(spec, self.tested)]

    @property
    def speed(self) -> Speed:
        """The speeds in force now."""
        speed = speed_in_force([*self._caps(), self.page_cap])
        return governed(speed, self.ages.slow, self.stop_time)

    @property
    def stop_time(self) -> float | None:
        """Seconds within which the machine stops by itself, if that is known."""
        if self.tested is not None:
            return self.tested.seconds
        return self._robots.stops_within

    def bounds(self) -> Bounds:
        """Return what the machine may do at most now."""
        robots = self._robots
        return Bounds(self.speed, robots.a_max, robots.holonomic, robots.axes)
