"""Where sensors sit on a base, and how they are turned there."""

import math

import numpy as np
from numpy.typing import NDArray

from webmap.base.geometry import Quaternion, Vector3
from webmap.ros.tf import Transform

LASER_HEIGHT = 0.2
"""Of the lasers above the floor, in metres."""

OPTICAL = Transform(rotation=Quaternion(-0.5, 0.5, -0.5, 0.5))
"""What takes an optical frame, whose x points to the right, y down and z forward, to
that of its camera, which is turned as its robot is (REP 103)."""

OVER = Transform(rotation=Quaternion(1.0, 0.0, 0.0, 0.0))
"""Upside down: turned by half a turn about x."""


def mount(ahead: float, height: float, *, down: float = 0.0) -> Transform:
    """Return where a sensor is that looks ahead.

    Args:
        ahead: Metres along the x of the base.
        height: Metres above it.
        down: How far it looks down, in radians.

    """
    tilt = Quaternion(0.0, math.sin(down / 2), 0.0, math.cos(down / 2))
    return Transform(Vector3(ahead, 0.0, height), tilt)


def overhead(ranges: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return a sweep all around as a scanner has it that hangs upside down.

    Its rays go the other way about; the one straight back stays the first.
    """
    return np.roll(ranges[::-1], 1)


def seen_from(sensor: Transform, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points of the base in the frame of a sensor, of shape (N, 3), in metres.

    Args:
        sensor: Where it is on the base.
        points: Of shape (N, 3), in metres.

    """
    rows = np.array(sensor.inverse.rows)
    return np.asarray(points @ rows[:, :3].T + rows[:, 3])
