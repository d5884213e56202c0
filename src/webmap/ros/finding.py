"""One thing that a check of a ROS system found out, for people."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

Level: TypeAlias = Literal["wrong", "warning", "note", "good"]
"""``wrong``: it will not work, or not safely. ``note``: cannot be told from here."""

LEVELS: tuple[Level, ...] = ("wrong", "warning", "note", "good")
"""All levels, the worst first."""

BRIDGE = "bridge"
"""What a finding is about that holds for a bridge and not for one robot."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that was found out."""

    level: Level
    about: str
    """A robot's name, or :data:`BRIDGE`."""

    words: str
    """What is so, in a sentence."""

    advice: str = ""
    """What to do about it, in a sentence; empty if nothing is to be done."""
