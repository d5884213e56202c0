"""The way that a robot's planner has in mind."""

import math
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

from webmap.core.from_above import flat, in_space
from webmap.core.layer_names import label
from webmap.core.placed import Placed, check_finite, rounded, thinned
from webmap.core.refusals import refusing
from webmap.errors import ConfigError
from webmap.ros.bridge import Bridge
from webmap.ros.messages import PathMsg
from webmap.scene import svg

if TYPE_CHECKING:
    from webmap.core.robot import Robot
    from webmap.geometry import Vector3
    from webmap.tf import Transform


class Path:
    """Draws a ``nav_msgs/Path`` as a line, and fires ``on_path_update``.

    The poses are in the map's frame, or in the frame that the message names if the
    robot knows frames. A path without poses takes the line away.

    Style it by CSS: ``.path > polyline``; a second path can be told by its ``name``,
    which is a class too: ``.path.local > polyline { stroke: orange }``.

    Args:
        robot: The robot that is to go there.
        bridge: The link to the ROS system that has the topic.
        topic: The topic.
        name: A further class.
        max_points: How many poses are drawn at the most, evenly chosen.
        throttle: The least time between two paths, in milliseconds.
        age_limit: Seconds after which the path is drawn as old.

    Raises:
        ConfigError: If ``max_points`` is less than 2.

    """

    def __init__(
        self,
        robot: "Robot",
        bridge: Bridge,
        topic: str = "/plan",
        *,
        name: str = "",
        max_points: int = 500,
        throttle: int = 500,
        age_limit: float = 5.0,
    ) -> None:
        if max_points < 2:
            raise ConfigError(f"max_points must be at least 2, got {max_points}")
        self.robot = robot
        self.topic = topic
        self.max_points = max_points
        self.age_limit = age_limit
        self._message: PathMsg | None = None
        self.line = svg.polyline(
            fill="none",
            stroke="#12805c",
            stroke_width=2,
            stroke_linejoin="round",
            vector_effect="non-scaling-stroke",
        )
        self._placed = Placed(robot, self.line, class_=f"path {name}".strip())
        self.svg = self._placed.svg
        label(self.svg, topic, robot)
        self._bridge = bridge
        bridge.subscribe(
            topic,
            refusing(robot, topic, self.on_path),
            "nav_msgs/Path",
            throttle=throttle,
            decode=PathMsg,
        )

    @property
    def points(self) -> list[tuple[float, float]]:
        """The newest path, all of it, in metres in the map's frame.

        Only the positions that are drawn are known to be finite.
        """
        poses = self._message.poses if self._message is not None else []
        return [(p.pose.position.x, p.pose.position.y) for p in poses]

    @property
    def length(self) -> float:
        """How long the path is, in metres; 0 if there is none."""
        return sum(math.dist(one, next) for one, next in pairwise(self.points))

    def on_path(self, path: PathMsg) -> None:
        """Draw a path in place of the one before.

        Raises:
            ProtocolError: If a position that is to be drawn is not finite, or farther
                away than anything can be.

        """
        # Only these are looked at, so that a long path does not hold up other robots.
        kept = thinned(len(path.poses), self.max_points)
        chosen = [path.poses[index].pose.position for index in kept]
        check_finite([(place.x, place.y) for place in chosen], "a path")
        drawn = in_space(chosen)
        self._placed.stand_in(path.frame_id, path.stamp, partial(self._draw, drawn))
        self._message = path
        self.svg.set_age(self._bridge.lag, limit=self.age_limit)
        self.robot.notify_modules("on_path_update", self)

    def on_odometry_update(self) -> None:
        """Keep the path where it is while the robot goes along."""
        self._placed.follow()

    def _draw(self, points: "list[Vector3]", tilt: "Transform") -> None:
        line = flat(points, tilt)
        self.line.set(points=[(rounded(x), rounded(y)) for x, y in line])
