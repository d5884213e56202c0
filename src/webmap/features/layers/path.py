"""Paths of a robot's planner."""

import math
from itertools import pairwise
from typing import Annotated

from webmap.base.geometry import Vector3
from webmap.modules.declaration import TopicKind, layer
from webmap.modules.drawing import check_finite, flat, in_space, rounded, thinned
from webmap.modules.layer_options import Limit
from webmap.modules.robot_layer import RobotLayer
from webmap.ros.messages import PathMsg
from webmap.ros.tf import Transform
from webmap.scene import svg


@layer(
    "nav_msgs/Path",
    view=PathMsg,
    kinds=[
        TopicKind(
            "local plan",
            {r"/local_plan\Z": "the usual name"},
            most=1,
            options={"name": "local"},
        ),
        TopicKind(
            "path",
            {
                r"/plan\Z": "the usual name",
                r"plan|path|trajectory": "named like a path",
                "": "its type alone",
            },
            most=6,
            role="plan",
        ),
    ],
    switch="Plans",
    rank=40,
)
class Path(RobotLayer):
    """A line that stays in place on the map while the robot moves.

    Fires ``on_path_update``. The poses are in the map's frame, or in the frame of the
    message if the robot has frames: that of its header, or of its first pose that names
    one. All poses are drawn in this frame; if some name another, this is reported. A
    path without poses removes the line.

    Style it by CSS: ``.path > polyline``, and one of several by its name: ``.path.local
    > polyline``.
    """

    only_draws = True

    topic: str = "/plan"

    max_points: Annotated[int, Limit("at least 2", lambda value: value >= 2)] = 500
    """The greatest number of poses that are drawn, evenly chosen."""

    throttle: int = 500
    age_limit: float = 5.0

    def build(self) -> None:
        """Make the line."""
        self._message: PathMsg | None = None
        self.line = self.add(
            svg.polyline(
                fill="none",
                stroke="#12805c",
                stroke_width=2,
                stroke_linejoin="round",
                vector_effect="non-scaling-stroke",
            )
        )

    @property
    def points(self) -> list[tuple[float, float]]:
        """All positions of the newest path, in metres in the map's frame.

        Only the drawn positions were checked to be finite.
        """
        poses = self._message.poses if self._message is not None else []
        return [(p.pose.position.x, p.pose.position.y) for p in poses]

    @property
    def length(self) -> float:
        """Length of the path, in metres; 0 if there is none."""
        return sum(math.dist(one, next) for one, next in pairwise(self.points))

    def take(self, message: PathMsg) -> None:
        """Draw a path in place of the last one, and fire ``on_path_update``.

        Raises:
            ProtocolError: If the path cannot be drawn.
        """
        super().take(message)
        self._message = message
        self.robot.notify_modules("on_path_update", self)

    def read(self, message: PathMsg) -> list[Vector3]:
        """Return the positions to draw.

        Raises:
            ProtocolError: If a position is not finite, or beyond the greatest distance.
        """
        # Only these are checked, so that a long path does not delay other robots.
        kept = thinned(len(message.poses), self.max_points)
        stamped = [message.poses[index] for index in kept]
        chosen = [each.pose.position for each in stamped]
        check_finite([(place.x, place.y) for place in chosen], "a path")
        frame = message.frame_id.strip("/")
        others = {each.frame_id.strip("/") for each in stamped} - {frame, ""}
        if others:
            self.complain(
                f"poses of this path name the frame {min(others)!r}; all its poses are "
                f"drawn in {frame!r}"
            )
        return in_space(chosen)

    def draw(self, found: list[Vector3], at: Transform) -> None:
        """Draw the line as seen from above."""
        self.line.set_line([(rounded(x), rounded(y)) for x, y in flat(found, at)])
