"""Output of a planner and a controller: costmaps, footprint, look-ahead point.

In costmaps, obstacles are inflated by the radius of the base.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from webmap.base.geometry import Pose
from webmap.sim.maps import Obstacles
from webmap.sim.messages import Feed, GraphNode, Message, float32, vector

LETHAL, INSCRIBED, UNKNOWN = 100, 99, -1
INFLATION = 0.55
"""Distance by which obstacles are inflated, in metres."""

STEEPNESS = 4.0
"""Decay of costs with distance, per metre; the scaling factor of costmap_2d."""

Disc = tuple[float, float, float]

SIDE = 5.0
"""Side of a local costmap, in metres."""

AGAIN = 25
"""Publications after which the whole grid is sent even without a new subscriber."""

SLOWER = 5
"""Local costmap updates for each update of the global costmap."""

CORNERS = 16
"""Corners of the polygon of a round base, as in costmap_2d."""


class Costs:
    """Costs on a floor, as costmap_2d publishes them: 0 free, 99 inscribed, 100 lethal.

    Args:
        obstacles: Obstacles of the floor.
        radius: Radius of the base, in metres.

    """

    def __init__(self, obstacles: Obstacles, radius: float) -> None:
        self.plan = obstacles.plan
        self._radius = radius
        reach = math.ceil(INFLATION / self.plan.resolution) + 1
        self._distance = distances(obstacles.solid, reach) * self.plan.resolution
        known = self.plan.occupancy >= 0
        self._floor = np.where(
            known | (self._distance < INFLATION), self._cost(self._distance), UNKNOWN
        ).astype(np.int8)

    def whole(self, others: Iterable[Disc]) -> NDArray[np.int8]:
        """Return the costs of the whole floor, the lowest row first.

        Args:
            others: Round obstacles on it, as x, y and radius in metres.

        """
        costs = self._floor.copy()
        size = self.plan.resolution
        for x, y, radius in others:
            row, column = self.plan.cell(x, y)
            reach = math.ceil((radius + INFLATION) / size) + 1
            rows = slice(max(row - reach, 0), max(row + reach + 1, 0))
            columns = slice(max(column - reach, 0), max(column + reach + 1, 0))
            part = costs[rows, columns]
            if not part.size:
                continue
            ys = self.plan.y + (np.arange(part.shape[0]) + rows.start + 0.5) * size
            xs = self.plan.x + (np.arange(part.shape[1]) + columns.start + 0.5) * size
            away = np.hypot(ys[:, np.newaxis] - y, xs - x) - radius
            part[:] = np.maximum(part, self._cost(np.maximum(away, 0)))
        return costs

    def window(
        self,
        x: float,
        y: float,
        cells: int,
        map_from_grid: Pose,
        others: Iterable[Disc],
    ) -> NDArray[np.int8]:
        """Return the costs in a square that may be rotated against the floor's grid.

        Args:
            x: The square's left edge in its own frame, in metres.
            y: Its lower edge.
            cells: Number of cells along a side, of the size of the floor's cells.
            map_from_grid: Pose of its frame on the map.
            others: Round obstacles on the map, as x, y and radius in metres.

        """
        size = self.plan.resolution
        steps = (np.arange(cells) + 0.5) * size
        across, up = np.meshgrid(x + steps, y + steps)
        cos, sin = math.cos(map_from_grid.yaw), math.sin(map_from_grid.yaw)
        xs = map_from_grid.x + cos * across - sin * up
        ys = map_from_grid.y + sin * across + cos * up
        columns = np.floor((xs - self.plan.x) / size).astype(np.intp)
        rows = np.floor((ys - self.plan.y) / size).astype(np.intp)
        height, width = self._distance.shape
        inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
        away = np.full(across.shape, np.inf)
        away[inside] = self._distance[rows[inside], columns[inside]]
        for ox, oy, radius in others:
            gap = np.hypot(xs - ox, ys - oy) - radius
            away = np.minimum(away, np.maximum(gap, 0))
        return self._cost(away)

    def _cost(self, away: NDArray[np.float64]) -> NDArray[np.int8]:
        falling = 98 * np.exp(-STEEPNESS * np.maximum(away - self._radius, 0))
        return np.select(
            [away <= 0, away <= self._radius, away > INFLATION],
            [LETHAL, INSCRIBED, 0],
            np.rint(falling),
        ).astype(np.int8)


def distances(solid: NDArray[np.bool_], reach: int) -> NDArray[np.float64]:
    """Return the distance of each cell to the nearest solid one, inf beyond a reach.

    Args:
        solid: The solid cells.
        reach: Greatest distance, in cells.

    Returns:
        Distances from center to center, in cells.

    """
    upright = np.where(solid, 0.0, np.inf)
    for step in range(1, reach + 1):
        near = np.where(solid, float(step), np.inf)
        upright[step:] = np.minimum(upright[step:], near[:-step])
        upright[:-step] = np.minimum(upright[:-step], near[step:])
    squared = upright * upright
    found = squared.copy()
    for step in range(1, reach + 1):
        aside = squared + step * step
        found[:, step:] = np.minimum(found[:, step:], aside[:, :-step])
        found[:, :-step] = np.minimum(found[:, :-step], aside[:, step:])
    return np.asarray(np.sqrt(found))


@dataclass(frozen=True, slots=True)
class Change:
    """A rectangle of changed cells."""

    x: int
    y: int
    cells: NDArray[np.int8]


class CostmapState:
    """The state that subscribers of one costmap have, and their next message."""

    def __init__(self) -> None:
        self._cells: NDArray[np.int8] | None = None
        self._place: tuple[float, float] | None = None
        self._subscribers: frozenset[object] = frozenset()
        self._since_whole = 0

    def next(
        self,
        cells: NDArray[np.int8],
        place: tuple[float, float],
        subscribers: Iterable[object],
    ) -> Change | bool:
        """Return True if the whole grid must be sent, else the change, or False.

        Like costmap_2d: the whole grid for a new subscriber or after the grid moved.

        Args:
            cells: The current costs.
            place: The current lower left corner, in metres.
            subscribers: Subscribers of the grid.

        """
        who = frozenset(subscribers)
        before, moved = self._cells, place != self._place
        new = bool(who - self._subscribers)
        self._cells, self._place, self._subscribers = cells, place, who
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

    def __init__(self, node: GraphNode) -> None:
        self._node = node
        ros2 = node.messages.dialect.is_ros2
        self._above = "" if ros2 else "move_base/"
        self._published: dict[str, CostmapState] = {}
        self._turn = 0

    @cached_property
    def costs(self) -> Costs:
        """The floor's costs, computed at the first use."""
        world = self._node.world
        return Costs(world.obstacles, world.options.base.radius)

    def start(self) -> None:
        """Advertise the local and the global costmap of each robot, with updates."""
        for robot in self._node.world.robots:
            for part in ("local_costmap", "global_costmap"):
                topic = self._topic(robot.topics, part)
                self._node.advertise(topic, "nav_msgs/OccupancyGrid")
                updates = "map_msgs/OccupancyGridUpdate"
                self._node.advertise(f"{topic}_updates", updates)

    def publish(self) -> None:
        """Publish the costmaps that have subscribers, the global ones more rarely."""
        self._turn += 1
        for index, robot in enumerate(self._node.world.robots):
            local = self._topic(robot.topics, "local_costmap")
            if self._has_subscriber(local):
                self._publish_local(index, local)
            whole = self._topic(robot.topics, "global_costmap")
            if self._turn % SLOWER == 0 and self._has_subscriber(whole):
                cells = self.costs.whole(self._node.world.others(index))
                plan = self._node.world.plan
                self._send(whole, "map", cells, (plan.x, plan.y))

    def _topic(self, prefix: str, part: str) -> str:
        return f"{prefix}/{self._above}{part}/costmap"

    def _has_subscriber(self, topic: str) -> bool:
        graph = self._node.graph
        has_subscriber = graph.is_wanted(topic)
        if not has_subscriber:
            self._published.pop(topic, None)
        return has_subscriber

    def _publish_local(self, index: int, topic: str) -> None:
        world = self._node.world
        robot = world.robots[index]
        size = world.plan.resolution
        count = round(SIDE / size)
        # It moves by whole cells, so that fixed obstacles stay in their cells.
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
        published = self._published.setdefault(topic, CostmapState())
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


