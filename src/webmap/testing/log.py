"""What a witness noted: every message with the time when it came."""

import math
from bisect import bisect_left
from dataclasses import dataclass, field
from typing import Any, TypeVar

from webmap.base.geometry import Twist


@dataclass(frozen=True, slots=True)
class Heard:
    """One message of a client."""

    at: float
    """Seconds of the monotonic clock."""

    link: int
    """Which of the WebSockets it came on, counted from 1."""

    message: dict[str, Any]

    @property
    def op(self) -> Any:
        """What the client wants, as ``publish``."""
        return self.message.get("op")

    @property
    def topic(self) -> Any:
        """The topic, if the message has one."""
        return self.message.get("topic")


@dataclass(frozen=True, slots=True)
class Told:
    """One velocity that the robot was told."""

    at: float
    """Seconds of the monotonic clock."""

    twist: Twist
    link: int = 1

    @property
    def is_zero(self) -> bool:
        """Whether it says to stand still."""
        return self.twist.is_zero

    @property
    def speed(self) -> float:
        """Metres per second, whatever the direction."""
        return self.twist.speed


@dataclass(frozen=True, slots=True)
class Moved:
    """How the wheels turned at a time."""

    at: float
    twist: Twist


@dataclass
class WitnessLog:
    """All that a witness noted, oldest first; may be read while it grows."""

    heard: list[Heard] = field(default_factory=list)
    told: list[Told] = field(default_factory=list)
    moved: list[Moved] = field(default_factory=list)

    def of(self, op: str, topic: str | None = None) -> list[Heard]:
        """Return the messages of a kind."""
        return [
            heard
            for heard in list(self.heard)
            if heard.op == op and topic in (None, heard.topic)
        ]

    def first_zero(self, since: float) -> float | None:
        """Return when the first zero came after ``since``."""
        return next((t.at for t in _from(self.told, since) if t.is_zero), None)

    def moving_since(self, since: float, until: float = math.inf) -> list[Told]:
        """Return the velocities that move, of those that came in a stretch of time."""
        return [t for t in _from(self.told, since) if t.at < until and not t.is_zero]

    def standstill(self, since: float, slow: float = 0.01) -> float | None:
        """Return when the wheels came to rest after ``since``, and stayed so.

        Args:
            since: Seconds of the monotonic clock.
            slow: Metres or radians per second that count as rest.

        """
        rest = None
        for moved in _from(self.moved, since):
            if max(moved.twist.speed, moved.twist.turn) > slow:
                rest = None
            elif rest is None:
                rest = moved.at
        return rest


Noted = TypeVar("Noted", Told, Moved)


def _from(noted: list[Noted], since: float) -> list[Noted]:
    """Return what was noted from a time on.

    A log grows for as long as a robot lives, and is asked again and again by who waits
    for something, in the process of the witness: what is old must cost nothing.
    """
    return noted[bisect_left(noted, since, key=lambda one: one.at) :]
