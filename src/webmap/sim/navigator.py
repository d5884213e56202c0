"""A robot's own navigation: plans a path to a goal, follows it, and can be stopped.

Errands are goals that robots follow on their own, as if a fleet manager sent them.
"""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from enum import Enum
from random import Random

from webmap.base.geometry import Pose, Twist, normalize_angle
from webmap.sim.planner import Planner, Point
from webmap.sim.robot import SimRobot

_CORNER = 0.15
_ARRIVED = 0.12
_TURNED = 0.08
_CRUISE = 0.7
_PATIENCE = (1.0, 4.0)
_PROGRESS = 1.0
_MOST_PLANS = 6
_KEEP_OFF = 0.15
_TURN_FIRST = 0.5
_TURN_RATE = 1.8
_GAP = 0.04
_BRAKING = 0.4
_LOOKAHEAD = 1.5

Discs = Sequence[tuple[float, float, float]]


class GoalState(Enum):
    """State of a goal; the values are words of the log."""

    ACTIVE = "active"
    SUCCEEDED = "succeeded"
    CANCELED = "canceled"
    ABORTED = "aborted"


class SimGoal:
    """A pose to drive to, in the map's frame, and a callback for its end."""

    def __init__(
        self, pose: Pose, on_end: Callable[["SimGoal"], None] | None = None
    ) -> None:
        self.pose = pose
        self.state = GoalState.ACTIVE
        self.text = ""
        """Why it ended."""
        self._on_end = on_end

    def end(self, state: GoalState, text: str) -> None:
        """Set the last state and its reason, and call back; later calls do nothing."""
        if self.state is GoalState.ACTIVE:
            self.state, self.text = state, text
            if self._on_end:
                self._on_end(self)


