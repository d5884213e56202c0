"""Markers: the goal of a robot, and the other robots that it sees."""

import math
from typing import Any

from webmap.base.geometry import Pose
from webmap.sim.feeds.feed import Feed
from webmap.sim.graph_node import GraphNode
from webmap.sim.messages import Message, pose

ARROW, CYLINDER, TEXT = 0, 3, 9
ADD, DELETE = 0, 2
SIGHT = 6.0
"""Distance at which a robot detects another one, in metres."""

SEEN_FOR = 1.0
"""Seconds for which a detected robot stays marked."""

GREEN, ORANGE, INK = (0.1, 0.6, 0.3), (0.9, 0.45, 0.1), (0.2, 0.25, 0.3)


class MarkerFeed:
    """Makes ``visualization_msgs/MarkerArray`` in the map's frame."""

    def __init__(self, node: GraphNode) -> None:
        self._node = node
        self.feed = Feed("markers", "visualization_msgs/MarkerArray", 0.2, self._make)

    def _make(self, index: int, topic: str, stamp: float) -> Message:
        header = self._node.messages.dialect.header(topic, stamp, "map")
        marks = [*self._goal(index), *self._seen(index)]
        return {"markers": [{"header": header, **mark} for mark in marks]}

    def _goal(self, index: int) -> list[Message]:
        world = self._node.world
        goal = world.navigators[index].goal
        if goal is None:
            return [
                self._mark("goal", number, type, Pose(), action=DELETE)
                for number, type in enumerate((ARROW, TEXT))
            ]
        at = goal.pose
        left = math.hypot(
            at.x - world.robots[index].pose.x, at.y - world.robots[index].pose.y
        )
        beside = Pose(at.x, at.y + 0.4)
        return [
            self._mark("goal", 0, ARROW, at, (0.7, 0.12, 0.12), GREEN),
            self._mark("goal", 1, TEXT, beside, (0, 0, 0.3), GREEN, f"{left:.1f} m"),
        ]

    def _seen(self, index: int) -> list[Message]:
        world = self._node.world
        here = world.robots[index].pose
        marks = []
        for number, robot in enumerate(world.robots):
            at = Pose(robot.pose.x, robot.pose.y)
            if number == index or math.hypot(at.x - here.x, at.y - here.y) > SIGHT:
                continue
            size = 2 * robot.options.radius + 0.1
            marks.append(
                self._mark(
                    "seen",
                    number,
                    CYLINDER,
                    at,
                    (size, size, 0.5),
                    ORANGE,
                    alpha=0.35,
                    lifetime=SEEN_FOR,
                )
            )
        return marks

    def _mark(
        self,
        space: str,
        number: int,
        type: int,
        at: Pose,
        scale: tuple[float, float, float] = (1, 1, 1),
        color: tuple[float, float, float] = INK,
        text: str = "",
        *,
        action: int = ADD,
        alpha: float = 1.0,
        lifetime: float = 0.0,
    ) -> dict[str, Any]:
        dialect = self._node.messages.dialect
        texture: Message = {}
        mesh_file: Message = {}
        if dialect.is_ros2:
            image = {"header": dialect.header("", 0.0, ""), "format": "", "data": b""}
            texture = {"texture_resource": "", "texture": image, "uv_coordinates": []}
            mesh_file = {"mesh_file": {"filename": "", "data": b""}}
        return {
            "ns": space,
            "id": number,
            "type": type,
            "action": action,
            "pose": pose(at),
            "scale": dict(zip("xyz", map(float, scale), strict=True)),
            "color": dict(zip("rgba", (*color, alpha), strict=True)),
            "lifetime": dialect.time(lifetime),
            "frame_locked": False,
            "points": [],
            "colors": [],
            **texture,
            "text": text,
            "mesh_resource": "",
            **mesh_file,
            "mesh_use_embedded_materials": False,
        }
