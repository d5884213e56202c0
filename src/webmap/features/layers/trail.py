"""The path that a robot has driven."""

import math
from collections import deque

from webmap.base.errors import ConfigError
from webmap.core.registry import robot_modules
from webmap.core.robot import Robot
from webmap.modules.placed import Placed
from webmap.scene import svg
from webmap.scene.element import Element

SPEED = 2.0
"""Metres per second that a robot may drive between two poses that are requested rarely,
as while nobody looks."""

PART = 500
"""Points after which another line begins: browsers draw all of a line that changes."""


@robot_modules.register
class Trail:
    """Draws the past positions of the robot as a line.

    A jump, such as after a new localisation, breaks the line.

    Style it by CSS: ``.trail > polyline``.

    Args:
        robot: The robot; its odometry topic has its position.
        length: The length of the trail, in metres.
        step: The distance between two points, in metres.
        jump: The distance in metres from which two poses are not connected by a line;
            more if poses are requested so rarely that a robot at 2 m/s drives further.

    Raises:
        ConfigError: If ``length``, ``step`` or ``jump`` is not a number above 0.
    """

    def __init__(
        self,
        robot: Robot,
        *,
        length: float = 20.0,
        step: float = 0.1,
        jump: float = 1.0,
    ) -> None:
        for name, value in (("length", length), ("step", step), ("jump", jump)):
            if not (math.isfinite(value) and value > 0):
                raise ConfigError(f"{name} must be metres above 0, got {value}")
        self.robot = robot
        self.length = length
        self.step = step
        self.jump = jump
        self._parts: deque[_Part] = deque()
        self._driven = 0.0
        """The length of all parts, in metres."""
        self._last: tuple[float, float] | None = None
        self._placed = Placed(robot, class_="trail")
        self.svg = self._placed.svg
        if robot.valid:
            self.on_odometry_update()

    @property
    def points(self) -> list[list[tuple[float, float]]]:
        """The trail, oldest first, in parts that may be connected."""
        return [list(part.points) for part in self._parts]

    def clear(self) -> None:
        """Remove the trail so far."""
        self.svg.clear()
        self._parts.clear()
        self._driven = 0.0
        self._last = None

    def on_seek(self) -> None:
        """Begin anew: a recording is played from another position."""
        self.clear()

    def on_odometry_update(self) -> None:
        """Extend the trail to the robot's position."""
        position = self.robot.position
        last, at = self._last, (position.x, position.y)
        far = math.inf if last is None else math.dist(last, at)
        if far < self.step:
            return
        self._last = at
        if last is None or (
            far > self.jump and far > SPEED * self.robot.pose_source.period
        ):
            self._begin(at)
            return
        newest = self._parts[-1]
        if len(newest.points) > PART:
            self._begin(last)
            newest = self._parts[-1]
        newest.points.append(at)
        self._driven += far
        oldest, drop = self._forget_old()
        if oldest is not newest:
            oldest.line.extend_line((), drop=drop)
            drop = 0
        newest.line.extend_line((at,), drop=drop)
        if newest.line.parent is None:
            self.svg.append(newest.line)

    def _begin(self, at: tuple[float, float]) -> None:
        if self._parts and len(self._parts[-1].points) < 2:
            self._parts.pop()
        self._parts.append(_Part(at))

    def _forget_old(self) -> "tuple[_Part, int]":
        """Shorten the trail; return the oldest part and how many points it lost."""
        drop, oldest = 0, self._parts[0]
        surplus = self._driven - self.length
        while (first := math.dist(oldest.points[0], oldest.points[1])) <= surplus:
            if len(oldest.points) > 2:
                oldest.points.popleft()
                drop += 1
            elif len(self._parts) > 1:
                self._parts.popleft().line.remove()
                drop, oldest = 0, self._parts[0]
            else:
                break
            surplus -= first
            self._driven -= first
        return oldest, drop


class _Part:
    """A part of the trail that is one line, drawn from the second point on."""

    def __init__(self, start: tuple[float, float]) -> None:
        self.points: deque[tuple[float, float]] = deque([start])
        self.line: Element = svg.polyline(
            fill="none",
            stroke="#6b7f94",
            stroke_opacity=0.8,
            stroke_width=2,
            stroke_linejoin="round",
            vector_effect="non-scaling-stroke",
        ).set_line([start])
