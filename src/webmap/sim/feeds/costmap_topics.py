"""The topics of costmaps: whole grids, and between them what changed."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from webmap.sim.feeds.costmap import Costs
from webmap.sim.messages import Message

if TYPE_CHECKING:
    from webmap.sim.node import RobotsNode

SIDE = 5.0
"""Of a local costmap, in metres."""

AGAIN = 25
"""Publications after which a grid goes out whole even if nobody is new."""

SLOWER = 5
"""How many times as seldom the global costmap is looked at as the local ones."""


@dataclass(frozen=True, slots=True)
class Change:
    """A rectangle of cells that differ from those before."""

    x: int
    y: int
    cells: NDArray[np.int8]


class Published:
    """What subscribers of one costmap have, and so what they need next."""

    def __init__(self) -> None:
        self._cells: NDArray[np.int8] | None = None
        self._place: tuple[float, float] | None = None
        self._heard_by: frozenset[object] = frozenset()
        self._since_whole = 0

    def next(
        self,
        cells: NDArray[np.int8],
        place: tuple[float, float],
        subscribers: Iterable[object],
    ) -> Change | bool:
        """Return True if the whole grid must go out, or what changed, or False.

        As costmap_2d does it: whole for who is new, and when the grid has moved.

        Args:
            cells: The costs of now.
            place: The lower left corner of now, in metres.
            subscribers: Who hears the grid.

        """
        who = frozenset(subscribers)
        before, moved = self._cells, place != self._place
        new = bool(who - self._heard_by)
        self._cells, self._place, self._heard_by = cells, place, who
        self._since_whole += 1
        if before is None or moved or new or self._since_whole >= AGAIN:
            self._since_whole = 0
            return True
        rows, columns = np.nonzero(cells != before)
        if not len(rows):
            return False
        x, y = int(columns.min()), int(rows.min())
        return Change(x, y, cells[y : rows.max() + 1, x : columns.max() + 1])


class CostmapTopics:
    """Publishes ``nav_msgs/OccupancyGrid`` and ``map_msgs/OccupancyGridUpdate``."""

    def __init__(self, node: "RobotsNode") -> None:
        self._node = node
        ros2 = node.messages.dialect.is_ros2
        self._above = "" if ros2 else "move_base/"
        self._published: dict[str, Published] = {}
        self._turn = 0

    @cached_property
    def costs(self) -> Costs:
        """The floor's costs, worked out when first somebody asks."""
        world = self._node.world
        return Costs(world.obstacles, world.options.base.radius)

    def start(self) -> None:
        """Advertise the topics."""
        for robot in self._node.world.robots:
            for part in ("local_costmap", "global_costmap"):
                topic = self._topic(robot.topics, part)
                self._node.advertise(topic, "nav_msgs/OccupancyGrid")
                updates = "map_msgs/OccupancyGridUpdate"
                self._node.advertise(f"{topic}_updates", updates)

    def publish(self) -> None:
        """Publish what is wanted."""
        self._turn += 1
        for index, robot in enumerate(self._node.world.robots):
            local = self._topic(robot.topics, "local_costmap")
            if self._wanted(local):
                self._publish_local(index, local)
            whole = self._topic(robot.topics, "global_costmap")
            if self._turn % SLOWER == 0 and self._wanted(whole):
                cells = self.costs.whole(self._node.world.others(index))
                plan = self._node.world.plan
                self._send(whole, "map", cells, (plan.x, plan.y))

    def _topic(self, prefix: str, part: str) -> str:
        return f"{prefix}/{self._above}{part}/costmap"

    def _wanted(self, topic: str) -> bool:
        graph = self._node.graph
        wanted = graph.is_wanted(topic)
        if not wanted:
            self._published.pop(topic, None)
        return wanted

    def _publish_local(self, index: int, topic: str) -> None:
        world = self._node.world
        robot = world.robots[index]
        size = world.plan.resolution
        count = round(SIDE / size)
        # It rolls by whole cells, so that what stands still stays in its cell.
        x = (math.floor(robot.odometry.x / size) - count // 2) * size
        y = (math.floor(robot.odometry.y / size) - count // 2) * size
        map_from_odom = robot.pose @ robot.odometry.inverse
        cells = self.costs.window(x, y, count, map_from_odom, world.others(index))
        self._send(topic, f"{robot.frames}odom", cells, (x, y))

    def _send(
        self,
        topic: str,
        frame: str,
        cells: NDArray[np.int8],
        place: tuple[float, float],
    ) -> None:
        node = self._node
        published = self._published.setdefault(topic, Published())
        due = published.next(cells, place, node.graph.topics[topic].subscribers)
        now = node.graph.clock()
        if isinstance(due, Change):
            updates = f"{topic}_updates"
            if node.graph.is_wanted(updates):
                node.publish(updates, self._update(updates, now, frame, due))
        elif due:
            size = node.world.plan.resolution
            node.publish(
                topic, node.messages.cells(topic, now, frame, cells, size, place)
            )

    def _update(self, topic: str, stamp: float, frame: str, change: Change) -> Message:
        height, width = change.cells.shape
        return {
            "header": self._node.messages.dialect.header(topic, stamp, frame),
            "x": change.x,
            "y": change.y,
            "width": width,
            "height": height,
            "data": change.cells.ravel(),
        }
