"""Single points, such as the point that a controller steers to."""

import math

from webmap.base.errors import ProtocolError
from webmap.base.geometry import FARTHEST, Vector3
from webmap.modules.declaration import TopicKind, layer
from webmap.modules.drawing import flat, rounded
from webmap.modules.layer_options import Frame, Metres
from webmap.modules.robot_layer import RobotLayer
from webmap.ros.messages import PointMsg, Stamped
from webmap.ros.tf import Transform
from webmap.scene import svg


class PointStampedMsg(Stamped, frozen=True, kw_only=True):
    """``geometry_msgs/PointStamped``."""

    point: PointMsg


@layer(
    "geometry_msgs/PointStamped",
    view=PointStampedMsg,
    kinds=[
        TopicKind(
            "lookahead",
            {r"/lookahead_point\Z": "what a controller steers to"},
            most=1,
            # A controller publishes it in the robot's frame, also without known frames.
            options={"name": "lookahead", "frame": "robot", "age_limit": 2.0},
        ),
        TopicKind("point"),
    ],
    switch="Points",
    rank=90,
)
class PointStamped(RobotLayer):
    """A spot at a point, such as ``/clicked_point`` of RViz.

    Nav2's regulated pure pursuit publishes the point that it steers to,
    ``/lookahead_point``, in the robot's frame: with ``frame="robot"`` it is drawn
    correctly also if the robot has no frames. The console hides a stale point of the
    class ``lookahead``, because the robot no longer steers to it.

    Style it by CSS: ``.pointstamped > .point``, and one of several by its name:
    ``.pointstamped.lookahead > .point``.
    """

    only_draws = True

    frame: Frame = "map"
    """``"robot"`` for a point in the robot's own frame, as from Nav2's controllers."""

    radius: Metres = 0.1
    """Radius of the spot, in metres."""

    def build(self) -> None:
        """Make the spot, hidden until there is a point."""
        self.point: Vector3 | None = None
        """The newest point in the message's frame, in metres."""
        self.spot = self.add(
            svg.circle(
                class_="point",
                r=self.radius,
                fill="#0a58ca",
                stroke="#ffffff",
                stroke_width=1.5,
                paint_order="stroke",
                vector_effect="non-scaling-stroke",
            )
        )
        self.svg.set(visibility="hidden")

    def read(self, message: PointStampedMsg) -> Vector3:
        """Return the point; without a height it is in the plane.

        Raises:
            ProtocolError: If the point is not finite, or beyond the greatest distance.
        """
        p = message.point
        if not (math.isfinite(p.x) and math.isfinite(p.y)):
            raise ProtocolError(
                f"a point must be of finite numbers, got ({p.x}, {p.y})"
            )
        height = p.z if math.isfinite(p.z) else 0.0
        if max(abs(p.x), abs(p.y)) > FARTHEST:
            raise ProtocolError(
                f"a point must be within {FARTHEST:g} m of the origin, got "
                f"({p.x:g}, {p.y:g})"
            )
        if abs(height) > FARTHEST:
            raise ProtocolError(
                f"a point must be within {FARTHEST:g} m of the plane, got a height of "
                f"{height:g}"
            )
        return Vector3(p.x, p.y, height)

    def draw(self, found: Vector3, at: Transform) -> None:
        """Move the spot to the point, as seen from above."""
        self.point = found
        ((x, y),) = flat([found], at)
        self.spot.set_pose(rounded(x), rounded(y), 0.0)
        self.svg.set(visibility=None)
