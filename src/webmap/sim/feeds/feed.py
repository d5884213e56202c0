"""One topic of every robot."""

from collections.abc import Callable
from dataclasses import dataclass

from webmap.sim.messages import Message

Make = Callable[[int, str, float], Message | None]
"""Makes a robot's message from its index, the topic's name and the stamp."""


@dataclass(frozen=True, slots=True)
class Feed:
    """A topic that every robot has, in its own namespace."""

    topic: str
    """The name without the robot's namespace and the slash."""

    type: str
    period: float
    """Seconds between two messages."""

    make: Make
    """Called only while the topic has subscribers; None if there is no message."""
