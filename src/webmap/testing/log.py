"""What a witness noted: every message with the time when it came."""

import math
from dataclasses import dataclass, field
from typing import Any

from webmap.geometry import Twist


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
        return math.hypot(self.twist.vx, self.twist.vy)


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

    def last_moving(self, since: float) -> float | None:
        """Return when the last velocity that moves came, if any did after ``since``."""
        return max(
            (t.at for t in list(self.told) if t.at >= since and not t.is_zero),
            default=None,
        )

    def first_zero(self, since: float) -> float | None:
        """Return when the first zero came after ``since``."""
        return min(
            (t.at for t in list(self.told) if t.at >= since and t.is_zero), default=None
        )

    def moving_since(self, since: float, until: float = math.inf) -> list[Told]:
        """Return the velocities that move, of those that came in a stretch of time."""
        return [t for t in list(self.told) if since <= t.at < until and not t.is_zero]

    def standstill(self, since: float, slow: float = 0.01) -> float | None:
        """Return when the wheels came to rest after ``since``, and stayed so.

        Args:
            since: Seconds of the monotonic clock.
            slow: Metres or radians per second that count as rest.

        """
        rest = None
        for moved in list(self.moved):
            if moved.at < since:
                continue
            if max(abs(moved.twist.vx), abs(moved.twist.wz)) > slow:
                rest = None
            elif rest is None:
                rest = moved.at
        return rest
