"""Costmaps: what stands around, grown by what a base needs to pass."""

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from webmap.geometry import Pose
from webmap.sim.obstacles import Obstacles

LETHAL, INSCRIBED, UNKNOWN = 100, 99, -1
INFLATION = 0.55
"""How far obstacles are grown, in metres."""

STEEPNESS = 4.0
"""How fast costs fall with the distance, a metre; costmap_2d's scaling factor."""

Disc = tuple[float, float, float]


class Costs:
    """Costs on a floor, as costmap_2d publishes them: 0 free, 99 inscribed, 100 lethal.

    Args:
        obstacles: Of the floor.
        radius: Of the base, in metres.

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
            others: Round things that stand on it, as x, y and radius in metres.

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
        """Return the costs in a square that need not lie along the floor's rows.

        Args:
            x: The square's left edge in its own frame, in metres.
            y: Its lower edge.
            cells: How many there are along a side, as large as the floor's.
            map_from_grid: Where its frame is on the map.
            others: Round things on the map, as x, y and radius in metres.

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
    """Return how far each cell is from the nearest solid one, inf beyond a reach.

    Args:
        solid: The cells that count.
        reach: How far to look, in cells.

    Returns:
        From middle to middle, in cells.

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
