"""One result of a check of a ROS system."""

from dataclasses import dataclass
from typing import Literal, TypeAlias

Level: TypeAlias = Literal["wrong", "warning", "note", "good"]
"""``wrong``: does not work, or not safely. ``note``: cannot be checked from here."""

LEVELS: tuple[Level, ...] = ("wrong", "warning", "note", "good")
"""All levels, the worst first."""

BRIDGE = "bridge"
"""``Finding.about`` of a finding that concerns the bridge, not one robot."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One result of a check."""

    level: Level
    about: str
    """A robot's name, or :data:`BRIDGE`."""

    text: str
    """The result, in a sentence."""

    advice: str = ""
    """What to do about it, in a sentence; empty if there is nothing to do."""
