"""Positions, orientations, velocities, and the matrices of the view.

Lengths are metres and angles radians unless a name shows another unit (REP 103).
"""

import math
from typing import Protocol

import msgspec

FARTHEST = 1e7
"""Metres: a number beyond the size of a planet is an error that no browser can draw.

Finite numbers such as 1e300 overflow the single precision that browsers draw with, and
the whole view then fits nothing.
"""


class Vector3(msgspec.Struct, frozen=True, gc=False):
    """Three numbers along x, y and z, as in ``geometry_msgs/Vector3`` and ``Point``."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


def normalize_angle(angle: float) -> float:
    """Return the same direction as ``angle`` in ``[-pi, pi]``, in radians.

    Raises:
        ValueError: If ``angle`` is infinite.

    """
    return math.remainder(angle, math.tau)


class Quaternion(msgspec.Struct, frozen=True, gc=False):
    """An orientation, with the component names of ``geometry_msgs/Quaternion``."""

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
        """The length; 1 for a rotation, 0 or NaN if a message holds no rotation."""
        return math.hypot(self.x, self.y, self.z, self.w)

    @property
    def yaw(self) -> float:
        """The heading about z, in radians in ``[-pi, pi]``, for any norm.

        It is 0 for a quaternion of zeros and NaN for one with NaN.
        """
        return math.atan2(
            2 * (self.w * self.z + self.x * self.y),
            self.w * self.w + self.x * self.x - self.y * self.y - self.z * self.z,
        )


class Twist(msgspec.Struct, frozen=True, gc=False):
    """The velocity of a robot's base in its own frame.

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
        """Metres per second, in any direction."""
        return math.hypot(self.vx, self.vy, self.vz)

    @property
    def turn(self) -> float:
        """Radians per second, about any axis."""
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
        """Return the fields of a ``geometry_msgs/Twist``."""
        return {
            "linear": {"x": self.vx, "y": self.vy, "z": self.vz},
            "angular": {"x": self.wx, "y": self.wy, "z": self.wz},
        }


class Pose(msgspec.Struct, frozen=True, gc=False):
    """A position and a heading in the plane of a frame that the context defines."""

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
        """The inverse pose: ``pose @ pose.inverse`` is the origin."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return Pose(
            -cos * self.x - sin * self.y,
            sin * self.x - cos * self.y,
            normalize_angle(-self.yaw),
        )


class Affine(msgspec.Struct, frozen=True, gc=False):
    """An affine transform of the plane, with the component names of ``SVGMatrix``.

    A point ``(x, y)`` becomes ``(a*x + c*y + e, b*x + d*y + f)``.
    """

    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 1.0
    e: float = 0.0
    f: float = 0.0

    @classmethod
    def of_pose(cls, pose: "Pose") -> "Affine":
        """Return the transform from the frame that has this pose to the outer frame."""
        cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
        return cls(cos, sin, -sin, cos, pose.x, pose.y)

    @classmethod
    def into_pose(cls, pose: "Pose") -> "Affine":
        """Return the transform from the outer frame to the frame that has this pose."""
        cos, sin = math.cos(pose.yaw), math.sin(pose.yaw)
        det = cos * cos + sin * sin
        a, b = cos / det, sin / det
        x, y = pose.x, pose.y
        return cls(a, -b, b, a, -(a * x + b * y), -(-b * x + a * y))

    @classmethod
    def translation(cls, x: float, y: float) -> "Affine":
        """Return the transform that moves every point by ``(x, y)``."""
        return cls(e=x, f=y)

    @classmethod
    def scaling(cls, factor: float, x: float = 0.0, y: float = 0.0) -> "Affine":
        """Return the transform that scales by ``factor`` and keeps ``(x, y)``.

        Raises:
            ValueError: If ``factor`` is not a finite number above 0.

        """
        if not (math.isfinite(factor) and factor > 0):
            raise ValueError(f"factor must be a number above 0, got {factor}")
        return cls(factor, 0.0, 0.0, factor, x - factor * x, y - factor * y)

    @classmethod
    def rotation(cls, angle: float, x: float = 0.0, y: float = 0.0) -> "Affine":
        """Return the rotation by ``angle`` that keeps ``(x, y)``.

        Args:
            angle: Radians from the first axis towards the second. On a screen, where y
                points down, this is clockwise.
            x: The fixed point, along the first axis.
            y: The fixed point, along the second axis.

        """
        cos, sin = math.cos(angle), math.sin(angle)
        return cls(cos, sin, -sin, cos, x - cos * x + sin * y, y - sin * x - cos * y)

    def __matmul__(self, other: "Affine") -> "Affine":
        """Return the transform that applies ``other`` first, then this one."""
        return Affine(
            self.a * other.a + self.c * other.b,
            self.b * other.a + self.d * other.b,
            self.a * other.c + self.c * other.d,
            self.b * other.c + self.d * other.d,
            self.a * other.e + self.c * other.f + self.e,
            self.b * other.e + self.d * other.f + self.f,
        )

    def apply(self, x: float, y: float) -> tuple[float, float]:
        """Return the transformed point of ``(x, y)``."""
        return (self.a * x + self.c * y + self.e, self.b * x + self.d * y + self.f)

    @property
    def determinant(self) -> float:
        """The factor by which areas grow; negative if the transform mirrors."""
        return self.a * self.d - self.b * self.c

    @property
    def inverse(self) -> "Affine":
        """The inverse transform.

        Raises:
            ValueError: If the transform flattens the plane.

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


class Position(Protocol):
    """Anything with ``x`` and ``y`` in metres."""

    @property
    def x(self) -> float:
        """Metres along x."""

    @property
    def y(self) -> float:
        """Metres along y."""


class Orientation(Protocol):
    """Anything with the components of a quaternion."""

    @property
    def x(self) -> float:
        """The component along x."""

    @property
    def y(self) -> float:
        """The component along y."""

    @property
    def z(self) -> float:
        """The component along z."""

    @property
    def w(self) -> float:
        """The real component."""
