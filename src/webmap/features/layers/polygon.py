"""Polygons, such as a robot's footprint."""

import msgspec

from webmap.base.errors import ProtocolError
from webmap.base.geometry import Vector3
from webmap.modules.declaration import TopicKind, layer
from webmap.modules.drawing import check_finite, flat, in_space, rounded
from webmap.modules.layer_options import Frame, Seconds
from webmap.modules.robot_layer import RobotLayer
from webmap.ros.limits import check_items
from webmap.ros.messages import PointMsg, Stamped
from webmap.ros.tf import Transform
from webmap.scene import svg

MAX_POINTS = 10_000


class PolygonMsg(msgspec.Struct, frozen=True):
    """``geometry_msgs/Polygon``."""

    points: list[PointMsg]


class PolygonStampedMsg(Stamped, frozen=True, kw_only=True):
    """``geometry_msgs/PolygonStamped``."""

    polygon: PolygonMsg

    def digest(self) -> "PolygonStampedMsg":
        """Return the polygon if it is small enough; called in the worker process.

        Raises:
            TooLarge: If it has too many corners.
        """
        check_items("corners", len(self.polygon.points))
        return self


@layer(
    "geometry_msgs/PolygonStamped",
    view=PolygonStampedMsg,
    kinds=[
        TopicKind(
            "footprint",
            {
                r"local_costmap/(?:published_)?footprint\Z": "of a local costmap",
                r"footprint[^/]*\Z": "named a footprint",
            },
            most=1,
        ),
        TopicKind("polygon", options={"name": "other", "age_limit": 60.0}),
    ],
    switch="Footprints",
    rank=70,
)
class Polygon(RobotLayer):
    """A polygon, such as the footprint that a costmap publishes.

    The topic of a footprint is ``/local_costmap/published_footprint`` in Nav2, and
    ``/move_base/local_costmap/footprint`` in ROS 1. A polygon without points draws
    nothing.

    Style it by CSS: ``.polygon > polygon``, and one of several by its name:
    ``.polygon.footprint > polygon``.
    """

    only_draws = True

    name: str = "footprint"

    frame: Frame = "map"
    """``"map"``, the frame of costmaps' footprints, or ``"robot"`` for a polygon in the
    robot's own frame.
    """

    age_limit: Seconds = 5.0

    def build(self) -> None:
        """Make the outline."""
        self.points: list[tuple[float, float]] = []
        """The newest polygon, in metres."""
        self.outline = self.add(
            svg.polygon(
                fill="#2f6fde",
                fill_opacity=0.12,
                stroke="#2f6fde",
                stroke_width=1.5,
                vector_effect="non-scaling-stroke",
            )
        )

    def read(self, message: PolygonStampedMsg) -> list[Vector3]:
        """Return the corners.

        Raises:
            ProtocolError: If a point is not finite or beyond the greatest distance, or
                if there are too many.
        """
        points = [(point.x, point.y) for point in message.polygon.points]
        if len(points) > MAX_POINTS:
            raise ProtocolError(
                f"a polygon of {len(points)} points; the limit is {MAX_POINTS}"
            )
        check_finite(points, "a polygon")
        return in_space(message.polygon.points)

    def draw(self, found: list[Vector3], at: Transform) -> None:
        """Draw the outline as seen from above."""
        self.points = [(point.x, point.y) for point in found]
        self.outline.set_line([(rounded(x), rounded(y)) for x, y in flat(found, at)])
