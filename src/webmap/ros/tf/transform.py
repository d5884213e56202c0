"""The transform between two frames, in space, and its errors."""

import math

import msgspec

from webmap.base.errors import WebMapError
from webmap.base.geometry import FARTHEST, Affine, Pose, Quaternion, Vector3

NEARLY = 0.1
"""Greatest difference of a quaternion's norm from 1; it is then normalised."""

_PARALLEL = 0.9995
"""Cosine of half an angle above which rotations are interpolated linearly."""

_LEVEL = 1e-6
"""Sine of half an angle below which a tilt is invisible."""

_HERE = Vector3()
_STRAIGHT = Quaternion()


class TransformError(WebMapError):
    """A transform that is invalid or not known; the sentence gives the reason."""


class FrameMissing(TransformError, LookupError):
    """There is no frame of that name."""


class NotConnected(TransformError):
    """Both frames exist, but in two trees without a connection."""


class NotKnownThen(TransformError):
    """Both frames are connected, but a transform between is not known at that time."""


class Transform(msgspec.Struct, frozen=True, gc=False):
    """A transform from coordinates of one frame to those of another: turns, then moves.

    Its name shows the frames: ``map_from_base`` transforms coordinates of the base to
    coordinates of the map, and so does ``map_from_odom @ odom_from_base``.
    """

    translation: Vector3 = _HERE
    """The origin of the one frame in the other, in metres."""

    rotation: Quaternion = _STRAIGHT
    """The rotation of the one frame in the other, of norm 1."""

    @classmethod
    def from_pose(cls, pose: Pose) -> "Transform":
        """Return the transform of a frame that has this pose in the plane."""
        return cls(Vector3(pose.x, pose.y), Quaternion.from_yaw(pose.yaw))

    @property
    def planar(self) -> Pose:
        """Position and heading seen from above."""
        return Pose(self.translation.x, self.translation.y, self.rotation.yaw)

    @property
    def from_above(self) -> Affine:
        """The affine transform of the points of its own plane, seen from above.

        It mirrors a frame that is upside down, and flattens one whose plane is
        vertical.
        """
        q, by = self.rotation, self.translation
        a, b, _ = _turn(q, 1.0, 0.0, 0.0)
        c, d, _ = _turn(q, 0.0, 1.0, 0.0)
        return Affine(a, b, c, d, by.x, by.y)

    @property
    def upright(self) -> bool:
        """Whether z points up: the rotation is about z alone."""
        return abs(self.rotation.x) < _LEVEL and abs(self.rotation.y) < _LEVEL

    @property
    def heading_and_tilt(self) -> tuple[Pose, "Transform"]:
        """Return position and heading seen from above, and the rest.

        The rest tilts and lifts, and is applied first. The whole transform is
        ``Transform.from_pose(pose) @ tilt``. For an upright frame the rest only lifts.
        """
        q, by = self.rotation, self.translation
        pose = Pose(by.x, by.y, q.yaw)
        lift = Vector3(0.0, 0.0, by.z)
        if abs(q.x) < _LEVEL and abs(q.y) < _LEVEL:  # upright
            return pose, Transform(lift)
        return pose, Transform(lift, _times(Quaternion.from_yaw(-pose.yaw), q))

    @property
    def rows(self) -> tuple[tuple[float, float, float, float], ...]:
        """The upper three rows of its matrix; the last column is the translation."""
        q, by = self.rotation, self.translation
        x = _turn(q, 1.0, 0.0, 0.0)
        y = _turn(q, 0.0, 1.0, 0.0)
        z = _turn(q, 0.0, 0.0, 1.0)
        return (
            (x[0], y[0], z[0], by.x),
            (x[1], y[1], z[1], by.y),
            (x[2], y[2], z[2], by.z),
        )

    def apply(self, point: Vector3) -> Vector3:
        """Return the coordinates of a point in the other frame."""
        x, y, z = _turn(self.rotation, point.x, point.y, point.z)
        by = self.translation
        return Vector3(x + by.x, y + by.y, z + by.z)

    def __matmul__(self, other: "Transform") -> "Transform":
        """Return the transform that applies ``other`` first, then this one."""
        q, by, to = self.rotation, self.translation, other.translation
        x, y, z = _turn(q, to.x, to.y, to.z)
        return Transform(
            Vector3(x + by.x, y + by.y, z + by.z), _times(q, other.rotation)
        )

    @property
    def inverse(self) -> "Transform":
        """The transform back; after this one it changes nothing."""
        back = _conjugate(self.rotation)
        by = self.translation
        x, y, z = _turn(back, by.x, by.y, by.z)
        return Transform(Vector3(-x, -y, -z), back)

    def checked(self) -> "Transform":
        """Return the same transform with a rotation of norm 1.

        Raises:
            TransformError: If a number is not finite, the rotation is zero, or the
                frame is farther away than any robot can be.

        """
        t, q = self.translation, self.rotation
        numbers = (t.x, t.y, t.z, q.x, q.y, q.z, q.w)
        if not all(map(math.isfinite, numbers)):
            got = ", ".join(f"{number:g}" for number in numbers)
            raise TransformError(f"its position or rotation is not finite: {got}")
        if max(abs(t.x), abs(t.y), abs(t.z)) > FARTHEST:
            raise TransformError(
                f"a frame must be within {FARTHEST:g} m, got ({t.x:g}, {t.y:g}, "
                f"{t.z:g})"
            )
        norm = q.norm
        if abs(norm - 1.0) > NEARLY:
            got = f"{norm:g}" if norm else "0 (it is all zeros)"
            raise TransformError(f"the rotation has a norm of {got}, expected 1")
        return Transform(t, Quaternion(q.x / norm, q.y / norm, q.z / norm, q.w / norm))


