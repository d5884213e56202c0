"""Cells of a grid that somebody publishes one by one, such as what is inflated."""

from collections.abc import Sequence
from functools import cache, partial
from typing import TYPE_CHECKING, TypeAlias

from webmap.core.from_above import flat, in_space
from webmap.core.layer_names import label
from webmap.core.placed import Placed, check_finite, thinned
from webmap.core.refusals import refusing
from webmap.errors import ConfigError, ProtocolError
from webmap.geometry import Vector3
from webmap.ros.bridge import Bridge
from webmap.ros.messages_points import GridCellsMsg
from webmap.scene import svg

if TYPE_CHECKING:
    from webmap.core.robot import Robot
    from webmap.tf import Transform

MAX_CELLS = 100_000
"""Cells of which no more are looked at."""

BESIDE = 0.01
"""Share of a cell by which the next one in a row may be off."""

Row: TypeAlias = tuple[Vector3, int]
"""The middle of the first cell along x, and how many cells there are."""


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
        check_finite([(cell.x, cell.y) for cell in chosen], "cells")
        size = message.size if chosen else (1.0, 1.0)
        rows = rows_of(in_space(chosen), *size)
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

    def _draw(
        self, rows: list[Row], width: float, height: float, tilt: "Transform"
    ) -> None:
        corners = flat(
            (
                Vector3(first.x - width / 2, first.y - height / 2, first.z)
                for first, _ in rows
            ),
            tilt,
        )
        (a, b, _, _), (c, d, _, _), _ = tilt.rows
        aside = f"{_short(b * height)} {_short(d * height)}"

        @cache
        def outline(count: int) -> str:
            along = f"{_short(a * width * count)} {_short(c * width * count)}"
            back = f"{_short(-a * width * count)} {_short(-c * width * count)}"
            return f"l{along} {aside} {back}z"

        parts = [
            f"M{_short(x)} {_short(y)}{outline(count)}"
            for (x, y), (_, count) in zip(corners, rows, strict=True)
        ]
        self.drawn.set(d="".join(parts) or None)


def rows_of(cells: Sequence[Vector3], width: float, height: float) -> list[Row]:
    """Return cells that touch along x as rows.

    Args:
        cells: Their middles, in metres, in any order.
        width: Of a cell along x, in metres.
        height: Of a cell along y, in metres.

    """
    low = min((cell.y for cell in cells), default=0.0)

    def row_by_row(cell: Vector3) -> tuple[int, float]:
        return round((cell.y - low) / height), cell.x

    rows: list[Row] = []
    for cell in sorted(cells, key=row_by_row):
        if rows:
            first, count = rows[-1]
            if (
                abs(cell.x - first.x - count * width) <= BESIDE * width
                and abs(cell.y - first.y) <= BESIDE * height
                and abs(cell.z - first.z) <= BESIDE * width
            ):
                rows[-1] = first, count + 1
                continue
        rows.append((cell, 1))
    return rows


def _short(value: float) -> str:
    """Return metres to a tenth of a millimetre: cells may be small."""
    return f"{round(value, 4) + 0.0:.10g}"
