"""Velocities in the plane."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Twist:
    """A velocity of a base in its own frame, as far as it moves in the plane."""

    vx: float = 0.0
    """Metres per second forward."""

    vy: float = 0.0
    """Metres per second to the left; 0 unless the base is holonomic."""

    wz: float = 0.0
    """Radians per second, counter-clockwise."""

    @property
    def is_zero(self) -> bool:
        """Whether every component is exactly 0."""
        return self.vx == 0 and self.vy == 0 and self.wz == 0

    @property
    def is_finite(self) -> bool:
        """Whether no component is NaN or infinite."""
        return all(map(math.isfinite, (self.vx, self.vy, self.wz)))
