"""Paths of a robot's planner."""

import math
import time
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from webmap.base.geometry import Vector3
from webmap.modules.declaration import TopicKind, layer
from webmap.modules.drawing import check_finite, flat, in_space, rounded, thinned
from webmap.modules.layer_options import Limit
from webmap.modules.robot_layer import RobotLayer
from webmap.ros.messages import PathMsg
from webmap.ros.tf import Transform
from webmap.scene import svg

NEAR = 0.5
"""Metres from a path, or from its end, within which a robot is there."""


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
        self._taken_at = 0.0
        self._line = np.empty((0, 2))
        """The drawn positions in the frame of the message."""
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
    def shows_own_goal(self) -> bool:
        """Whether the newest path is new, or the robot is on it and not at its end.

        Some planners send a path once, others again and again.
        """
        if self._message is None or len(self._line) == 0:
            return False
        if time.monotonic() - self._taken_at < self.age_limit:
            return True
        if not self.in_map(self._message.frame_id):
            return False
        place, own = self.robot.position, self.robot.pose_source.common_from_own
        at = np.array(own.inverse.apply(place.x, place.y))
        is_there = math.dist(at, self._line[-1]) < NEAR
        return not is_there and distance(self._line, at) < NEAR

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
        self._message, self._taken_at = message, time.monotonic()
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
        self._line = np.array([(place.x, place.y) for place in found]).reshape(-1, 2)
        self.line.set_line([(rounded(x), rounded(y)) for x, y in flat(found, at)])


def distance(line: NDArray[Any], at: NDArray[Any]) -> float:
    """Return the distance of a position from a line of one or more positions."""
    steps = np.diff(line, axis=0, append=line[-1:])
    lengths = np.maximum((steps**2).sum(axis=1), 1e-12)
    shares = np.clip(((at - line) * steps).sum(axis=1) / lengths, 0.0, 1.0)
    return float(np.hypot(*(line + shares[:, None] * steps - at).T).min())