def between(one: Transform, other: Transform, share: float) -> Transform:
    """Return the interpolated transform between two transforms.

    Positions are interpolated on a straight line, rotations evenly over the shorter
    angle.

    Args:
        one: The result at 0.
        other: The result at 1.
        share: The fraction, from 0 to 1.

    """
    a, b, p, q = one.translation, other.translation, one.rotation, other.rotation
    rest = 1.0 - share
    place = Vector3(
        rest * a.x + share * b.x, rest * a.y + share * b.y, rest * a.z + share * b.z
    )
    cosine = p.x * q.x + p.y * q.y + p.z * q.z + p.w * q.w
    sign = 1.0 if cosine >= 0 else -1.0  # both are one rotation; take the nearer
    cosine = min(abs(cosine), 1.0)
    if cosine > _PARALLEL:
        first, second = rest, share
    else:
        angle = math.acos(cosine)
        first = math.sin(rest * angle) / math.sin(angle)
        second = math.sin(share * angle) / math.sin(angle)
    second *= sign
    return Transform(
        place,
        _normalised(
            first * p.x + second * q.x,
            first * p.y + second * q.y,
            first * p.z + second * q.z,
            first * p.w + second * q.w,
        ),
    )


def alike(one: Transform, other: Transform, apart: float, turned: float) -> bool:
    """Return whether two transforms are the same within tolerances.

    Args:
        one: One transform.
        other: The other transform.
        apart: Tolerance of the position, in metres.
        turned: Tolerance of the rotation, in radians.

    """
    a, b, p, q = one.translation, other.translation, one.rotation, other.rotation
    if math.dist((a.x, a.y, a.z), (b.x, b.y, b.z)) > apart:
        return False
    # Half the angle: its sine is exact where its cosine is not.
    rest = _times(_conjugate(p), q)
    return math.hypot(rest.x, rest.y, rest.z) <= math.sin(min(turned, math.pi) / 2)


def _normalised(x: float, y: float, z: float, w: float) -> Quaternion:
    norm = math.hypot(x, y, z, w)
    return Quaternion(x / norm, y / norm, z / norm, w / norm)


def _times(p: Quaternion, q: Quaternion) -> Quaternion:
    return _normalised(
        p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
        p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x,
        p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w,
        p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z,
    )


def _conjugate(q: Quaternion) -> Quaternion:
    return Quaternion(-q.x, -q.y, -q.z, q.w)


def _turn(q: Quaternion, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Return a rotated vector, as bare numbers."""
    # v + 2 w (u x v) + 2 u x (u x v), where u is the vector part.
    tx = 2.0 * (q.y * z - q.z * y)
    ty = 2.0 * (q.z * x - q.x * z)
    tz = 2.0 * (q.x * y - q.y * x)
    return (
        x + q.w * tx + q.y * tz - q.z * ty,
        y + q.w * ty + q.z * tx - q.x * tz,
        z + q.w * tz + q.x * ty - q.y * tx,
    )
