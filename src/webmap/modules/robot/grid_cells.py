"""Cells of a grid that somebody publishes one by one, such as what is inflated."""

from functools import cache, partial
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from webmap.core.from_above import in_space
from webmap.core.layer_names import label
from webmap.core.placed import Placed, check_finite, thinned
from webmap.core.refusals import refusing
from webmap.errors import ConfigError, ProtocolError
from webmap.geometry.reach import FARTHEST
from webmap.ros.bridge import Bridge
from webmap.ros.messages_points import GridCellsMsg
from webmap.scene import svg

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from webmap.core.robot import Robot
    from webmap.ros.messages import PointMsg
    from webmap.tf import Transform

    Points: TypeAlias = NDArray[np.float64]

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


class GridCells:
    """Draws a ``nav_msgs/GridCells``; one without cells draws nothing.

    Cells that touch along x are drawn as one rectangle, which is short on the wire.

    Style it by CSS: ``.gridcells > .cells``; one of several by its name, which is a
    class too: ``.gridcells.frontiers > .cells``.

    Args:
        robot: The robot that they are about.
        bridge: The link to the ROS system that has the topic.
        topic: The topic: ``/move_base/local_costmap/inflated_obstacles`` of older
            robots, frontiers of one that explores.
        name: A further class.
        frame: ``"map"``, or ``"robot"`` for cells in the robot's own frame.
        max_cells: How many are drawn at the most, evenly chosen. That there are more
            is said.
        throttle: The least time between two messages, in milliseconds.
        age_limit: Seconds after which they are drawn as old.

    Raises:
        ConfigError: If ``max_cells`` is less than 1.

    """

    def __init__(
        self,
        robot: "Robot",
        bridge: Bridge,
        topic: str,
        *,
        name: str = "",
        frame: str = "map",
        max_cells: int = 5000,
        throttle: int = 1000,
        age_limit: float = 10.0,
    ) -> None:
        if max_cells < 1:
            raise ConfigError(f"max_cells must be at least 1, got {max_cells}")
        self.robot = robot
        self.topic = topic
        self.max_cells = max_cells
        self.age_limit = age_limit
        self._message: GridCellsMsg | None = None
        self.drawn = svg.path(
            class_="cells",
            fill="#0f766e",
            fill_opacity=0.35,
            stroke="none",
            # Rows that touch would have seams between them.
            shape_rendering="crispEdges",
        )
        self._placed = Placed(
            robot, self.drawn, class_=f"gridcells {name}".strip(), frame=frame
        )
        self.svg = self._placed.svg
        label(self.svg, topic, robot)
        self._bridge = bridge
        bridge.subscribe(
            topic,
            refusing(robot, topic, self.on_cells),
            "nav_msgs/GridCells",
            throttle=throttle,
            decode=GridCellsMsg,
        )

    @property
    def cells(self) -> list[tuple[float, float]]:
        """The middles of the newest cells, all of them, in metres."""
        given = self._message.cells if self._message is not None else []
        return [(cell.x, cell.y) for cell in given]

    def on_cells(self, message: GridCellsMsg) -> None:
        """Draw cells in place of those before.

        Raises:
            ProtocolError: If one that is to be drawn is not finite or farther away than
                anything can be, if their size makes no sense, or there are too many to
                look at; or if there are more than ``max_cells``, but so many are drawn
                then.

        """
        given = message.cells
        if len(given) > MAX_CELLS:
            raise ProtocolError(f"{len(given)} cells; {MAX_CELLS} are the limit")
        # Only these are looked at: 100,000 would hold up the other robots for 0.1 s.
        chosen = [given[index] for index in thinned(len(given), self.max_cells)]
        size = message.size if chosen else (1.0, 1.0)
        rows = rows_of(_usable(chosen), *size)
        draw = partial(self._draw, rows, *size)
        self._placed.stand_in(message.frame_id, message.stamp, draw)
        self._message = message
        self.svg.set_age(self._bridge.lag, limit=self.age_limit)
        if len(given) > len(chosen):
            # Without their number, which would be another in every message.
            raise ProtocolError(
                f"there are more than {self.max_cells} cells, of which so many are "
                "drawn, evenly chosen; max_cells says how many"
            )

    def on_odometry_update(self) -> None:
        """Keep them where they are while the robot goes along."""
        self._placed.follow()

    def _draw(self, rows: Rows, width: float, height: float, tilt: "Transform") -> None:
        (a, b, c, x), (d, e, f, y), _ = tilt.rows
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
