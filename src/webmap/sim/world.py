"""The simulated building: robots that move, measure and collide, step by step."""

import io
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from random import Random

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from webmap.base.errors import ConfigError
from webmap.base.geometry import Pose, Twist
from webmap.sim.maps import FloorPlan, Obstacles
from webmap.sim.navigator import Errands, Navigator, SimGoal
from webmap.sim.planner import Planner
from webmap.sim.robot import BaseOptions, SimRobot
from webmap.sim.scanner import (
    Scanner,
    ScannerOptions,
    ScannerRays,
    cast_rays,
)

WIDTH, HEIGHT = 320, 200
FIELD = math.radians(80)
"""The horizontal field of view."""

_FARTHEST = 30.0
_EYE, _WALL_TOP, _ROBOT = 0.4, 2.4, 0.5
"""Heights above the floor in metres: camera, wall, robot."""

_CEILING, _FLOOR = np.array([214, 219, 226]), np.array([124, 118, 108])
_WALL, _BODY = np.array([196, 204, 214]), np.array([32, 92, 196])


class SimCamera:
    """A pinhole camera at the front of a robot, looking along its x."""

    def __init__(self, obstacles: Obstacles) -> None:
        self._focal = WIDTH / 2 / math.tan(FIELD / 2)
        across = (WIDTH / 2 - 0.5 - np.arange(WIDTH)) / self._focal
        self._bearings = np.arctan(across)
        self._rays = ScannerRays(obstacles, self._bearings, _FARTHEST)
        self._rows = np.arange(HEIGHT)[:, np.newaxis] - HEIGHT / 2

    def jpeg(
        self, pose: Pose, robots: Sequence[tuple[float, float, float]] = ()
    ) -> bytes:
        """Return the picture from a pose as JPEG.

        Args:
            pose: Pose of the camera, in the map's frame.
            robots: The other robots, as x, y and radius in metres.

        """
        file = io.BytesIO()
        Image.fromarray(self.view(pose, robots)).save(file, "JPEG", quality=70)
        return file.getvalue()

    def view(
        self, pose: Pose, robots: Sequence[tuple[float, float, float]] = ()
    ) -> NDArray[np.uint8]:
        """Return the pixels, of shape (height, width, 3)."""
        reach = self._rays.cast([pose])[2, 0]
        # Along the axis instead of along the ray, so that a flat wall looks flat.
        depth = np.minimum(reach, _FARTHEST) * np.cos(self._bearings)
        shown = self._background()
        self._paint(shown, depth, _WALL_TOP, _WALL)
        for x, y, radius in sorted(
            robots, key=lambda disc: -math.hypot(disc[0] - pose.x, disc[1] - pose.y)
        ):
            self._paint(shown, self._disc(pose, x, y, radius, depth), _ROBOT, _BODY)
        return shown.astype(np.uint8)

    def _background(self) -> NDArray[np.float64]:
        below = np.clip(0.35 + self._rows / HEIGHT, 0.35, 1.0)[..., np.newaxis]
        rows = np.where(self._rows[..., np.newaxis] < 0, _CEILING, _FLOOR * below)
        return np.repeat(rows, WIDTH, axis=1).astype(np.float64)

    def _paint(
        self,
        shown: NDArray[np.float64],
        depth: NDArray[np.float64],
        height: float,
        colour: NDArray[np.int_],
    ) -> None:
        """Paint an object on the floor over the objects behind it."""
        near = np.maximum(depth, 0.05)
        top = -(height - _EYE) / near * self._focal
        foot = _EYE / near * self._focal
        here = (self._rows >= top) & (self._rows <= foot) & np.isfinite(depth)
        light = 1.0 / (1.0 + 0.12 * near)
        painted = colour * light[:, np.newaxis]
        shown[here] = np.broadcast_to(painted, shown.shape)[here]

    def _disc(
        self, pose: Pose, x: float, y: float, radius: float, behind: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the depth of a round object in each column; inf outside of it."""
        ahead = math.cos(pose.yaw) * (x - pose.x) + math.sin(pose.yaw) * (y - pose.y)
        left = math.cos(pose.yaw) * (y - pose.y) - math.sin(pose.yaw) * (x - pose.x)
        depth = np.full(WIDTH, np.inf)
        if ahead > radius:
            away = np.abs(np.tan(self._bearings) * ahead - left)
            seen = (away < radius) & (ahead < behind)
            depth[seen] = ahead
        return depth


_APART = 3.0
_ROOM = 0.6
_REST = 2.0

LOW_CHARGE = 0.17
"""Charge at the start of a robot with a low battery."""

_STATIONS = 2
"""Stations for each robot with errands, besides the start poses."""


@dataclass(frozen=True, slots=True)
class WorldOptions:
    """What a world contains, and what its robots do by themselves."""

    robots: int = 2
    seed: int = 1
    base: BaseOptions = field(default_factory=BaseOptions)
    scanner: ScannerOptions = field(default_factory=ScannerOptions)
    wander: bool = False
    """Whether robots without a goal or a command choose goals themselves."""
    errands: int = 0
    """Number of robots with errands, which are the last ones."""
    low_battery: bool = False
    """Whether the last robot starts with a low battery."""
    flat: bool = False
    """Whether the only robot's topics and frames have no prefix."""


class World:
    """Robots on a floor plan. Time advances only in :meth:`step`.

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
        self.camera = SimCamera(self.obstacles)
        self.scanner = Scanner(self.obstacles, options.scanner, options.seed)
        self._random = Random(options.seed)  # noqa: S311 - reproducible by design
        places = self._spawn(options.robots + _STATIONS * options.errands)
        self.robots = [
            SimRobot(
                "" if options.flat else f"robot_{i}",
                pose,
                options.base,
                options.seed + i,
            )
            for i, pose in enumerate(places[: options.robots])
        ]
        if options.low_battery:
            self.robots[-1].charge = LOW_CHARGE
        self.navigators = [Navigator(robot, self.planner) for robot in self.robots]
        busy = range(options.robots - options.errands, options.robots)
        self.errands = Errands(self.navigators, busy, places, options.seed)
        self._planning = 0
        self._idle_since = [0.0 for _ in self.robots]

    def step(self, dt: float) -> None:
        """Advance the world by ``dt`` seconds."""
        self.now += dt
        planning = self._next_to_plan()
        for i, robot in enumerate(self.robots):
            self.navigators[i].step(dt, self.others(i), may_plan=i == planning)
            robot.step(dt, self.now, self._blocked_for(i))
        if self.options.wander:
            self._wander()
        self.errands.step(self.now)

    def command(self, index: int, twist: Twist) -> bool:
        """Send a client's velocity command to a robot; return False if it was refused.

        A nonzero command ends the robot's goal; a zero command only stops the robot.
        Any command pauses the robot's errands.
        """
        self.pause_errands(index)
        robot = self.robots[index]
        accepted = robot.command(twist, self.now)
        if accepted and not twist.is_zero:
            self.navigators[index].cancel("a client drives")
        if accepted:
            self._idle_since[index] = self.now
        return accepted

    def send_goal(self, index: int, goal: SimGoal) -> None:
        """Send a robot to a goal of a client."""
        self.pause_errands(index)
        self.navigators[index].send(goal)

    def stop(self, index: int) -> None:
        """Stop a robot and end its goal."""
        self.pause_errands(index)
        self.navigators[index].cancel("stopped")
        self.robots[index].stop()
        self._idle_since[index] = self.now

    def pause_errands(self, index: int) -> None:
        """Pause the errands of a robot: a client sent the robot a command."""
        self.errands.pause(index, self.now)

    def others(self, index: int) -> list[tuple[float, float, float]]:
        """Return the other robots as x, y and radius, in metres."""
        return [
            (robot.pose.x, robot.pose.y, robot.options.radius)
            for i, robot in enumerate(self.robots)
            if i != index
        ]

    def sweep(self, indices: Sequence[int]) -> NDArray[np.float32]:
        """Return the ranges of the scanners of some robots, one row for each."""
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
        """Return the picture of a robot's camera, as JPEG."""
        return self.camera.jpeg(self.robots[index].pose, self.others(index))

    def _next_to_plan(self) -> int:
        """Return the robot whose search continues: one at a time, each to its end."""
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
        """Return places apart from each other: one for each robot, then stations."""
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
                    # The first robot must not start in a closed room.
                    if seen.sum() < 0.3 * (~self.planner.blocked).sum():
                        continue
                    reachable = seen
                poses.append(Pose(x, y, self._open_heading(x, y)))
            apart *= 0.7
        if len(poses) < self.options.robots:
            raise ConfigError(
                f"the map has room for {len(poses)} robots, not {self.options.robots}"
            )
        return poses

    def _open_heading(self, x: float, y: float) -> float:
        """Return the heading with the longest free distance."""
        yaws = np.arange(8) * math.tau / 8 - math.pi
        ones = np.ones(8)
        distances = cast_rays(
            self.obstacles, x * ones, y * ones, np.cos(yaws), np.sin(yaws), 12.0
        )
        return float(yaws[int(np.argmax(np.minimum(distances, 12.0)))])

    def _wander(self) -> None:
        for i, navigator in enumerate(self.navigators):
            if navigator.goal is not None:
                self._idle_since[i] = self.now
            elif self.now - self._idle_since[i] > _REST:
                self.send_goal(i, SimGoal(self._random_place()))

    def _random_place(self) -> Pose:
        rows, columns = np.nonzero(~self.planner.blocked)
        pick = self._random.randrange(len(rows))
        x, y = self.planner.center(int(rows[pick]), int(columns[pick]))
        return Pose(x, y, self._random.uniform(-math.pi, math.pi))
