"""Poses in the plane."""

import math
from dataclasses import dataclass

from webmap.geometry.angles import normalize_angle


@dataclass(frozen=True, slots=True)
class Pose:
    """A place and a heading in the plane of a frame that the context names."""

    x: float = 0.0
    """Metres along the frame's x."""

    y: float = 0.0
    """Metres along the frame's y."""

    yaw: float = 0.0
    """Radians from the frame's x, counter-clockwise."""

    def __matmul__(self, other: "Pose") -> "Pose":
        """Return ``other``, given in this pose's own frame, in the outer frame."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose(
            self.x + cos * other.x - sin * other.y,
            self.y + sin * other.x + cos * other.y,
            normalize_angle(self.yaw + other.yaw),
        )

    @property
    def inverse(self) -> "Pose":
        """The pose that undoes this one: ``pose @ pose.inverse`` is the origin."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose(
            -cos * self.x - sin * self.y,
            sin * self.x - cos * self.y,
            normalize_angle(-self.yaw),
        )
