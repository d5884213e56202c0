"""The path that a robot has driven."""

import math
from collections import deque
from typing import TYPE_CHECKING

from webmap.base.audience import audience
from webmap.base.errors import ConfigError
from webmap.core.registry import robot_modules
from webmap.modules.drawing import rounded
from webmap.modules.placed import Placed
from webmap.scene import svg
from webmap.scene.element import Element

if TYPE_CHECKING:
    from webmap.core.robot import Robot

SPEED = 2.0
"""Metres per second that a robot may drive between two poses that are requested rarely,
as while nobody looks."""

PIECE = 50
"""Points after which a piece of the trail is complete and never sent again."""


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
        robot: "Robot",
        *,
        length: float = 20.0,
        step: float = 0.05,
        jump: float = 1.0,
    ) -> None:
        for name, value in (("length", length), ("step", step), ("jump", jump)):
            if not (math.isfinite(value) and value > 0):
                raise ConfigError(f"{name} must be metres above 0, got {value}")
        self.robot = robot
        self.length = length
        self.step = step
        self.jump = jump
        self._pieces: deque[_Piece] = deque()
        self._driven = 0.0
        """The length of all pieces, in metres."""
        self._last: tuple[float, float] | None = None
        self._placed = Placed(robot, class_="trail")
        self.svg = self._placed.svg
        self._undrawn: dict[_Piece, None] = {}
        """The pieces that changed while nobody looked."""
        audience.follow(self)
        if robot.valid:
            self.on_odometry_update()

    @property
    def points(self) -> list[list[tuple[float, float]]]:
        """The trail, oldest first, in pieces that may be connected."""
        return [list(piece.points) for piece in self._pieces]

    def destroy(self) -> None:
        """Draw no more."""
        audience.forget(self)

    def audience_changed(self) -> None:
        """Draw what changed while nobody looked."""
        undrawn, self._undrawn = self._undrawn, {}
        for piece in undrawn:
            piece.draw()

    def _draw(self, piece: "_Piece") -> None:
        if audience.present:
            piece.draw()
        else:
            self._undrawn[piece] = None

    def clear(self) -> None:
        """Remove the trail so far."""
        self.svg.clear()
        self._pieces.clear()
        self._driven = 0.0
        self._undrawn.clear()
        self._last = None

    def on_seek(self) -> None:
        """Begin anew: a recording is played from another position."""
        self.clear()

    def on_odometry_update(self) -> None:
        """Extend the trail to the robot's position."""
        at = (self.robot.position.x, self.robot.position.y)
        far = math.inf if self._last is None else math.dist(self._last, at)
        jump = max(self.jump, SPEED * self.robot.pose_source.period)
        if far < self.step:
            return
        if far > jump or self._last is None:
            self._begin(at)
        else:
            if len(self._pieces[-1].points) > PIECE:
                self._begin(self._last)
            self._pieces[-1].go(at, far)
            self._driven += far
            self._draw(self._pieces[-1])
            if self._pieces[-1].line.parent is None:
                self.svg.append(self._pieces[-1].line)
            self._forget_old()
        self._last = at

    def _begin(self, at: tuple[float, float]) -> None:
        if self._pieces and len(self._pieces[-1].points) < 2:
            self._pieces.pop()
        self._pieces.append(_Piece(at))

    def _forget_old(self) -> None:
        """Keep the pieces within the length, and shorten the oldest."""
        surplus = self._driven - self.length
        if surplus <= 0:
            return
        while surplus >= self._pieces[0].length and len(self._pieces) > 1:
            old = self._pieces.popleft()
            old.line.remove()
            self._undrawn.pop(old, None)
            surplus -= old.length
            self._driven -= old.length
        if cut := self._pieces[0].shorten(surplus):
            self._driven -= cut
            self._draw(self._pieces[0])


class _Piece:
    """A part of the trail that is one line, drawn from the second point on."""

    def __init__(self, start: tuple[float, float]) -> None:
        self.points: deque[tuple[float, float]] = deque([start])
        self.length = 0.0
        self.line: Element = svg.polyline(
            fill="none",
            stroke="#6b7f94",
            stroke_opacity=0.8,
            stroke_width=2,
            stroke_linejoin="round",
            vector_effect="non-scaling-stroke",
        )

    def go(self, at: tuple[float, float], far: float) -> None:
        """Extend the line to a point at the given distance from the last."""
        self.points.append(at)
        self.length += far

    def shorten(self, surplus: float) -> float:
        """Remove points at the beginning while the rest stays long enough.

        Returns:
            The metres by which it is shorter.
        """
        cut = 0.0
        while len(self.points) > 2:
            first = math.dist(self.points[0], self.points[1])
            if first > surplus:
                break
            self.points.popleft()
            self.length -= first
            surplus -= first
            cut += first
        return cut

    def draw(self) -> None:
        self.line.set(points=[(rounded(x), rounded(y)) for x, y in self.points])