class Navigator:
    """Drives one robot to one goal at a time."""

    def __init__(self, robot: SimRobot, planner: Planner) -> None:
        self.robot = robot
        self.planner = planner
        self.goal: SimGoal | None = None
        self.path: list[Point] = []
        """The path that it follows, in the map's frame; empty without a path."""
        self.path_changes = 0
        """Increases with every new path, and when one ends."""
        self.recoveries = 0
        """How often it got stuck on the path to its goal and planned again."""
        self._search: Iterator[list[Point] | None] | None = None
        self._plans = 0
        self._next = 0
        self._stuck_for = 0.0
        self._planned_at = 0.0
        self._random = Random(robot.name)  # noqa: S311 - reproducible by design
        self._patience = self._random.uniform(*_PATIENCE)

    def send(self, goal: SimGoal) -> None:
        """Drive to a goal, which replaces the previous one."""
        self.cancel("another goal came")
        self.goal = goal
        self.recoveries = 0
        self._plans = 0
        self._search = None
        self._stuck_for = 0.0
        self.robot.release()

    def cancel(self, reason: str) -> None:
        """End the goal, if there is one, and stop."""
        self._end(GoalState.CANCELED, reason)

    @property
    def distance_left(self) -> float:
        """Metres along the path to the goal; 0 without a path."""
        if not self.path:
            return 0.0
        points = [(self.robot.pose.x, self.robot.pose.y), *self.path[self._next :]]
        return sum(math.dist(a, b) for a, b in itertools.pairwise(points))

    @property
    def steers_to(self) -> Point | None:
        """The point that it steers to, in the map's frame; None without a path.

        The point is on the line to the next corner, and at most at the look-ahead
        distance.
        """
        if not self.path:
            return None
        x, y = self.robot.pose.x, self.robot.pose.y
        corner = self.path[min(self._next, len(self.path) - 1)]
        share = _LOOKAHEAD / max(math.dist((x, y), corner), _LOOKAHEAD)
        return x + share * (corner[0] - x), y + share * (corner[1] - y)

    @property
    def must_plan(self) -> bool:
        """Whether it has a goal and no path yet."""
        return self.goal is not None and not self.path

    def step(self, dt: float, discs: Discs, *, may_plan: bool = True) -> None:
        """Continue the goal.

        Args:
            dt: Seconds since the last step.
            discs: The other robots, as x, y and radius.
            may_plan: Whether it may do one slice of the search for a path.

        """
        if self.goal is None:
            return
        if self.must_plan:
            if may_plan:
                self._plan(discs)
            return
        self._watch_progress(dt)
        if self.goal is not None and self.path:
            self._follow(discs)

    def _plan(self, discs: Discs) -> None:
        goal = self.goal
        assert goal is not None
        pose = self.robot.pose
        if self._search is None:
            if self._plans >= _MOST_PLANS:
                self._end(GoalState.ABORTED, "no path to the goal")
                return
            self._plans += 1
            radius = self.robot.options.radius
            # A robot that is very close cannot be avoided by planning, only by waiting.
            others = [
                (x, y, r + radius + _KEEP_OFF)
                for x, y, r in discs
                if math.dist((x, y), (pose.x, pose.y)) > r + radius + 2 * _KEEP_OFF
            ]
            self._search = self.planner.search(
                (pose.x, pose.y), (goal.pose.x, goal.pose.y), others
            )
        found = next(self._search)
        if found is None:
            return
        self._search = None
        if found:
            self._set_path(found)
        else:
            self._end(GoalState.ABORTED, "no path to the goal")

    def _set_path(self, path: list[Point]) -> None:
        self.path = path
        self.path_changes += 1
        self._next = 1
        self._stuck_for = 0.0
        self._planned_at = self.robot.travelled

    def _watch_progress(self, dt: float) -> None:
        moving = abs(self.robot.twist.vx) > 0.03 or abs(self.robot.twist.wz) > 0.1
        self._stuck_for = 0.0 if moving else self._stuck_for + dt
        if self.robot.travelled - self._planned_at > _PROGRESS:
            self._plans = 0
        if self._stuck_for > self._patience:
            # Random, so that two robots that meet do not avoid each other in step.
            self._patience = self._random.uniform(*_PATIENCE)
            self.recoveries += 1
            self._set_path([])

    def _follow(self, discs: Discs) -> None:
        assert self.goal is not None
        pose, last = self.robot.pose, self.path[-1]
        here = (pose.x, pose.y)
        if math.dist(here, last) < _ARRIVED:
            self._turn_to(self.goal.pose.yaw)
            return
        self._pass_corners(here)
        corner = self.path[self._next]
        bearing = math.atan2(corner[1] - pose.y, corner[0] - pose.x)
        error = normalize_angle(bearing - pose.yaw)
        # Slow down before the corner, to turn there and not beyond it.
        speed = min(_CRUISE, 0.2 + 1.2 * math.dist(here, corner))
        if abs(error) > _TURN_FIRST or self._must_wait(here, corner, discs):
            speed = 0.0
        turn = max(-_TURN_RATE, min(_TURN_RATE, 3.0 * error))
        self.robot.autonomous = Twist(vx=speed * max(math.cos(error), 0), wz=turn)

    def _pass_corners(self, here: Point) -> None:
        while (
            self._next < len(self.path) - 1
            and math.dist(here, self.path[self._next]) < _CORNER
        ):
            self._next += 1

    def _must_wait(self, here: Point, corner: Point, discs: Discs) -> bool:
        """Whether another robot is on the next metre of the path."""
        distance = math.dist(here, corner)
        x, y = corner[0] - here[0], corner[1] - here[1]
        for disc_x, disc_y, radius in discs:
            to_x, to_y = disc_x - here[0], disc_y - here[1]
            along = (to_x * x + to_y * y) / distance if distance else 0.0
            if not 0 < along < distance + radius:
                continue
            aside = abs(to_x * y - to_y * x) / distance
            near = radius + self.robot.options.radius + _GAP
            if aside < near and along < near + _BRAKING:
                return True
        return False

    def _turn_to(self, yaw: float) -> None:
        error = normalize_angle(yaw - self.robot.pose.yaw)
        if abs(error) < _TURNED:
            self._end(GoalState.SUCCEEDED, "arrived")
        else:
            self.robot.autonomous = Twist(wz=max(-1.2, min(1.2, 2.5 * error)))

    def _end(self, state: GoalState, text: str) -> None:
        goal, self.goal = self.goal, None
        self._search = None
        self.robot.autonomous = None
        if self.path:
            self._set_path([])
        if goal:
            goal.end(state, text)


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
