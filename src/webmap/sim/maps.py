"""Floor plans in the format of ROS's map_server: a YAML file and an image."""

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
