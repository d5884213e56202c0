"""Maps and costmaps, as images."""

import asyncio
import math
from typing import TYPE_CHECKING

from webmap.core.anchored import Anchored
from webmap.core.grid_picture import (
    Palette,
    check_palette,
    draw_aside,
    grid_png,
    place_grid,
)
from webmap.core.layer import Layer
from webmap.core.pictures import Picture
from webmap.core.refusals import refusing
from webmap.core.tasks import spawn
from webmap.errors import ProtocolError
from webmap.geometry.reach import FARTHEST
from webmap.ros.bridge import Bridge
from webmap.ros.messages import MapMetaDataMsg, OccupancyGridMsg
from webmap.ros.messages_grid import OccupancyGridUpdateMsg

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from webmap.core.map import Map
    from webmap.core.robot import Robot

SMALL = 1 << 18
"""Cells up to which a grid is drawn at once; a larger one in the worker process."""

NEVER = 1e9
"""Seconds after which a grid without an age limit is drawn as old."""


class OccupancyGrid:
    """Draws a ``nav_msgs/OccupancyGrid`` and its ``map_msgs/OccupancyGridUpdate``.

    All maps that show the same grid share one image, which is drawn once a message.
    What is unknown is transparent. Cells must be -1 to 100; other values are refused,
    unless the palette is ``"raw"``.

    Style it by CSS: ``.occupancy-grid``, with the palette's name as a further class:
    ``.occupancy-grid.costmap { opacity: 0.4 }``.

    Args:
        map: The map.
        bridge: The link to the ROS system that has the topic.
        topic: The topic; its updates come on the same with ``_updates`` behind.
        palette: ``"map"``: free is white and occupied black. ``"costmap"``: free is
            transparent, then blue to red, inscribed cyan and lethal purple.
            ``"raw"``: the 256 values of a byte from white to black.
        throttle: The least time between two whole grids, in milliseconds.
        age_limit: Seconds after which the grid is drawn as old; None for a map that
            is sent but once.
        map_frame: The map's frame, for data that is in another: it is taken there by
            the frames of the bridge's ``/tf``. If not given, data is drawn as it
            comes.
        namespace: ``/robot_0`` where the frames are on ``/robot_0/tf``.
        robot: Whose grid it is: it lies as that one is aligned, and as its bridge is if
            it is nobody's own.
        order: What lies over what: greater is nearer; robots have 100.

    Raises:
        ConfigError: If there is no such palette.

    """

    def __init__(
        self,
        map: "Map",
        bridge: Bridge,
        topic: str = "/map",
        *,
        palette: Palette = "map",
        throttle: int = 0,
        age_limit: float | None = None,
        map_frame: str | None = None,
        namespace: str = "",
        robot: "Robot | None" = None,
        order: float | None = None,
    ) -> None:
        check_palette(palette)
        self.map = map
        self.layer = Grid.shared(
            bridge, topic, palette, throttle, age_limit, map_frame, namespace, robot
        )
        if order is None:
            order = 20.0 if palette == "costmap" else 10.0
        self.layer.show_on(map, order=order)


