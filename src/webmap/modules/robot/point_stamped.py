"""A point that somebody publishes, such as what a controller steers to."""

import math
from functools import partial
from typing import TYPE_CHECKING

from webmap.core.from_above import flat
from webmap.core.layer_names import label
from webmap.core.placed import Placed, rounded
from webmap.core.refusals import refusing
from webmap.errors import ConfigError
from webmap.ros.bridge import Bridge
from webmap.ros.messages_points import PointStampedMsg
from webmap.scene import svg

if TYPE_CHECKING:
    from webmap.core.robot import Robot
    from webmap.geometry import Vector3
    from webmap.tf import Transform


class PointStamped:
    """Draws a ``geometry_msgs/PointStamped`` as a spot.

    Style it by CSS: ``.pointstamped > .point``; one of several by its ``name``, which
    is a class too: ``.pointstamped.lookahead > .point``. The console shows one of the
    class ``lookahead`` only as long as it is not old, since nobody steers to it later.

    Args:
        robot: The robot that it is about.
        bridge: The link to the ROS system that has the topic.
        topic: The topic: ``/lookahead_point`` of Nav2's regulated pure pursuit,
            ``/clicked_point`` of RViz.
        name: A further class.
        frame: ``"map"``, or ``"robot"`` for a point in the robot's own frame, as
            Nav2's controllers give it.
        radius: How large the spot is, in metres.
        throttle: The least time between two messages, in milliseconds.
        age_limit: Seconds after which it is drawn as old.

    Raises:
        ConfigError: If the radius makes no sense.

    """

    def __init__(
        self,
        robot: "Robot",
        bridge: Bridge,
        topic: str,
        *,
        name: str = "",
        frame: str = "map",
        radius: float = 0.1,
        throttle: int = 200,
        age_limit: float = 60.0,
    ) -> None:
        if not (math.isfinite(radius) and radius > 0):
            raise ConfigError(f"radius must be metres above 0, got {radius}")
        self.robot = robot
        self.topic = topic
        self.age_limit = age_limit
        self.point: Vector3 | None = None
        """The newest point, as the message has it, in metres."""
        self.spot = svg.circle(
            class_="point",
            r=radius,
            fill="#0a58ca",
            stroke="#ffffff",
            stroke_width=1.5,
            paint_order="stroke",
            vector_effect="non-scaling-stroke",
        )
        self._placed = Placed(
            robot, self.spot, class_=f"pointstamped {name}".strip(), frame=frame
        )
        self.svg = self._placed.svg
        label(self.svg, topic, robot)
        self.svg.set(visibility="hidden")
        self._bridge = bridge
        bridge.subscribe(
            topic,
            refusing(robot, topic, self.on_point),
            "geometry_msgs/PointStamped",
            throttle=throttle,
            decode=PointStampedMsg,
        )

    def on_point(self, message: PointStampedMsg) -> None:
        """Draw a point in place of the one before.

        Raises:
            ProtocolError: If it is not finite, or farther away than anything can be.

        """
        point = message.usable
        draw = partial(self._draw, point)
        self._placed.stand_in(message.frame_id, message.stamp, draw)
        self.point = point
        self.svg.set(visibility=None)
        self.svg.set_age(self._bridge.lag, limit=self.age_limit)

    def on_odometry_update(self) -> None:
        """Keep it where it is while the robot goes along."""
        self._placed.follow()

    def _draw(self, point: "Vector3", tilt: "Transform") -> None:
        ((x, y),) = flat([point], tilt)
        self.spot.set_pose(rounded(x), rounded(y), 0.0)
