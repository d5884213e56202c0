"""What a robot's camera sees: the floor plan's walls, as tall as a room."""

import io
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from webmap.geometry import Pose
from webmap.sim.obstacles import Obstacles
from webmap.sim.scanner import cast_rays

WIDTH, HEIGHT = 320, 200
FIELD = math.radians(80)
"""The horizontal field of view."""

_FARTHEST = 30.0
_EYE, _ROOM, _ROBOT = 0.4, 2.4, 0.5
"""Heights above the floor in metres: of the camera, of a wall, of a robot."""

_CEILING, _FLOOR = np.array([214, 219, 226]), np.array([124, 118, 108])
_WALL, _BODY = np.array([196, 204, 214]), np.array([32, 92, 196])


class Camera:
    """A pinhole camera at the front of a robot, that looks along its x."""

    def __init__(self, obstacles: Obstacles) -> None:
        self.obstacles = obstacles
        self._focal = WIDTH / 2 / math.tan(FIELD / 2)
        across = (WIDTH / 2 - 0.5 - np.arange(WIDTH)) / self._focal
        self._bearings = np.arctan(across)
        self._rows = np.arange(HEIGHT)[:, np.newaxis] - HEIGHT / 2

    def jpeg(
        self, pose: Pose, robots: Sequence[tuple[float, float, float]] = ()
    ) -> bytes:
        """Return what is seen from a pose.

        Args:
            pose: Of the camera, in the map's frame.
            robots: What else stands there, as x, y and radius in metres.

        """
        file = io.BytesIO()
        Image.fromarray(self.view(pose, robots)).save(file, "JPEG", quality=70)
        return file.getvalue()

    def view(
        self, pose: Pose, robots: Sequence[tuple[float, float, float]] = ()
    ) -> NDArray[np.uint8]:
        """Return the pixels, of shape (height, width, 3)."""
        angles = pose.yaw + self._bearings
        ones = np.ones(WIDTH)
        along_x, along_y = np.cos(angles), np.sin(angles)
        reach = cast_rays(
            self.obstacles, pose.x * ones, pose.y * ones, along_x, along_y, _FARTHEST
        )
        # Along the axis, not along the ray, so that a flat wall is flat.
        depth = np.minimum(reach, _FARTHEST) * np.cos(self._bearings)
        shown = self._background()
        self._paint(shown, depth, _ROOM, _WALL)
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
        """Paint, over what is behind it, something that stands on the floor."""
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
        """Return how deep a round thing is in each column; inf where it is not."""
        ahead = math.cos(pose.yaw) * (x - pose.x) + math.sin(pose.yaw) * (y - pose.y)
        left = math.cos(pose.yaw) * (y - pose.y) - math.sin(pose.yaw) * (x - pose.x)
        depth = np.full(WIDTH, np.inf)
        if ahead > radius:
            away = np.abs(np.tan(self._bearings) * ahead - left)
            seen = (away < radius) & (ahead < behind)
            depth[seen] = ahead
        return depth
