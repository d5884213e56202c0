"""Orientations as quaternions."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Quaternion:
    """An orientation, with the components' names of ``geometry_msgs/Quaternion``."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0

    @classmethod
    def from_yaw(cls, yaw: float) -> "Quaternion":
        """Return the rotation by ``yaw`` radians about z, counter-clockwise."""
        return cls(0.0, 0.0, math.sin(yaw / 2), math.cos(yaw / 2))

    @property
    def norm(self) -> float:
        """The length; 1 for a rotation, 0 or NaN for a message that is none."""
        return math.hypot(self.x, self.y, self.z, self.w)

    @property
    def yaw(self) -> float:
        """The heading about z, in radians in ``[-pi, pi]``, whatever the norm.

        It is 0 for a quaternion of zeros and NaN for one with NaN.
        """
        return math.atan2(
            2 * (self.w * self.z + self.x * self.y),
            self.w * self.w + self.x * self.x - self.y * self.y - self.z * self.z,
        )
