"""Single cells of a grid, such as inflated obstacles."""

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
"""Smallest side of a cell that is drawn, in metres."""

MAX_CELLS = 100_000
"""Greatest number of cells that are processed."""

BESIDE = 0.01
"""Greatest offset between neighbours of a row, as a share of a cell."""


class Rows(NamedTuple):
    """Rows of cells that touch along x."""

    first: "Points"
    """The middle of the first cell of each row, of shape (N, 3), in metres."""

    lengths: list[int]
    """The number of cells of each row."""


class GridCellsMsg(Stamped, frozen=True, kw_only=True):
    """``nav_msgs/GridCells``."""

    cell_width: float
    """Size along x, in metres."""

    cell_height: float
    """Size along y, in metres."""

    cells: list[PointMsg]
    """Centres of the cells, in metres."""

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of a cell, in metres.

        Raises:
            ProtocolError: If cells of this size cannot be drawn.
        """
        for name, side in (
            ("cell_width", self.cell_width),
            ("cell_height", self.cell_height),
        ):
            if not SMALLEST <= side <= FARTHEST:  # also false for NaN
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
                    "its type alone, except the unknown space"
                ),
            },
        )
    ],
    switch="Cells",
    rank=100,
)
class GridCells(RobotLayer):
    """Cells, such as the inflated cells of older costmaps or the frontiers of a robot.

    Older costmaps publish them on ``/move_base/local_costmap/inflated_obstacles``. The
    least size of a cell is 0.1 mm. Cells that touch along x are drawn as one rectangle,
    to send less data; a message without cells draws nothing.

    Style it by CSS: ``.gridcells > .cells``, and one of several by its name:
    ``.gridcells.frontiers > .cells``.
    """

    only_draws = True

    frame: Frame = "map"
    """``"robot"`` for cells in the robot's own frame."""

    max_cells: Count = 5000
    """The greatest number of cells that are drawn, evenly chosen. A notice reports that
    there are more; more than 100 000 are refused.
    """

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
                # Touching rows would have visible seams.
                shape_rendering="crispEdges",
            )
        )

    @property
    def cells(self) -> list[tuple[float, float]]:
        """The centres of all cells of the newest message, in metres."""
        given = self._message.cells if self._message is not None else []
        return [(cell.x, cell.y) for cell in given]

    def read(self, message: GridCellsMsg) -> tuple[GridCellsMsg, Rows, float, float]:
        """Return the message, the rows of cells to draw, and a cell's width and height.

        Raises:
            ProtocolError: If a cell to draw is not finite or beyond the greatest
                distance, if the size of cells is not valid, or if there are too many
                cells.
        """
        given = message.cells
        if len(given) > MAX_CELLS:
            raise ProtocolError(f"{len(given)} cells; the limit is {MAX_CELLS}")
        # Only these are checked: 100,000 would delay the other robots by 0.1 s.
        chosen = [given[index] for index in thinned(len(given), self.max_cells)]
        width, height = message.size if chosen else (1.0, 1.0)
        rows = rows_of(_usable(chosen), width, height)
        if len(given) > len(chosen):
            # Without the number of cells, which would differ in every message.
            self.complain(
                f"there are more than {self.max_cells} cells: only that many are "
                "drawn, evenly chosen; max_cells sets the limit"
            )
        return message, rows, width, height

    def draw(
        self, found: tuple[GridCellsMsg, Rows, float, float], at: Transform
    ) -> None:
        """Draw the rows as seen from above."""
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
    """Return the centres of cells, in metres.

    Raises:
        ProtocolError: If a centre is not finite, or beyond the greatest distance.
    """
    import numpy as np

    points = np.array([(cell.x, cell.y, cell.z) for cell in cells]).reshape(-1, 3)
    points[~np.isfinite(points[:, 2]), 2] = 0.0
    if not (np.abs(points) <= FARTHEST).all():  # also false for NaN
        check_finite([(cell.x, cell.y) for cell in cells], "cells")
        in_space(cells)
    return points


def rows_of(cells: "Points", width: float, height: float) -> Rows:
    """Return cells that touch along x as rows.

    Args:
        cells: The centres, in metres, in any order.
        width: Width of a cell along x, in metres.
        height: Height of a cell along y, in metres.
    """
    import numpy as np

    if len(cells) == 0:
        return Rows(cells, [])
    x, y, _ = cells.T
    cells = cells[np.lexsort((x, np.rint((y - y.min()) / height)))]
    off = np.abs(np.diff(cells, axis=0) - (width, 0, 0))
    touch = (off <= (BESIDE * width, BESIDE * height, BESIDE * width)).all(axis=1)
    starts = np.flatnonzero(np.concatenate(([True], ~touch)))
    # Small offsets of cells add up along a row; the row is split then.
    number = np.arange(len(cells)) - np.repeat(starts, _lengths(starts, len(cells)))
    drift = cells[:, 0] - cells[np.arange(len(cells)) - number, 0] - number * width
    strays = np.diff(np.rint(drift / (BESIDE * width))) != 0
    starts = np.flatnonzero(np.concatenate(([True], ~touch | strays)))
    return Rows(cells[starts], _lengths(starts, len(cells)).tolist())


def _lengths(starts: "NDArray[np.intp]", count: int) -> "NDArray[np.intp]":
    import numpy as np

    return np.diff(starts, append=count)


def _short(value: float) -> str:
    """Return metres to a tenth of a millimetre, as cells may be small."""
    return f"{round(value, 4) + 0.0:.10g}"
