"""What a controller steers to, while a robot follows a path."""

from typing import TYPE_CHECKING

from webmap.geometry import Pose
from webmap.sim.feeds.feed import Feed
from webmap.sim.messages import Message, vector

if TYPE_CHECKING:
    from webmap.sim.node import RobotsNode


class Lookaheads:
    """Makes ``geometry_msgs/PointStamped`` in the frame of the base, as Nav2 does."""

    def __init__(self, node: "RobotsNode") -> None:
        self._node = node
        self.feed = Feed(
            "lookahead_point", "geometry_msgs/PointStamped", 0.2, self._make
        )

    def _make(self, index: int, topic: str, stamp: float) -> Message | None:
        world = self._node.world
        robot, ahead = world.robots[index], world.navigators[index].steers_to
        if ahead is None:
            return None
        dialect = self._node.messages.dialect
        at = robot.pose.inverse @ Pose(*ahead)
        return {
            "header": dialect.header(topic, stamp, f"{robot.frames}base_link"),
            "point": vector(at.x, at.y),
        }
