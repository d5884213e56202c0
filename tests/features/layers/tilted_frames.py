"""Frames that are turned about any axis, computed without WebMap's code."""

import math

import numpy as np
from test_layers_at_stamp import stamp

OPTICAL = (-math.pi / 2, 0.0, -math.pi / 2)
"""The turn of a camera that looks ahead: x right, y down and z forward (REP 103)."""

OVER = (math.pi, 0.0, 0.0)
"""Upside down."""


def matrix(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return the rotation matrix of turns about fixed x, then y, then z."""
    (sr, sp, sy), (cr, cp, cy) = np.sin((roll, pitch, yaw)), np.cos((roll, pitch, yaw))
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def quaternion(roll: float, pitch: float, yaw: float) -> dict:
    """The same as ``geometry_msgs/Quaternion``."""
    (sr, sp, sy) = (math.sin(a / 2) for a in (roll, pitch, yaw))
    (cr, cp, cy) = (math.cos(a / 2) for a in (roll, pitch, yaw))
    return {
        "x": sr * cp * cy - cr * sp * sy,
        "y": cr * sp * cy + sr * cp * sy,
        "z": cr * cp * sy - sr * sp * cy,
        "w": cr * cp * cy + sr * sp * sy,
    }


def posed(place, turns=(0.0, 0.0, 0.0)) -> dict:
    """A ``geometry_msgs/Pose`` in space."""
    at = dict(zip("xyz", map(float, place), strict=True))
    return {"position": at, "orientation": quaternion(*turns)}


def frame(parent, child, place, turns=(0.0, 0.0, 0.0), seconds=0.0) -> dict:
    """A ``geometry_msgs/TransformStamped``: where a frame is, and how it is turned."""
    at = posed(place, turns)
    return {
        "header": {"stamp": stamp(seconds), "frame_id": parent},
        "child_frame_id": child,
        "transform": {"translation": at["position"], "rotation": at["orientation"]},
    }


def transformed(points, *frames: dict) -> np.ndarray:
    """Return points of the last frame in the parent of the first, of shape (N, 3)."""
    found = np.asarray(points, float).reshape(-1, 3)
    for each in reversed(frames):
        turn, by = each["transform"]["rotation"], each["transform"]["translation"]
        found = found @ _of(turn).T + [by[axis] for axis in "xyz"]
    return found


def _of(turn: dict) -> np.ndarray:
    x, y, z, w = (turn[part] for part in "xyzw")
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
