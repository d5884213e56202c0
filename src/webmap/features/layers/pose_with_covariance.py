"""The uncertainty of a robot's pose."""

import math
from typing import Annotated

import msgspec

from webmap.base.errors import ProtocolError
from webmap.base.geometry import FARTHEST, Pose
from webmap.modules.declaration import TopicKind, layer
from webmap.modules.drawing import sector
from webmap.modules.layer_options import Limit
from webmap.modules.robot_layer import RobotLayer
from webmap.ros.messages import PoseMsg, Stamped
from webmap.ros.tf import Transform
from webmap.scene import svg

AMCL, ODOMETRY = "geometry_msgs/PoseWithCovarianceStamped", "nav_msgs/Odometry"


class UncertainPoseMsg(msgspec.Struct, frozen=True):
    """``geometry_msgs/PoseWithCovariance`` with its covariance."""

    pose: PoseMsg
    covariance: list[float]
    """36 numbers, row by row: x, y, z and rotations about them."""


class Ellipse(msgspec.Struct, frozen=True):
    """The area that contains a position with a certain probability."""

    major: float
    """The longer half axis, in metres per standard deviation."""

    minor: float
    """The shorter half axis, in metres per standard deviation."""

    yaw: float
    """Angle from x to the longer axis, in radians."""


class UncertainPoseStampedMsg(Stamped, frozen=True, kw_only=True):
    """``geometry_msgs/PoseWithCovarianceStamped`` and ``nav_msgs/Odometry``.

    Both have the fields that this view needs.
    """

    pose: UncertainPoseMsg

    @property
    def place(self) -> Pose:
        """Position and heading in the plane.

        Raises:
            ProtocolError: If it is not finite, or its quaternion is no rotation.
        """
        return self.pose.pose.usable

    @property
    def ellipse(self) -> Ellipse:
        """The ellipse of one standard deviation about the position.

        Raises:
            ProtocolError: If the covariance has not 36 finite numbers, or its part in
                the plane is no valid spread, or an impossibly large one.
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
            ProtocolError: If the covariance has not 36 finite numbers, or the variance
                is negative.
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


@layer(
    AMCL,
    ODOMETRY,
    view=UncertainPoseStampedMsg,
    kinds=[
        TopicKind(
            "covariance",
            {
                r"/(?:amcl_pose|localization_pose|pose)\Z": "a localiser's pose",
                r"\A(?!.*initial_?pose\Z)": (
                    "its type alone, except a topic for initial poses"
                ),
            },
            most=2,
            types=(AMCL,),
        )
    ],
    switch="Uncertainty",
    css="covariance",
    rank=60,
)
class PoseWithCovariance(RobotLayer):
    """The ellipse of a robot's estimated position, and the sector of its heading.

    The pose and the uncertainty come from the message, in the map's frame.

    Style it by CSS: ``.covariance > .ellipse`` and ``.covariance > .heading``.
    """

    only_draws = True

    in_plane = True

    topic: str = "/amcl_pose"

    type: str = AMCL
    """``geometry_msgs/PoseWithCovarianceStamped`` or ``nav_msgs/Odometry``."""

    deviations: Annotated[
        float, Limit("above 0", lambda value: math.isfinite(value) and value > 0)
    ] = 2.0
    """The number of standard deviations that are drawn."""

    def build(self) -> None:
        """Make the ellipse and the sector.

        The age limit is long, because AMCL publishes nothing while the robot does not
        move.
        """
        self.ellipse = self.add(
            svg.ellipse(
                class_="ellipse", fill="#8a5cd6", fill_opacity=0.25, stroke="none"
            )
        )
        self.heading = self.add(
            svg.path(class_="heading", fill="#e0a800", fill_opacity=0.35, stroke="none")
        )

    def read(self, message: UncertainPoseStampedMsg) -> tuple[Pose, Ellipse, float]:
        """Return the pose, the ellipse, and half the angle of the sector in radians.

        Raises:
            ProtocolError: If the pose or the covariance is not valid.
        """
        place, ellipse = message.place, message.ellipse
        turn = self.deviations * message.heading_deviation
        if self.deviations * ellipse.major > FARTHEST:
            raise ProtocolError(
                f"an ellipse must be within {FARTHEST:g} m, got a half axis of "
                f"{self.deviations * ellipse.major:g} m"
            )
        return place, ellipse, turn

    def draw(self, found: tuple[Pose, Ellipse, float], at: Transform) -> None:
        """Draw the ellipse and the sector."""
        (place, ellipse, turn), n = found, self.deviations
        self.ellipse.set(rx=n * ellipse.major, ry=n * ellipse.minor)
        self.ellipse.set_pose(place.x, place.y, ellipse.yaw)
        self.heading.set(d=sector(max(0.4, n * ellipse.major), turn))
        self.heading.set_pose(place.x, place.y, place.yaw)
