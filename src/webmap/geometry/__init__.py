"""Positions, orientations and the matrices of the view: plain values, no I/O.

Lengths are metres and angles radians unless a name says otherwise (REP 103).
"""

from webmap.geometry.affine import Affine
from webmap.geometry.angles import normalize_angle
from webmap.geometry.pose import Pose
from webmap.geometry.rotation import Quaternion
from webmap.geometry.twist import Twist
from webmap.geometry.vector import Vector3

__all__ = ["Affine", "Pose", "Quaternion", "Twist", "Vector3", "normalize_angle"]
