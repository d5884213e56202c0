"""Poses of sensors on a base."""

import math

import numpy as np
from numpy.typing import NDArray

from webmap.base.geometry import Quaternion, Vector3
from webmap.ros.tf import Transform

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
