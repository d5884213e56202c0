"""The log of a witness: every message with its time of arrival."""

import math
from bisect import bisect_left
from dataclasses import dataclass, field
from typing import Any, TypeVar

from webmap.base.geometry import Twist


@dataclass(frozen=True, slots=True)
class ClientMessage:
    """One message of a client."""

    at: float
    """Seconds of the monotonic clock."""

    link: int
    """Number of its WebSocket, counted from 1."""

    message: dict[str, Any]

    @property
    def op(self) -> Any:
        """The operation of the message, such as ``publish``."""
        return self.message.get("op")

    @property
    def topic(self) -> Any:
        """The topic, if the message has one."""
        return self.message.get("topic")


@dataclass(frozen=True, slots=True)
class ReceivedTwist:
    """One velocity that the robot received."""

    at: float
    """Seconds of the monotonic clock."""

    twist: Twist
    link: int = 1

    @property
    def is_zero(self) -> bool:
        """Whether it stops the robot."""
        return self.twist.is_zero

    @property
    def speed(self) -> float:
        """Metres per second, in any direction."""
        return self.twist.speed


@dataclass(frozen=True, slots=True)
class Moved:
    """The velocity of the wheels at a time."""

    at: float
    twist: Twist


@dataclass
class WitnessLog:
    """All records of a witness, oldest first; may be read while it grows."""

    messages: list[ClientMessage] = field(default_factory=list)
    twists: list[ReceivedTwist] = field(default_factory=list)
    moved: list[Moved] = field(default_factory=list)

    def of(self, op: str, topic: str | None = None) -> list[ClientMessage]:
        """Return the messages with an operation, and with a topic if given."""
        return [
            message
            for message in list(self.messages)
            if message.op == op and topic in (None, message.topic)
        ]

    def first_zero(self, since: float) -> float | None:
        """Return the time of the first zero after ``since``."""
        return next((t.at for t in _from(self.twists, since) if t.is_zero), None)

    def moving_since(
        self, since: float, until: float = math.inf
    ) -> list[ReceivedTwist]:
        """Return the nonzero velocities of a period."""
        return [t for t in _from(self.twists, since) if t.at < until and not t.is_zero]

    def standstill(self, since: float, slow: float = 0.01) -> float | None:
        """Return when the wheels came to rest after ``since`` and stayed at rest.

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


Record = TypeVar("Record", ReceivedTwist, Moved)


def _from(records: list[Record], since: float) -> list[Record]:
    """Return the records since a time.

    A log grows for the lifetime of a robot, and waiting tests read it repeatedly in the
    process of the witness: old records must cost nothing.
    """
    return records[bisect_left(records, since, key=lambda record: record.at) :]