class Grid(Layer):
    """One grid, for all maps that show it."""

    def __init__(
        self,
        bridge: Bridge,
        topic: str,
        palette: str,
        throttle: int,
        age_limit: float | None,
        map_frame: str | None,
        namespace: str,
        robot: "Robot | None" = None,
    ) -> None:
        super().__init__()
        self.anchor = Anchored(self, bridge, map_frame, namespace, robot)
        self.bridge = bridge
        self.topic = topic
        self.palette = palette
        self.throttle = throttle
        self.age_limit = NEVER if age_limit is None else age_limit
        self.info: MapMetaDataMsg | None = None
        """Size and place of what came last."""
        self.cells: NDArray[np.int8] | None = None
        """What came last, of shape (height, width), the lowest row first."""
        self._drawing: asyncio.Task[None] | None = None
        self._undrawn = False
        self.svg.classes.add("occupancy-grid", palette)
        self.svg.set(pointer_events="none")
        if palette == "costmap":
            self.svg.set(opacity=0.7)
        else:  # each of several maps is switched by itself
            self.svg.set("data-layer", topic)

    def start(self) -> None:
        """Subscribe to the grid and to its updates."""
        self.picture = Picture()
        self.svg.append(self.picture.element)
        self.bridge.subscribe(
            self.topic,
            refusing(self, self.topic, self.on_grid),
            "nav_msgs/OccupancyGrid",
            throttle=self.throttle,
            decode=OccupancyGridMsg,
        )
        updates = self.topic.rstrip("/") + "_updates"
        # Every update counts, so none may be held back or replaced by the next.
        self.bridge.subscribe(
            updates,
            refusing(self, updates, self.on_update),
            "map_msgs/OccupancyGridUpdate",
            decode=OccupancyGridUpdateMsg,
            compression="cbor",
            queue_length=100,
        )

    def on_grid(self, grid: OccupancyGridMsg) -> None:
        """Draw a grid in place of the one before.

        Raises:
            ProtocolError: If its size, its place or a cell makes no sense.

        """
        resolution = grid.info.resolution
        if not (math.isfinite(resolution) and resolution > 0):
            raise ProtocolError(
                f"a cell must be a number of metres above 0, got {resolution}"
            )
        _ = grid.info.origin.usable
        cells = grid.cells
        side = resolution * max(grid.info.width, grid.info.height)
        if side > FARTHEST:
            raise ProtocolError(
                f"a grid has sides of {FARTHEST:g} m at the most, got "
                f"{grid.info.width} x {grid.info.height} cells of {resolution:g} m"
            )
        check_values(cells, self.palette)
        self.anchor.stand_in(grid.frame_id, grid.stamp)
        self.info, self.cells = grid.info, cells
        self._draw()

    def on_update(self, update: OccupancyGridUpdateMsg) -> None:
        """Change a rectangle of the grid; without a grid there is nothing to change.

        Raises:
            ProtocolError: If it reaches out of the grid, or a cell makes no sense.

        """
        if self.cells is None:
            return
        x, y, patch = update.x, update.y, update.cells
        height, width = self.cells.shape
        if not (0 <= x <= width - update.width and 0 <= y <= height - update.height):
            raise ProtocolError(
                f"an update of {update.width} x {update.height} cells at column {x}, "
                f"row {y} reaches out of a grid of {width} x {height}"
            )
        check_values(patch, self.palette)
        if not self.cells.flags.writeable:
            self.cells = self.cells.copy()
        self.cells[y : y + update.height, x : x + update.width] = patch
        self._draw()

    def _draw(self) -> None:
        self.svg.set_age(self.bridge.lag, limit=self.age_limit)
        if self.cells is not None and self.cells.size <= SMALL:
            self._show(grid_png(self.cells, self.palette), self.info)
            return
        self._undrawn = True
        if self._drawing is None:
            self._drawing = spawn(self._draw_on())

    async def _draw_on(self) -> None:
        """Draw what is newest until that is drawn."""
        try:
            while self._undrawn and self.cells is not None and not self.scope.closed:
                self._undrawn = False
                cells, info = self.cells, self.info
                # An update meanwhile may be half drawn; it has it drawn again.
                try:
                    png = await draw_aside(cells, self.palette)
                except ProtocolError as error:
                    self.set_problem(self, f"{self.topic}: {error}")
                    continue
                self.clear_problem(self)
                self._show(png, info)
        finally:
            self._drawing = None

    def _show(self, png: bytes, info: MapMetaDataMsg | None) -> None:
        if info is None or self.scope.closed:
            return
        size = (info.width * info.resolution, info.height * info.resolution)
        self.picture.show(
            png, place_grid(info.origin.planar, size[1]), *size, info.resolution
        )


def check_values(cells: "NDArray[np.int8]", palette: str) -> None:
    """Let cells pass that the palette has a colour for.

    Raises:
        ProtocolError: If there are others; one of them is named.

    """
    if palette == "raw":
        return
    low, high = int(cells.min()), int(cells.max())
    if low < -1 or high > 100:
        wrong = low if low < -1 else high
        count = int(((cells < -1) | (cells > 100)).sum())
        raise ProtocolError(
            f"cells are -1 to 100, but {count} of {cells.size} are not: one is {wrong}"
        )
