"""Typed views of single points, and of the cells of grids."""

import math

from webmap.errors import ProtocolError
from webmap.geometry import Vector3
from webmap.geometry.reach import FARTHEST
from webmap.ros.messages import PointMsg, Stamped

SMALLEST = 1e-4
"""Metres: the side of the smallest cell that is drawn."""


class PointStampedMsg(Stamped, frozen=True, kw_only=True):
    """``geometry_msgs/PointStamped``."""

    point: PointMsg

    @property
    def usable(self) -> Vector3:
        """The place of a point that has one, in metres; without a height it is 0.

        Raises:
            ProtocolError: If a number in the plane is NaN or infinite, or it is
                farther away than anything can be.

        """
        p = self.point
        if not (math.isfinite(p.x) and math.isfinite(p.y)):
            raise ProtocolError(
                f"a point must be of finite numbers, got ({p.x}, {p.y})"
            )
        height = p.z if math.isfinite(p.z) else 0.0
        if max(abs(p.x), abs(p.y)) > FARTHEST:
            raise ProtocolError(
                f"a point must be within {FARTHEST:g} m of the origin, got "
                f"({p.x:g}, {p.y:g})"
            )
        if abs(height) > FARTHEST:
            raise ProtocolError(
                f"a point must be within {FARTHEST:g} m of the plane, got a height of "
                f"{height:g}"
            )
        return Vector3(p.x, p.y, height)


class GridCellsMsg(Stamped, frozen=True, kw_only=True):
    """``nav_msgs/GridCells``."""

    cell_width: float
    """Metres along x."""

    cell_height: float
    """Metres along y."""

    cells: list[PointMsg]
    """Their middles, in metres."""

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of a cell, in metres.

        Raises:
            ProtocolError: If a cell of that size cannot be drawn.

        """
        for name, side in (
            ("cell_width", self.cell_width),
            ("cell_height", self.cell_height),
        ):
            if not SMALLEST <= side <= FARTHEST:  # nor is NaN
                raise ProtocolError(
                    f"{name} must be from {SMALLEST:g} to {FARTHEST:g} m, got {side:g}"
                )
        return self.cell_width, self.cell_height
