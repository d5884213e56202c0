"""How old the driver's picture of the robot is, and what that leaves of its speed.

Nobody can react to what has not been seen yet. So a robot is never let go faster than
what carries it a quarter of a metre in the time from a finger to its wheels, at worst:
the age of the loop, the dead-man, and the base's own time to stop (S15).
"""

import math
from collections import deque

from webmap.gate.deadman import DEADMAN
from webmap.gate.limits import STOPS_WITHIN, Speed

WINDOW = 2.0
"""Seconds over which the age of the loop is looked at."""

SLOW = 0.15
"""The age of a loop in seconds from which people are told that it is slow."""

BLIND = 0.25
"""Metres that a robot may go before anything that anybody does can take effect."""


class LoopAge:
    """The ages of the ticks that the holder's accepted commands echoed."""

    def __init__(self) -> None:
        self._ages: deque[tuple[float, float]] = deque()
        self._p95: float | None = None
        self._stale = False

    def add(self, age: float, now: float) -> None:
        """Count one more; ``age`` in seconds."""
        self._ages.append((now, age))
        self._stale = True

    def forget_old(self, now: float) -> None:
        """Look at the last two seconds only."""
        while self._ages and now - self._ages[0][0] > WINDOW:
            self._ages.popleft()
            self._stale = True

    def clear(self) -> None:
        """Forget everything: another driver has another loop."""
        self._ages.clear()
        self._stale = True

    @property
    def p95(self) -> float | None:
        """The age in seconds that 95 of 100 commands stay below, if any came."""
        if self._stale:
            ages = sorted(age for _, age in self._ages)
            self._p95 = ages[math.ceil(0.95 * len(ages)) - 1] if ages else None
            self._stale = False
        return self._p95


def reaction(age: float | None, stop_time: float | None) -> float:
    """Return the seconds from a finger to the robot, at worst.

    Args:
        age: The age of the loop in seconds, if it is known.
        stop_time: Seconds within which the base stops by itself, if that is known.

    """
    own = STOPS_WITHIN if stop_time is None else stop_time
    return (age or 0.0) + DEADMAN + own


def governed(speed: Speed, age: float | None, stop_time: float | None) -> Speed:
    """Return ``speed``, or what a loop as old as that leaves of it."""
    # Rounded down, so that the speed in force does not tremble with every command.
    v = math.floor(100 * BLIND / reaction(age, stop_time)) / 100
    if age is not None and age > SLOW:
        # In steps of 10 ms, for the same reason.
        why = f"slow link: {math.ceil(age * 100) * 10} ms"
    elif v < speed.v:
        why = f"at most {BLIND:g} m before a hand has an effect"
    else:
        return speed
    return Speed(min(v, speed.v), speed.w, (*speed.why, why))
