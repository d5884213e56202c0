"""A planar laser scanner, rays of other sensors, and poses of sensors on a base.

Rays are cast exactly on the grid.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from webmap.base.geometry import Pose, Quaternion, Vector3
from webmap.ros.tf import Transform
from webmap.sim.maps import Obstacles

_NUDGE = 1e-6
_TINY = 1e-12
_NAN_SHARE = 0.03

_MOST_KEPT = 1 << 18
"""Most lengths of rays that a sensor keeps, 8 bytes each."""


@dataclass(frozen=True, slots=True)
class ScannerOptions:
    """What a laser scanner measures: rays, ranges and faults."""

    beams: int = 360
    """Rays of one sweep, over the full circle from -pi, counter-clockwise."""

    range_min: float = 0.1
    """The shortest range, in metres; nearer obstacles give -inf (REP 117)."""

    range_max: float = 8.0
    """The longest range, in metres; without a nearer obstacle the range is inf."""

    nan: bool = False
    """Whether a few rays of each sweep are NaN."""


class Scanner:
    """Measures ranges for many poses at once."""

    def __init__(
        self, obstacles: Obstacles, options: ScannerOptions, seed: int = 0
    ) -> None:
        self.obstacles = obstacles
        self.options = options
        self._random = np.random.default_rng(seed)
        bearings = -math.pi + np.arange(float(options.beams)) * self.angle_increment
        self._rays = ScannerRays(obstacles, bearings, options.range_max)

    @property
    def angle_increment(self) -> float:
        """The angle between adjacent rays, in radians."""
        return math.tau / self.options.beams

    def sweep(
        self,
        poses: Sequence[Pose],
        discs: Sequence[Sequence[tuple[float, float, float]]] = (),
    ) -> NDArray[np.float32]:
        """Return the ranges seen from each pose.

        Args:
            poses: Poses of the scanners, in the map's frame.
            discs: For each pose, the round obstacles in range as x, y and radius in
                metres.

        Returns:
            Ranges in metres, of shape (poses, beams).

        """
        along_x, along_y, ranges = self._rays.cast(poses)
        for i, round_things in enumerate(discs):
            for x, y, radius in round_things:
                shade(ranges[i], along_x[i], along_y[i], poses[i], x, y, radius)
        return self._as_measured(ranges)

    def _as_measured(self, ranges: NDArray[np.float64]) -> NDArray[np.float32]:
        ranges[ranges > self.options.range_max] = np.inf
        ranges[ranges < self.options.range_min] = -np.inf
        if self.options.nan:
            ranges[self._random.random(ranges.shape) < _NAN_SHARE] = np.nan
        return ranges.astype(np.float32)


class ScannerRays:
    """The rays of a sensor that many robots have.

    Most robots stand still, and several topics have what one sensor sees. So the
    lengths for the newest poses are kept.

    Args:
        obstacles: The grid.
        bearings: Angles of the rays from the heading, in radians, of shape (rays,).
        farthest: Greatest length, in metres.

    """

    def __init__(
        self, obstacles: Obstacles, bearings: NDArray[np.float64], farthest: float
    ) -> None:
        self._obstacles = obstacles
        self._bearings = bearings
        self._farthest = farthest
        self._kept: dict[Pose, NDArray[np.float64]] = {}

    def cast(self, poses: Sequence[Pose]) -> NDArray[np.float64]:
        """Return directions and lengths of the rays from each pose.

        Args:
            poses: Poses of the sensors, in the map's frame.

        Returns:
            The directions along x and along y, of length 1, and the lengths in metres,
            inf for rays without a hit; of shape (3, poses, rays).

        """
        yaws = np.array([pose.yaw for pose in poses])[:, np.newaxis]
        angles = yaws + self._bearings
        along = np.cos(angles), np.sin(angles)
        if (len(self._kept) + len(poses)) * len(self._bearings) > _MOST_KEPT:
            self._kept.clear()
        new = [i for i, pose in enumerate(poses) if pose not in self._kept]
        if new:
            self._keep([poses[i] for i in new], along[0][new], along[1][new])
        lengths = np.array([self._kept[pose] for pose in poses])
        return np.stack([*along, lengths.reshape(angles.shape)])

    def _keep(
        self,
        poses: Sequence[Pose],
        along_x: NDArray[np.float64],
        along_y: NDArray[np.float64],
    ) -> None:
        rays = len(self._bearings)
        lengths = cast_rays(
            self._obstacles,
            np.repeat([pose.x for pose in poses], rays),
            np.repeat([pose.y for pose in poses], rays),
            along_x.ravel(),
            along_y.ravel(),
            self._farthest,
        )
        self._kept.update(zip(poses, lengths.reshape(-1, rays), strict=True))


def cast_rays(
    obstacles: Obstacles,
    xs: NDArray[np.float64],
    ys: NDArray[np.float64],
    along_x: NDArray[np.float64],
    along_y: NDArray[np.float64],
    farthest: float,
) -> NDArray[np.float64]:
    """Return the length of each ray up to the edge of a solid cell.

    A ray jumps over the largest empty square around its cell, so it visits only the
    necessary cells; the result is exact to the edges of the cells.

    Args:
        obstacles: The grid.
        xs: Start of the rays along x, in metres.
        ys: Start of the rays along y, in metres.
        along_x: Their directions, of length 1.
        along_y: The same, along y.
        farthest: Greatest length, in metres.

    Returns:
        Distances in metres; inf for rays without a hit.

    """
    plan, steps = obstacles.plan, obstacles.steps
    rows, columns = steps.shape
    limit = farthest / plan.resolution
    x0 = (xs - plan.x) / plan.resolution
    y0 = (ys - plan.y) / plan.resolution
    result = np.full(xs.shape, np.inf)
    left = np.arange(len(xs))
    gone = np.zeros(len(xs))
    # A ray along an axis meets the edges of the other axis beyond all limits.
    along_x = np.where(np.abs(along_x) < _TINY, _TINY, along_x)
    along_y = np.where(np.abs(along_y) < _TINY, _TINY, along_y)
    per_x, per_y = 1 / along_x, 1 / along_y
    right, up = along_x > 0, along_y > 0
    while len(left):
        column = np.floor(x0 + gone * along_x).astype(np.intp)
        row = np.floor(y0 + gone * along_y).astype(np.intp)
        inside = ((column >= 0) & (column < columns) & (row >= 0) & (row < rows)) & (
            gone <= limit
        )
        clear = np.zeros(len(left), np.int16)
        clear[inside] = steps[row[inside], column[inside]]
        hit = inside & (clear == 0)
        # The last nudge passed the edge: subtract it.
        result[left[hit]] = np.maximum(gone[hit] - _NUDGE, 0)
        on = inside & ~hit
        left, gone, clear = left[on], gone[on], clear[on]
        column, row, x0, y0 = column[on], row[on], x0[on], y0[on]
        along_x, along_y, right, up = along_x[on], along_y[on], right[on], up[on]
        per_x, per_y = per_x[on], per_y[on]
        edge_x = np.where(right, column + clear, column - clear + 1)
        edge_y = np.where(up, row + clear, row - clear + 1)
        leap = np.minimum((edge_x - x0) * per_x, (edge_y - y0) * per_y)
        gone = np.maximum(leap, gone) + _NUDGE
    return np.asarray(result * plan.resolution)


def shade(
    ranges: NDArray[np.float64],
    along_x: NDArray[np.float64],
    along_y: NDArray[np.float64],
    pose: Pose,
    x: float,
    y: float,
    radius: float,
) -> None:
    """Shorten the ranges of rays that hit a disc first.

    Args:
        ranges: In metres, of shape (rays,); changed in place.
        along_x: The rays' directions, of length 1.
        along_y: The same, along y.
        pose: Start of the rays.
        x: The disc's center, in metres.
        y: The same, along y.
        radius: Radius of the disc, in metres.

    """
    to_x, to_y = x - pose.x, y - pose.y
    ahead = to_x * along_x + to_y * along_y
    aside = to_x * along_y - to_y * along_x
    meets = (ahead > 0) & (np.abs(aside) < radius)
    near = ahead[meets] - np.sqrt(radius * radius - aside[meets] ** 2)
    ranges[meets] = np.minimum(ranges[meets], np.maximum(near, 0))


LASER_HEIGHT = 0.2
"""Height of the lasers above the floor, in metres."""

OPTICAL = Transform(rotation=Quaternion(-0.5, 0.5, -0.5, 0.5))
"""Transform from an optical frame (x right, y down, z forward) to the frame of its
camera, which is oriented like the robot (REP 103)."""

OVER = Transform(rotation=Quaternion(1.0, 0.0, 0.0, 0.0))
"""Upside down: half a turn about x."""


def mount(ahead: float, height: float, *, down: float = 0.0) -> Transform:
    """Return the pose of a sensor that looks ahead.

    Args:
        ahead: Metres along the x of the base.
        height: Metres above the base.
        down: Downward tilt, in radians.

    """
    tilt = Quaternion(0.0, math.sin(down / 2), 0.0, math.cos(down / 2))
    return Transform(Vector3(ahead, 0.0, height), tilt)


def overhead(ranges: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a full sweep as a scanner mounted upside down measures it.

    Its rays are in the opposite order; the ray straight back stays the first.
    """
    return np.roll(ranges[::-1], 1)


def seen_from(sensor: Transform, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points of the base in the frame of a sensor, of shape (N, 3), in metres.

    Args:
        sensor: Pose of the sensor on the base.
        points: Of shape (N, 3), in metres.

    """
    rows = np.array(sensor.inverse.rows)
    return np.asarray(points @ rows[:, :3].T + rows[:, 3])
