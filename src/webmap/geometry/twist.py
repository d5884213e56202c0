"""Velocities of a base."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Twist:
    """A velocity of a base in its own frame.

    The first three numbers move it in the plane. The others are 0 for every base that
    moves on the ground.
    """

    vx: float = 0.0
    """Metres per second forward."""

    vy: float = 0.0
    """Metres per second to the left; 0 unless the base is holonomic."""

    wz: float = 0.0
    """Radians per second, counter-clockwise."""

    vz: float = 0.0
    """Metres per second upward."""

    wx: float = 0.0
    """Radians per second about the forward axis."""

    wy: float = 0.0
    """Radians per second about the left axis."""

    @property
    def numbers(self) -> tuple[float, float, float, float, float, float]:
        """All six components, in the order of the fields."""
        return (self.vx, self.vy, self.wz, self.vz, self.wx, self.wy)

    @property
    def speed(self) -> float:
        """Metres per second, whatever the direction."""
        return math.hypot(self.vx, self.vy, self.vz)

    @property
    def turn(self) -> float:
        """Radians per second, whatever the axis."""
        return math.hypot(self.wx, self.wy, self.wz)

    @property
    def is_zero(self) -> bool:
        """Whether every component is exactly 0."""
        return not any(self.numbers)

    @property
    def is_finite(self) -> bool:
        """Whether no component is NaN or infinite."""
        return all(map(math.isfinite, self.numbers))

    def to_message(self) -> dict[str, dict[str, float]]:
        """Return it as ``geometry_msgs/Twist`` has it."""
        return {
            "linear": {"x": self.vx, "y": self.vy, "z": self.vz},
            "angular": {"x": self.wx, "y": self.wy, "z": self.wz},
        }
