"""Cells of a grid that somebody publishes one by one, such as what is inflated."""

from functools import cache
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from webmap.base.errors import ProtocolError
from webmap.base.geometry import FARTHEST
from webmap.modules.declaration import TopicKind, layer
from webmap.modules.drawing import check_finite, in_space, thinned
from webmap.modules.layer_options import Count, Frame
from webmap.modules.robot_layer import RobotLayer
from webmap.ros.messages import PointMsg, Stamped
from webmap.ros.tf import Transform
from webmap.scene import svg

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Points: TypeAlias = NDArray[np.float64]

SMALLEST = 1e-4
"""Metres: the side of the smallest cell that is drawn."""

MAX_CELLS = 100_000
"""Cells of which no more are looked at."""

BESIDE = 0.01
"""Share of a cell by which the next one in a row may be off."""


class Rows(NamedTuple):
    """Cells that touch along x."""

    first: "Points"
    """The middle of the first cell of each row, of shape (N, 3), in metres."""

    lengths: list[int]
    """How many cells each row has."""


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


@layer(
    "nav_msgs/GridCells",
    view=GridCellsMsg,
    kinds=[
        TopicKind(
            "cells",
            {
                r"local_costmap/(?!unknown_space\Z)": "of a local costmap",
                r"\A(?!.*unknown_space\Z)": (
                    "its type alone, unless it is all that nobody knows"
                ),
            },
        )
    ],
    switch="Cells",
    rank=100,
)
class GridCells(RobotLayer):
    """Cells, such as the inflated ones of older costmaps or frontiers of a robot.

    The older costmaps have them on ``/move_base/local_costmap/inflated_obstacles``. A
    cell is 0.1 mm wide at the least. Cells that touch along x are drawn as one
    rectangle, which is short on the wire; a message without cells draws nothing.

    Style it by CSS: ``.gridcells > .cells``, and one of several by its name:
    ``.gridcells.frontiers > .cells``.
    """

    frame: Frame = "map"
    """``"robot"`` for cells in the robot's own frame."""

    max_cells: Count = 5000
    """How many are drawn at the most, evenly chosen. That there are more is said; more
    than 100 000 are refused."""

    throttle: int = 1000
    age_limit: float = 10.0

    def build(self) -> None:
        """Make the path of all cells."""
        self._message: GridCellsMsg | None = None
        self.drawn = self.add(
            svg.path(
                class_="cells",
                fill="#0f766e",
                fill_opacity=0.35,
                stroke="none",
                # Rows that touch would have seams between them.
                shape_rendering="crispEdges",
            )
        )

    @property
    def cells(self) -> list[tuple[float, float]]:
        """The middles of the newest cells, all of them, in metres."""
        given = self._message.cells if self._message is not None else []
        return [(cell.x, cell.y) for cell in given]

    def read(self, message: GridCellsMsg) -> tuple[GridCellsMsg, Rows, float, float]:
        """Return the message, the rows of cells to draw, and a cell's width and height.

        Raises:
            ProtocolError: If one that is to be drawn is not finite or farther away than
                anything can be, if their size makes no sense, or there are too many to
                look at.

        """
        given = message.cells
        if len(given) > MAX_CELLS:
            raise ProtocolError(f"{len(given)} cells; {MAX_CELLS} are the limit")
        # Only these are looked at: 100,000 would hold up the other robots for 0.1 s.
        chosen = [given[index] for index in thinned(len(given), self.max_cells)]
        width, height = message.size if chosen else (1.0, 1.0)
        rows = rows_of(_usable(chosen), width, height)
        if len(given) > len(chosen):
            # Without their number, which would be another in every message.
            self.complain(
                f"there are more than {self.max_cells} cells, of which so many are "
                "drawn, evenly chosen; max_cells says how many"
            )
        return message, rows, width, height

    def draw(
        self, found: tuple[GridCellsMsg, Rows, float, float], at: Transform
    ) -> None:
        """Draw the rows as they look from above."""
        self._message, rows, width, height = found
        (a, b, c, x), (d, e, f, y), _ = at.rows
        east, north, up = (rows.first - (width / 2, height / 2, 0)).T
        aside = f"{_short(b * height)} {_short(e * height)}"

        @cache
        def outline(count: int) -> str:
            along = f"{_short(a * width * count)} {_short(d * width * count)}"
            back = f"{_short(-a * width * count)} {_short(-d * width * count)}"
            return f"l{along} {aside} {back}z"

        corners = zip(
            ((a * east + b * north + c * up + x).round(4) + 0.0).tolist(),
            ((d * east + e * north + f * up + y).round(4) + 0.0).tolist(),
            rows.lengths,
            strict=True,
        )
        parts = [f"M{x:.10g} {y:.10g}{outline(count)}" for x, y, count in corners]
        self.drawn.set(d="".join(parts) or None)


def _usable(cells: "list[PointMsg]") -> "Points":
    """Return the middles of cells, in metres.

    Raises:
        ProtocolError: If one is not finite, or farther away than anything can be.

    """
    import numpy as np

    points = np.array([(cell.x, cell.y, cell.z) for cell in cells]).reshape(-1, 3)
    points[~np.isfinite(points[:, 2]), 2] = 0.0
    if not (np.abs(points) <= FARTHEST).all():  # nor is NaN
        check_finite([(cell.x, cell.y) for cell in cells], "cells")
        in_space(cells)
    return points


def rows_of(cells: "Points", width: float, height: float) -> Rows:
    """Return cells that touch along x as rows.

    Args:
        cells: Their middles, in metres, in any order.
        width: Of a cell along x, in metres.
        height: Of a cell along y, in metres.

    """
    import numpy as np

    if len(cells) == 0:
        return Rows(cells, [])
    x, y, _ = cells.T
    cells = cells[np.lexsort((x, np.rint((y - y.min()) / height)))]
    off = np.abs(np.diff(cells, axis=0) - (width, 0, 0))
    touch = (off <= (BESIDE * width, BESIDE * height, BESIDE * width)).all(axis=1)
    starts = np.flatnonzero(np.concatenate(([True], ~touch)))
    # Cells that are a little off add up along a row, which then begins anew.
    number = np.arange(len(cells)) - np.repeat(starts, _lengths(starts, len(cells)))
    drift = cells[:, 0] - cells[np.arange(len(cells)) - number, 0] - number * width
    strays = np.diff(np.rint(drift / (BESIDE * width))) != 0
    starts = np.flatnonzero(np.concatenate(([True], ~touch | strays)))
    return Rows(cells[starts], _lengths(starts, len(cells)).tolist())


def _lengths(starts: "NDArray[np.intp]", count: int) -> "NDArray[np.intp]":
    import numpy as np

    return np.diff(starts, append=count)


def _short(value: float) -> str:
    """Return metres to a tenth of a millimetre: cells may be small."""
    return f"{round(value, 4) + 0.0:.10g}"
