"""Floor plans of map_server, a YAML file and an image; and distances to obstacles."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from webmap.base.errors import ConfigError
from webmap.base.map_file import read_map

FLOOR = Path(__file__).parent / "data" / "floor.yaml"
"""The floor plan that comes with the simulator."""

FREE, OCCUPIED, UNKNOWN = 0, 100, -1


@dataclass(frozen=True, slots=True, eq=False)
class FloorPlan:
    """A grid of cells, as in ``nav_msgs/OccupancyGrid``."""

    occupancy: NDArray[np.int8]
    """Of shape (rows, columns), the lowest row first: 0 to 100, or -1 unknown."""

    resolution: float
    """The side of a cell, in metres."""

    x: float
    """The left edge of the first column, in metres."""

    y: float
    """The lower edge of the first row, in metres."""

    image: Path | None = None
    """The file that it was read from."""

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Return the row and the column of a point, which may be outside."""
        return (
            math.floor((y - self.y) / self.resolution),
            math.floor((x - self.x) / self.resolution),
        )

    def center(self, row: int, column: int) -> tuple[float, float]:
        """Return the center of a cell, in metres."""
        return (
            self.x + (column + 0.5) * self.resolution,
            self.y + (row + 0.5) * self.resolution,
        )


def load_map(path: Path | str) -> FloorPlan:
    """Return the floor plan of a map_server YAML file.

    Args:
        path: The YAML file. Its image must be in the same folder or below.

    Raises:
        ConfigError: If a file is missing or invalid.

    """
    path = Path(path)
    read = read_map(path)
    at = read.origin
    if at.yaw:
        raise ConfigError(
            f"{path}: an origin with a yaw is not supported by the simulator, got "
            f"{at.yaw}"
        )
    cells = np.ascontiguousarray(read.cells)
    return FloorPlan(cells, read.resolution, at.x, at.y, read.image)


_SOLID_FROM = 65
_FARTHEST = 120


class Obstacles:
    """The solid cells of a floor plan, for rays and bases."""

    def __init__(self, plan: FloorPlan) -> None:
        self.plan = plan
        self.solid: NDArray[np.bool_] = plan.occupancy >= _SOLID_FROM
        self.free: NDArray[np.bool_] = (plan.occupancy >= 0) & ~self.solid
        self.steps = chebyshev_distance(self.solid, _FARTHEST)
        """For each cell, the distance to the nearest solid one, in cells."""

    def near(self, distance: float) -> NDArray[np.bool_]:
        """Return the cells that are within ``distance`` metres of a solid one."""
        return dilate(self.solid, distance / self.plan.resolution)

    def touches(self, x: float, y: float, radius: float) -> bool:
        """Return whether a disc overlaps a solid cell, or is beyond the plan."""
        size = self.plan.resolution
        row, column = self.plan.cell(x, y)
        rows, columns = self.solid.shape
        if not (0 <= row < rows and 0 <= column < columns):
            return True
        reach = math.ceil(radius / size)
        if self.steps[row, column] > reach + 1:
            return False
        top, left = max(row - reach, 0), max(column - reach, 0)
        window = self.solid[top : row + reach + 1, left : column + reach + 1]
        hit_rows, hit_columns = np.nonzero(window)
        if not len(hit_rows):
            return False
        # From the disc's center to the nearest point of each solid square.
        low_x = self.plan.x + (hit_columns + left) * size
        low_y = self.plan.y + (hit_rows + top) * size
        away_x = np.maximum(np.maximum(low_x - x, x - low_x - size), 0)
        away_y = np.maximum(np.maximum(low_y - y, y - low_y - size), 0)
        return bool((away_x * away_x + away_y * away_y < radius * radius).any())


def chebyshev_distance(solid: NDArray[np.bool_], farthest: int) -> NDArray[np.int16]:
    """Return the distance of each cell to the nearest solid one, in king's moves."""
    distance = np.full(solid.shape, farthest, np.int16)
    grown = solid.copy()
    distance[grown] = 0
    for step in range(1, farthest):
        wide = grown.copy()
        wide[1:] |= grown[:-1]
        wide[:-1] |= grown[1:]
        grown = wide.copy()
        grown[:, 1:] |= wide[:, :-1]
        grown[:, :-1] |= wide[:, 1:]
        fresh = grown & (distance == farthest)
        if not fresh.any():
            break
        distance[fresh] = step
    return distance


def dilate(solid: NDArray[np.bool_], radius: float) -> NDArray[np.bool_]:
    """Return the cells whose center is within ``radius`` cells of a solid one's."""
    rows = len(solid)
    reach = min(math.floor(radius), rows - 1)
    across = distance_in_row(solid)
    grown = np.zeros_like(solid)
    for up in range(-reach, reach + 1):
        # One row of the disc at a time.
        row_hits = across <= math.floor(math.sqrt(radius * radius - up * up))
        source = slice(max(-up, 0), rows - max(up, 0))
        target = slice(max(up, 0), rows - max(-up, 0))
        grown[target] |= row_hits[source]
    return grown


def distance_in_row(solid: NDArray[np.bool_]) -> NDArray[np.int32]:
    """Return the distance of each cell to the nearest solid one of its row, in cells.

    It is more than a million in a row without solid cells.
    """
    column = np.arange(solid.shape[1], dtype=np.int32)
    none = np.int32(1 << 30)
    before = np.maximum.accumulate(np.where(solid, column, -none), axis=1)
    after = np.minimum.accumulate(np.where(solid, column, none)[:, ::-1], axis=1)
    return np.minimum(column - before, after[:, ::-1] - column)
