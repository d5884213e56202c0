"""Robots that are seen and never driven, since nobody is there who would obey."""

from dataclasses import replace

from webmap.cli.overruling import Overruling
from webmap.discovery import FoundRobot
from webmap.discovery.found import Role
from webmap.discovery.robots import host_name

MOTION: tuple[Role, ...] = ("velocity", "goal", "action", "cancel", "initialpose")
"""Roles by which a robot is told something."""


class Watched(Overruling):
    """Says of every robot that is found that nothing of it is told anything.

    Args:
        name: What a robot is called that has no name of its own.

    """

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name

    def apply(
        self, url: str, robot: FoundRobot, dialect: str | None = None
    ) -> FoundRobot:
        """Return a robot that was found without all that would move it.

        Args:
            url: The bridge that it is behind.
            robot: As it was found.
            dialect: That of the bridge.

        """
        guesses = {
            role: found for role, found in robot.guesses.items() if role not in MOTION
        }
        name = self._name if robot.name == host_name(url) else robot.name
        return replace(robot, guesses=guesses, name=name)

    def fixed(self, url: str, robot: FoundRobot) -> frozenset[str]:
        """Return the roles that no topic that comes later may have."""
        return frozenset(MOTION)
