"""Errands: goals that robots follow on their own, as if a fleet manager sent them."""

import math
from collections.abc import Sequence
from random import Random

from webmap.base.geometry import Pose
from webmap.sim.navigator import Navigator, SimGoal

QUIET = 60.0
"""Seconds without a command of a client until a robot continues its errands."""

REST = 6.0
"""Seconds that a robot waits at a station."""

_FREE = 2.0
"""Metres around a station that other robots leave free."""


class Errands:
    """Sends some robots from station to station, and pauses for commands of clients.

    A paused robot does not move on its own before ``QUIET`` seconds have passed without
    a command. A goal of a client counts as a command until it ends.

    Args:
        navigators: The navigation of every robot.
        robots: The indices of the robots with errands.
        stations: The poses to drive to.
        seed: Seed of the choice of stations.

    """

    def __init__(
        self,
        navigators: Sequence[Navigator],
        robots: Sequence[int],
        stations: Sequence[Pose],
        seed: int,
    ) -> None:
        self._navigators = navigators
        self._stations = stations
        self._random = Random(seed)  # noqa: S311 - reproducible by design
        self._goals: dict[int, SimGoal] = {}
        # After the start of the display, which needs the processor too, and one robot
        # after the other, so that their plans do not wait.
        self._due = {index: REST + place for place, index in enumerate(robots)}

    def has(self, index: int) -> bool:
        """Return whether a robot has errands."""
        return index in self._due

    def step(self, now: float) -> None:
        """Send each robot whose time has come to its next station.

        Args:
            now: Seconds on the world's clock.

        """
        for index, due in self._due.items():
            goal = self._navigators[index].goal
            if goal is not None:
                own = goal is self._goals.get(index)
                self._due[index] = now + (REST if own else QUIET)
            elif now >= due:
                self._send(index)
                self._due[index] = now + REST

    def pause(self, index: int, now: float) -> None:
        """End the errand of a robot, because a client sent the robot a command.

        Args:
            index: The robot; nothing happens if it has no errands.
            now: Seconds on the world's clock.

        """
        if not self.has(index):
            return
        self._due[index] = now + QUIET
        navigator, goal = self._navigators[index], self._goals.pop(index, None)
        if goal is not None and navigator.goal is goal:
            navigator.cancel(f"errands pause until {QUIET:g} s pass without a command")

    def _send(self, index: int) -> None:
        free = [station for station in self._stations if self._is_free(station)]
        if free:
            goal = self._goals[index] = SimGoal(self._random.choice(free))
            self._navigators[index].send(goal)

    def _is_free(self, station: Pose) -> bool:
        taken = [navigator.robot.pose for navigator in self._navigators]
        taken += [each.goal.pose for each in self._navigators if each.goal is not None]
        return all(
            math.hypot(pose.x - station.x, pose.y - station.y) >= _FREE
            for pose in taken
        )
