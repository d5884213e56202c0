"""The outline of a base, where its local costmap has it."""

import math
from typing import TYPE_CHECKING

from webmap.geometry import Pose
from webmap.sim.feeds.feed import Feed
from webmap.sim.messages import Message, float32

if TYPE_CHECKING:
    from webmap.sim.node import RobotsNode

CORNERS = 16
"""As costmap_2d has a round base: a polygon of sixteen corners."""


class Footprints:
    """Makes ``geometry_msgs/PolygonStamped`` in the frame of odometry."""

    def __init__(self, node: "RobotsNode") -> None:
        self._node = node
        name = (
            "local_costmap/published_footprint"
            if node.messages.dialect.is_ros2
            else "move_base/local_costmap/footprint"
        )
        self.feed = Feed(name, "geometry_msgs/PolygonStamped", 0.2, self._make)

    def _make(self, index: int, topic: str, stamp: float) -> Message:
        robot = self._node.world.robots[index]
        header = self._node.messages.dialect.header(topic, stamp, f"{robot.frames}odom")
        corners = outline(robot.odometry, robot.options.radius)
        points = [{"x": float32(x), "y": float32(y), "z": 0.0} for x, y in corners]
        return {"header": header, "polygon": {"points": points}}


def outline(at: Pose, radius: float) -> list[tuple[float, float]]:
    """Return the corners of a round base at a pose, the first one straight ahead."""
    turns = [at.yaw + i * math.tau / CORNERS for i in range(CORNERS)]
    return [
        (at.x + radius * math.cos(turn), at.y + radius * math.sin(turn))
        for turn in turns
    ]
