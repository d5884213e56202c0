"""Polygons, such as a robot's footprint."""

from functools import partial
from typing import TYPE_CHECKING

from webmap.core.from_above import flat, in_space
from webmap.core.layer_names import label
from webmap.core.placed import Placed, check_finite, rounded
from webmap.core.refusals import refusing
from webmap.errors import ConfigError, ProtocolError
from webmap.ros.bridge import Bridge
from webmap.ros.messages_poses import PolygonStampedMsg
from webmap.scene import svg

if TYPE_CHECKING:
    from webmap.core.robot import Robot
    from webmap.geometry import Vector3
    from webmap.tf import Transform

MAX_POINTS = 10_000


class Polygon:
    """Draws a ``geometry_msgs/PolygonStamped``; a polygon without points draws nothing.

    Style it by CSS: ``.polygon > polygon``; one of several by its name, which is a
    class too: ``.polygon.footprint > polygon``.

    Args:
        robot: The robot that it belongs to.
        bridge: The link to the ROS system that has the topic.
        topic: The topic: ``/local_costmap/published_footprint`` in Nav2,
            ``/move_base/local_costmap/footprint`` in ROS 1.
        name: A further class.
        frame: ``"map"``, in which costmaps give footprints, or ``"robot"`` for one in
            the robot's own frame.
        throttle: The least time between two messages, in milliseconds.
        age_limit: Seconds after which it is drawn as old.

    """

    def __init__(
        self,
        robot: "Robot",
        bridge: Bridge,
        topic: str,
        *,
        name: str = "footprint",
        frame: str = "map",
        throttle: int = 200,
        age_limit: float = 5.0,
    ) -> None:
        if age_limit < 0:
            raise ConfigError(f"age_limit must be at least 0 s, got {age_limit}")
        self.robot = robot
        self.topic = topic
        self.age_limit = age_limit
        self.points: list[tuple[float, float]] = []
        """The newest polygon, in metres."""
        self.outline = svg.polygon(
            fill="#2f6fde",
            fill_opacity=0.12,
            stroke="#2f6fde",
            stroke_width=1.5,
            vector_effect="non-scaling-stroke",
        )
        self._placed = Placed(
            robot, self.outline, class_=f"polygon {name}".strip(), frame=frame
        )
        self.svg = self._placed.svg
        label(self.svg, topic, robot)
        self._bridge = bridge
        bridge.subscribe(
            topic,
            refusing(robot, topic, self.on_polygon),
            "geometry_msgs/PolygonStamped",
            throttle=throttle,
            decode=PolygonStampedMsg,
        )

    def on_polygon(self, message: PolygonStampedMsg) -> None:
        """Draw a polygon in place of the one before.

        Raises:
            ProtocolError: If a point is not finite or farther away than anything can
                be, or there are too many.

        """
        points = [(point.x, point.y) for point in message.polygon.points]
        if len(points) > MAX_POINTS:
            raise ProtocolError(
                f"a polygon of {len(points)} points; {MAX_POINTS} are the limit"
            )
        check_finite(points, "a polygon")
        draw = partial(self._draw, in_space(message.polygon.points))
        self._placed.stand_in(message.frame_id, message.stamp, draw)
        self.points = points
        self.svg.set_age(self._bridge.lag, limit=self.age_limit)

    def on_odometry_update(self) -> None:
        """Keep it where it is while the robot goes along."""
        self._placed.follow()

    def _draw(self, points: "list[Vector3]", tilt: "Transform") -> None:
        corners = flat(points, tilt)
        self.outline.set(points=[(rounded(x), rounded(y)) for x, y in corners])
