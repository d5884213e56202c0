"""Paths around obstacles: A* on a coarse grid, then only the necessary corners."""

import heapq
import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from webmap.sim.maps import Obstacles, dilate

Point = tuple[float, float]

_DIAGONAL = math.sqrt(2)
_CLEARANCE_COST = 2.0
_NODES_A_SLICE = 800


class Planner:
    """Finds paths for a round base on one floor plan.

    Args:
        obstacles: The floor plan's solid cells.
        radius: Radius of the base, in metres.
        margin: Distance to walls beyond its radius, in metres.
        coarsening: Number of cells of the plan along a side of a cell of the search.

    """

    def __init__(
        self,
        obstacles: Obstacles,
        radius: float,
        margin: float = 0.07,
        coarsening: int = 2,
    ) -> None:
        self.plan = obstacles.plan
        self.size = obstacles.plan.resolution * coarsening
        near = obstacles.near(radius + margin) | ~obstacles.free
        self.blocked = _coarsen(near, coarsening)
        comfort = dilate(self.blocked, 0.35 / self.size)
        self._cost = np.where(comfort, _CLEARANCE_COST, 1.0)

    def reachable(self, x: float, y: float) -> NDArray[np.bool_]:
        """Return the cells of the search that a base can reach from a point."""
        rows, columns = self.blocked.shape
        width = columns + 2
        waiting = np.pad(~self.blocked, 1).ravel().tolist()
        seen = np.zeros(len(waiting), np.bool_)
        row, column = self.cell(x, y)
        if self._holds((row, column)) and not self.blocked[row, column]:
            found = [(row + 1) * width + column + 1]
            waiting[found[0]] = False
            for here in found:
                for there in (here + 1, here - 1, here + width, here - width):
                    if waiting[there]:
                        waiting[there] = False
                        found.append(there)
            seen[found] = True
        return seen.reshape(rows + 2, width)[1:-1, 1:-1]

    def center(self, row: int, column: int) -> Point:
        """Return the center of a cell of the search, in metres."""
        return (
            self.plan.x + (column + 0.5) * self.size,
            self.plan.y + (row + 0.5) * self.size,
        )

    def search(
        self,
        start: Point,
        goal: Point,
        discs: Sequence[tuple[float, float, float]] = (),
    ) -> Iterator[list[Point] | None]:
        """Search for a path, a slice of work at a time.

        Args:
            start: Position of the base, in metres.
            goal: Position to reach, in metres.
            discs: Other obstacles, as x, y and radius plus this base's radius.

        Yields:
            None while the search continues; finally the path, from ``start`` to
            ``goal``, or an empty list if there is none.

        """
        blocked = self._with_discs(discs)
        first, last = self.cell(*start), self.cell(*goal)
        if not self._holds(last) or not self._holds(first) or blocked[last]:
            yield []
            return
        # A base too close to a wall may drive away from it.
        free = ~blocked
        free[first] = True
        for cells in _a_star(free, self._cost, first, last):
            if cells is None:
                yield None
                continue
            if not cells:
                yield []
                return
            points = [self.center(*cell) for cell in cells]
            points[0], points[-1] = start, goal
            yield self._straighten(points, free)

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Return the row and column of the search of a point."""
        return (
            math.floor((y - self.plan.y) / self.size),
            math.floor((x - self.plan.x) / self.size),
        )

    def _holds(self, cell: tuple[int, int]) -> bool:
        rows, columns = self.blocked.shape
        return bool(0 <= cell[0] < rows and 0 <= cell[1] < columns)

    def _with_discs(
        self, discs: Sequence[tuple[float, float, float]]
    ) -> NDArray[np.bool_]:
        blocked = self.blocked.copy()
        rows, columns = blocked.shape
        for x, y, radius in discs:
            row, column = self.cell(x, y)
            reach = math.ceil(radius / self.size)
            top, left = max(row - reach, 0), max(column - reach, 0)
            window = blocked[top : row + reach + 1, left : column + reach + 1]
            down = np.arange(top, min(row + reach + 1, rows)) - row
            across = np.arange(left, min(column + reach + 1, columns)) - column
            inside = np.hypot(down[:, np.newaxis], across) * self.size <= radius
            window |= inside
        return blocked

    def _straighten(self, points: list[Point], free: NDArray[np.bool_]) -> list[Point]:
        """Return the path without the points that a straight line can replace."""
        kept = [points[0]]
        at = 0
        while at < len(points) - 1:
            step = len(points) - 1 - at
            while step > 1 and not self._sees(points[at], points[at + step], free):
                step = step * 3 // 4
            at += max(step, 1)
            kept.append(points[at])
        return kept

    def _sees(self, a: Point, b: Point, free: NDArray[np.bool_]) -> bool:
        count = max(int(math.dist(a, b) / self.size * 2), 1) + 1
        xs = np.linspace(a[0], b[0], count)
        ys = np.linspace(a[1], b[1], count)
        rows = ((ys - self.plan.y) / self.size).astype(np.intp)
        columns = ((xs - self.plan.x) / self.size).astype(np.intp)
        rough = self._cost[rows, columns] > 1
        clear = free[rows, columns].all()
        # Along a wall the longer path of A* is better.
        return bool(clear and rough.sum() <= 4 + count // 3)


def _coarsen(cells: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    rows, columns = cells.shape
    padded = np.pad(cells, ((0, -rows % by), (0, -columns % by)), constant_values=True)
    return np.asarray(
        padded.reshape(padded.shape[0] // by, by, -1, by).any(axis=(1, 3))
    )


def _a_star(
    free: NDArray[np.bool_],
    cost: NDArray[np.float64],
    first: tuple[int, int],
    last: tuple[int, int],
) -> Iterator[list[tuple[int, int]] | None]:
    """Yield None after each slice of work, then the cells of the path, if any."""
    # Flat lists with a blocked border: no bounds checks, and faster than arrays.
    width = free.shape[1] + 2
    open_cells = np.pad(free, 1).ravel().tolist()
    costs = np.pad(cost, 1, constant_values=1.0).ravel().tolist()
    moves = [(1, 1.0), (-1, 1.0), (width, 1.0), (-width, 1.0)]
    moves += [(a + b, _DIAGONAL) for a in (1, -1) for b in (width, -width)]
    start = (first[0] + 1) * width + first[1] + 1
    end = (last[0] + 1) * width + last[1] + 1
    goal_row, goal_column = divmod(end, width)
    best = {start: 0.0}
    came_from = {start: start}
    queue = [(0.0, start)]
    closed: set[int] = set()
    while queue:
        for _ in range(_NODES_A_SLICE):
            if not queue:
                break
            _, here = heapq.heappop(queue)
            if here == end:
                yield _trace(came_from, end, width)
                return
            if here in closed:
                continue
            closed.add(here)
            so_far = best[here]
            for offset, length in moves:
                there = here + offset
                if not open_cells[there] or there in closed:
                    continue
                price = so_far + length * costs[there]
                if price < best.get(there, math.inf):
                    best[there] = price
                    came_from[there] = here
                    row, column = divmod(there, width)
                    down, across = abs(row - goal_row), abs(column - goal_column)
                    rest = max(down, across) + (_DIAGONAL - 1) * min(down, across)
                    heapq.heappush(queue, (price + rest, there))
        else:
            yield None
    yield []


def _trace(came_from: dict[int, int], end: int, width: int) -> list[tuple[int, int]]:
    cells = [end]
    while came_from[cells[-1]] != cells[-1]:
        cells.append(came_from[cells[-1]])
    return [(cell // width - 1, cell % width - 1) for cell in reversed(cells)]
