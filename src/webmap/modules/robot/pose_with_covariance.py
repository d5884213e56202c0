"""How sure a robot is of where it is."""

import math
from typing import TYPE_CHECKING

from webmap.core.layer_names import label
from webmap.core.placed import Placed, sector
from webmap.core.refusals import refusing
from webmap.errors import ConfigError, ProtocolError
from webmap.geometry.reach import FARTHEST
from webmap.ros.bridge import Bridge
from webmap.ros.messages_poses import DoubtfulPoseStampedMsg
from webmap.ros.names import split_type
from webmap.scene import svg

if TYPE_CHECKING:
    from webmap.core.robot import Robot

TYPES = ("geometry_msgs/PoseWithCovarianceStamped", "nav_msgs/Odometry")


class PoseWithCovariance:
    """Draws the ellipse in which a robot takes itself to be, and its heading's sector.

    Where and how large it is comes from the message, in the map's frame.

    Style it by CSS: ``.covariance > .ellipse`` and ``.covariance > .heading``.

    Args:
        robot: The robot.
        bridge: The link to the ROS system that has the topic.
        topic: The topic.
        type: ``geometry_msgs/PoseWithCovarianceStamped`` or ``nav_msgs/Odometry``.
        deviations: How many standard deviations are drawn.
        throttle: The least time between two messages, in milliseconds.
        age_limit: Seconds after which it is drawn as old; amcl is silent while a robot
            stands, so that nothing is old for long.

    Raises:
        ConfigError: If the type has no covariance, or ``deviations`` is not above 0.

    """

    def __init__(
        self,
        robot: "Robot",
        bridge: Bridge,
        topic: str = "/amcl_pose",
        *,
        type: str = TYPES[0],
        deviations: float = 2.0,
        throttle: int = 200,
        age_limit: float = 60.0,
    ) -> None:
        if str(split_type(type)) not in TYPES:
            raise ConfigError(f"type is one of {', '.join(TYPES)}, got {type!r}")
        if not (math.isfinite(deviations) and deviations > 0):
            raise ConfigError(f"deviations must be above 0, got {deviations}")
        self.robot = robot
        self.topic = topic
        self.deviations = deviations
        self.age_limit = age_limit
        self.ellipse = svg.ellipse(
            class_="ellipse", fill="#8a5cd6", fill_opacity=0.25, stroke="none"
        )
        self.heading = svg.path(
            class_="heading", fill="#e0a800", fill_opacity=0.35, stroke="none"
        )
        self._placed = Placed(robot, self.ellipse, self.heading, class_="covariance")
        self.svg = self._placed.svg
        label(self.svg, topic, robot)
        self._bridge = bridge
        bridge.subscribe(
            topic,
            refusing(robot, topic, self.on_pose),
            type,
            throttle=throttle,
            decode=DoubtfulPoseStampedMsg,
        )

    def on_pose(self, message: DoubtfulPoseStampedMsg) -> None:
        """Draw a pose's doubt in place of that before.

        Raises:
            ProtocolError: If the pose or the covariance makes no sense.

        """
        place, ellipse = message.place, message.ellipse
        turn = self.deviations * message.heading_deviation
        n = self.deviations
        if n * ellipse.major > FARTHEST:
            raise ProtocolError(
                f"an ellipse must be within {FARTHEST:g} m, got a half axis of "
                f"{n * ellipse.major:g} m"
            )
        self._placed.stand_in(message.frame_id, message.stamp)
        self.ellipse.set(rx=n * ellipse.major, ry=n * ellipse.minor)
        self.ellipse.set_pose(place.x, place.y, ellipse.yaw)
        self.heading.set(d=sector(max(0.4, n * ellipse.major), turn))
        self.heading.set_pose(place.x, place.y, place.yaw)
        self.svg.set_age(self._bridge.lag, limit=self.age_limit)

    def on_odometry_update(self) -> None:
        """Keep it where it is while the robot goes along."""
        self._placed.follow()
