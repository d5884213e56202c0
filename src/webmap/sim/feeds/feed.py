"""One topic of every robot."""

from collections.abc import Callable
from dataclasses import dataclass

from webmap.sim.messages import Message

Make = Callable[[int, str, float], Message | None]
"""Makes a robot's message from its index, the topic's name and the stamp."""


@dataclass(frozen=True, slots=True)
class Feed:
    """A topic that every robot has, below its own name."""

    topic: str
    """Without the robot's name and the slash behind it."""

    type: str
    period: float
    """Seconds between two messages."""

    make: Make
    """Called only while somebody subscribes; None if there is nothing to say."""
