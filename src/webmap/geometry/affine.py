"""Affine maps of the plane: what carries world coordinates to the screen."""

import math
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Affine:
    """A map of the plane, with the components' names of ``SVGMatrix``.

    A point ``(x, y)`` goes to ``(a*x + c*y + e, b*x + d*y + f)``.
    """

    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 1.0
    e: float = 0.0
    f: float = 0.0

    @classmethod
    def translation(cls, x: float, y: float) -> "Affine":
        """Return the map that moves every point by ``(x, y)``."""
        return cls(e=x, f=y)

    @classmethod
    def scaling(cls, factor: float, x: float = 0.0, y: float = 0.0) -> "Affine":
        """Return the map that scales by ``factor`` and leaves ``(x, y)`` in place.

        Raises:
            ValueError: If ``factor`` is not a finite number above 0.

        """
        if not (math.isfinite(factor) and factor > 0):
            raise ValueError(f"factor must be a number above 0, got {factor}")
        return cls(factor, 0.0, 0.0, factor, x - factor * x, y - factor * y)

    @classmethod
    def rotation(cls, angle: float, x: float = 0.0, y: float = 0.0) -> "Affine":
        """Return the turn by ``angle`` that leaves ``(x, y)`` in place.

        Args:
            angle: Radians from the first axis towards the second. Seen on a screen,
                where y points down, that is clockwise.
            x: The point that stays, along the first axis.
            y: The point that stays, along the second axis.

        """
        cos, sin = math.cos(angle), math.sin(angle)
        return cls(cos, sin, -sin, cos, x - cos * x + sin * y, y - sin * x - cos * y)

    def __matmul__(self, other: "Affine") -> "Affine":
        """Return the map that applies ``other`` first and this one to its result."""
        return Affine(
            self.a * other.a + self.c * other.b,
            self.b * other.a + self.d * other.b,
            self.a * other.c + self.c * other.d,
            self.b * other.c + self.d * other.d,
            self.a * other.e + self.c * other.f + self.e,
            self.b * other.e + self.d * other.f + self.f,
        )

    def apply(self, x: float, y: float) -> tuple[float, float]:
        """Return where the point ``(x, y)`` goes."""
        return (self.a * x + self.c * y + self.e, self.b * x + self.d * y + self.f)

    @property
    def determinant(self) -> float:
        """The factor by which areas grow; negative if the map mirrors."""
        return self.a * self.d - self.b * self.c

    @property
    def inverse(self) -> "Affine":
        """The map that undoes this one.

        Raises:
            ValueError: If the map flattens the plane.

        """
        det = self.determinant
        if not det:
            raise ValueError(f"{self} flattens the plane and has no inverse")
        a, b, c, d = self.d / det, -self.b / det, -self.c / det, self.a / det
        return Affine(
            a, b, c, d, -(a * self.e + c * self.f), -(b * self.e + d * self.f)
        )

    @property
    def values(self) -> tuple[float, float, float, float, float, float]:
        """The six components, in the order of SVG's ``matrix()``."""
        return (self.a, self.b, self.c, self.d, self.e, self.f)
