"""Vectors in space."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Vector3:
    """Three numbers along x, y and z, as ``geometry_msgs/Vector3`` and ``Point``."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