class Footprints:
    """Makes ``geometry_msgs/PolygonStamped`` in the frame of odometry."""

    def __init__(self, node: GraphNode) -> None:
        self._node = node
        name = (
            "local_costmap/published_footprint"
            if node.messages.dialect.is_ros2
            else "move_base/local_costmap/footprint"
        )
        type = "geometry_msgs/PolygonStamped"
        self.feed = Feed(name, type, 0.2, "odom", self._make)

    def _make(self, index: int) -> Message:
        robot = self._node.world.robots[index]
        corners = outline(robot.odometry, robot.options.radius)
        points = [{"x": float32(x), "y": float32(y), "z": 0.0} for x, y in corners]
        return {"polygon": {"points": points}}


def outline(at: Pose, radius: float) -> list[tuple[float, float]]:
    """Return the corners of a round base at a pose, the first one straight ahead."""
    turns = [at.yaw + i * math.tau / CORNERS for i in range(CORNERS)]
    return [
        (at.x + radius * math.cos(turn), at.y + radius * math.sin(turn))
        for turn in turns
    ]


class Lookaheads:
    """Makes ``geometry_msgs/PointStamped`` in the frame of the base, as Nav2 does."""

    def __init__(self, node: GraphNode) -> None:
        self._node = node
        type = "geometry_msgs/PointStamped"
        self.feed = Feed("lookahead_point", type, 0.2, "base_link", self._make)

    def _make(self, index: int) -> Message | None:
        world = self._node.world
        robot, ahead = world.robots[index], world.navigators[index].steers_to
        if ahead is None:
            return None
        at = robot.pose.inverse @ Pose(*ahead)
        return {"point": vector(at.x, at.y)}
