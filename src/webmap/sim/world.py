"""The simulated building: robots that move, see and bump, one step at a time."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from random import Random

import numpy as np
from numpy.typing import NDArray

from webmap.errors import ConfigError
from webmap.geometry import Pose, Twist
from webmap.sim.camera import Camera
from webmap.sim.maps import FloorPlan
from webmap.sim.navigator import Goal, Navigator
from webmap.sim.obstacles import Obstacles
from webmap.sim.planner import Planner
from webmap.sim.robot import BaseOptions, Robot
from webmap.sim.scanner import Scanner, ScannerOptions, cast_rays

_APART = 3.0
_ROOM = 0.6
_REST = 2.0


@dataclass(frozen=True, slots=True)
class WorldOptions:
    """What the world is made with."""

    robots: int = 2
    seed: int = 1
    base: BaseOptions = field(default_factory=BaseOptions)
    scanner: ScannerOptions = field(default_factory=ScannerOptions)
    wander: bool = False
    """Whether robots without a goal or a command choose goals themselves."""
    flat: bool = False
    """Whether the only robot's topics and frames have no prefix."""


class World:
    """Robots on a floor plan. Time goes on only in :meth:`step`.

    Raises:
        ConfigError: If the plan has no room for so many robots.

    """

    def __init__(self, plan: FloorPlan, options: WorldOptions) -> None:
        self.plan = plan
        self.options = options
        self.now = 0.0
        """Seconds since the world began."""
        self.obstacles = Obstacles(plan)
        self.planner = Planner(self.obstacles, options.base.radius)
        self.camera = Camera(self.obstacles)
        self.scanner = Scanner(self.obstacles, options.scanner, options.seed)
        self._random = Random(options.seed)  # noqa: S311 - reproducible by design
        poses = self._spawn(options.robots)
        self.robots = [
            Robot(
                "" if options.flat else f"robot_{i}",
                pose,
                options.base,
                options.seed + i,
            )
            for i, pose in enumerate(poses)
        ]
        self.navigators = [Navigator(robot, self.planner) for robot in self.robots]
        self._planning = 0
        self._idle_since = [0.0 for _ in self.robots]

    def step(self, dt: float) -> None:
        """Let ``dt`` seconds go by."""
        self.now += dt
        planning = self._next_to_plan()
        for i, robot in enumerate(self.robots):
            self.navigators[i].step(dt, self.others(i), may_plan=i == planning)
            robot.step(dt, self.now, self._blocked_for(i))
        if self.options.wander:
            self._wander()

    def command(self, index: int, twist: Twist) -> bool:
        """Give a robot a client's velocity command; return False if it was refused.

        A command that moves ends the robot's goal; one of zero only holds it still.
        """
        robot = self.robots[index]
        taken = robot.command(twist, self.now)
        if taken and not twist.is_zero:
            self.navigators[index].cancel("a client drives")
        if taken:
            self._idle_since[index] = self.now
        return taken

    def send_goal(self, index: int, goal: Goal) -> None:
        """Send a robot to a goal."""
        self.navigators[index].send(goal)

    def stop(self, index: int) -> None:
        """Stop a robot, its goal included."""
        self.navigators[index].cancel("stopped")
        self.robots[index].stop()
        self._idle_since[index] = self.now

    def others(self, index: int) -> list[tuple[float, float, float]]:
        """Return the other robots as x, y and radius, in metres."""
        return [
            (robot.pose.x, robot.pose.y, robot.options.radius)
            for i, robot in enumerate(self.robots)
            if i != index
        ]

    def sweep(self, indices: Sequence[int]) -> NDArray[np.float32]:
        """Return what the scanners of some robots measure, a row each."""
        reach = self.options.scanner.range_max + self.options.base.radius
        poses = [self.robots[i].pose for i in indices]
        discs = [
            [
                disc
                for disc in self.others(i)
                if math.hypot(disc[0] - pose.x, disc[1] - pose.y) < reach
            ]
            for i, pose in zip(indices, poses, strict=True)
        ]
        return self.scanner.sweep(poses, discs)

    def look(self, index: int) -> bytes:
        """Return what the camera of a robot sees, as JPEG."""
        return self.camera.jpeg(self.robots[index].pose, self.others(index))

    def _next_to_plan(self) -> int:
        """Return whose search goes on: one at a time, to its end, then the next's."""
        waiting = [i for i, n in enumerate(self.navigators) if n.must_plan]
        if waiting and self._planning not in waiting:
            later = [i for i in waiting if i > self._planning]
            self._planning = (later or waiting)[0]
        return self._planning

    def _blocked_for(self, index: int) -> Callable[[float, float], bool]:
        robot = self.robots[index]
        radius = robot.options.radius

        def is_blocked(x: float, y: float) -> bool:
            if self.obstacles.touches(x, y, radius):
                return True
            here = robot.pose
            for ox, oy, other in self.others(index):
                gap = math.hypot(ox - x, oy - y)
                if gap < radius + other and gap < math.hypot(ox - here.x, oy - here.y):
                    return True
            return False

        return is_blocked

    def _spawn(self, count: int) -> list[Pose]:
        roomy = ~self.obstacles.near(_ROOM) & self.obstacles.free
        rows, columns = np.nonzero(roomy)
        if not len(rows):
            raise ConfigError("the map has no free place for a robot")
        order = self._random.sample(range(len(rows)), min(len(rows), 4000))
        places = [self.plan.center(int(rows[i]), int(columns[i])) for i in order]
        poses: list[Pose] = []
        apart = _APART
        reachable: NDArray[np.bool_] | None = None
        while len(poses) < count and apart > 2.5 * self.options.base.radius:
            for x, y in places:
                if len(poses) == count:
                    break
                if any(math.hypot(p.x - x, p.y - y) < apart for p in poses):
                    continue
                if reachable is not None and not reachable[self.planner.cell(x, y)]:
                    continue
                if reachable is None:
                    seen = self.planner.reachable(x, y)
                    # The first robot must not be shut in a closet.
                    if seen.sum() < 0.3 * (~self.planner.blocked).sum():
                        continue
                    reachable = seen
                poses.append(Pose(x, y, self._open_heading(x, y)))
            apart *= 0.7
        if len(poses) < count:
            raise ConfigError(f"the map has room for {len(poses)} robots, not {count}")
        return poses

    def _open_heading(self, x: float, y: float) -> float:
        """Return the heading with the longest free way."""
        yaws = np.arange(8) * math.tau / 8 - math.pi
        ones = np.ones(8)
        ways = cast_rays(
            self.obstacles, x * ones, y * ones, np.cos(yaws), np.sin(yaws), 12.0
        )
        return float(yaws[int(np.argmax(np.minimum(ways, 12.0)))])

    def _wander(self) -> None:
        for i, navigator in enumerate(self.navigators):
            if navigator.goal is not None:
                self._idle_since[i] = self.now
            elif self.now - self._idle_since[i] > _REST:
                self.send_goal(i, Goal(self._random_place()))

    def _random_place(self) -> Pose:
        rows, columns = np.nonzero(~self.planner.blocked)
        pick = self._random.randrange(len(rows))
        x, y = self.planner.center(int(rows[pick]), int(columns[pick]))
        return Pose(x, y, self._random.uniform(-math.pi, math.pi))
