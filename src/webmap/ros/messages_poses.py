"""Typed views of poses in numbers, of their doubt, and of polygons."""

import math
from typing import TYPE_CHECKING

import msgspec

from webmap.errors import ProtocolError
from webmap.geometry.reach import FARTHEST
from webmap.ros.limits import check_items
from webmap.ros.messages import PointMsg, PoseMsg, Stamped

if TYPE_CHECKING:
    from webmap.geometry import Pose


class PoseArrayMsg(Stamped, frozen=True, kw_only=True):
    """``geometry_msgs/PoseArray``."""

    poses: list[PoseMsg]


class ParticleMsg(msgspec.Struct, frozen=True, gc=False):
    """``nav2_msgs/Particle``."""

    pose: PoseMsg
    weight: float = 0.0


class ParticleCloudMsg(Stamped, frozen=True, kw_only=True):
    """``nav2_msgs/ParticleCloud``."""

    particles: list[ParticleMsg]

    @property
    def poses(self) -> list[PoseMsg]:
        """The poses, as in ``geometry_msgs/PoseArray``."""
        return [particle.pose for particle in self.particles]


class DoubtfulPoseMsg(msgspec.Struct, frozen=True):
    """``geometry_msgs/PoseWithCovariance``, covariance and all."""

    pose: PoseMsg
    covariance: list[float]
    """36 numbers, row by row: x, y, z and turns about them."""


class Ellipse(msgspec.Struct, frozen=True):
    """Where something is with a certain probability."""

    major: float
    """The longer half axis, in standard deviations of a metre."""

    minor: float
    """The shorter half axis."""

    yaw: float
    """How far the longer axis is turned from x, in radians."""


class DoubtfulPoseStampedMsg(Stamped, frozen=True, kw_only=True):
    """``geometry_msgs/PoseWithCovarianceStamped`` and ``nav_msgs/Odometry``.

    Both have the same fields as far as they are wanted here.
    """

    pose: DoubtfulPoseMsg

    @property
    def place(self) -> "Pose":
        """Place and heading in the plane.

        Raises:
            ProtocolError: If it is not finite, or a quaternion of zeros.

        """
        return self.pose.pose.usable

    @property
    def ellipse(self) -> Ellipse:
        """The ellipse of one standard deviation about the place.

        Raises:
            ProtocolError: If the covariance has not 36 finite numbers, or its part in
                the plane is that of no spread at all, or of one that nothing can have.

        """
        c = self._covariance()
        xx, xy, yy = c[0], (c[1] + c[6]) / 2, c[7]
        middle, apart = (xx + yy) / 2, math.hypot((xx - yy) / 2, xy)
        low, high = middle - apart, middle + apart
        if low < -1e-9 * max(1.0, abs(high)):
            raise ProtocolError(
                f"the covariance ({xx}, {xy}; {xy}, {yy}) in the plane has a spread "
                "below 0"
            )
        if not high <= FARTHEST**2:
            raise ProtocolError(
                f"the covariance ({xx:g}, {xy:g}; {xy:g}, {yy:g}) in the plane has a "
                f"spread of more than {FARTHEST:g} m"
            )
        yaw = 0.5 * math.atan2(2 * xy, xx - yy)
        return Ellipse(math.sqrt(max(0.0, high)), math.sqrt(max(0.0, low)), yaw)

    @property
    def heading_deviation(self) -> float:
        """The standard deviation of the heading, in radians.

        Raises:
            ProtocolError: If the covariance has not 36 finite numbers, or it is
                negative.

        """
        variance = self._covariance()[35]
        if variance < 0:
            raise ProtocolError(f"the heading has a variance of {variance}, below 0")
        return math.sqrt(variance)

    def _covariance(self) -> list[float]:
        numbers = self.pose.covariance
        if len(numbers) != 36:
            raise ProtocolError(f"a covariance has 36 numbers, got {len(numbers)}")
        if not all(math.isfinite(numbers[i]) for i in (0, 1, 6, 7, 35)):
            raise ProtocolError("a covariance must be of finite numbers")
        return numbers


class PolygonMsg(msgspec.Struct, frozen=True):
    """``geometry_msgs/Polygon``."""

    points: list[PointMsg]


class PolygonStampedMsg(Stamped, frozen=True, kw_only=True):
    """``geometry_msgs/PolygonStamped``."""

    polygon: PolygonMsg

    def digest(self) -> "PolygonStampedMsg":
        """Return the polygon if it is not too long; called in the worker process.

        Raises:
            TooLarge: If it has more corners than are drawn.

        """
        check_items("corners", len(self.polygon.points))
        return self


class RangeMsg(Stamped, frozen=True, kw_only=True):
    """``sensor_msgs/Range``: one ray, as wide as a cone."""

    field_of_view: float
    """The cone's whole angle, in radians."""

    min_range: float
    """Metres."""

    max_range: float
    """Metres."""

    range: float
    """Metres; infinite if nothing is there, NaN if it does not know."""

    radiation_type: int = 0
    """0 ultrasound, 1 infrared."""
