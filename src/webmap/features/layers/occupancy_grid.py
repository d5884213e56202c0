"""Maps and costmaps, drawn as tiles."""

import asyncio
import math
import time
from collections import deque
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

from webmap.base.errors import ProtocolError
from webmap.base.geometry import FARTHEST
from webmap.base.map_file import cell_at
from webmap.base.tasks import spawn
from webmap.core.problems import MessageProblems
from webmap.features.layers.grid_picture import Palette, check_palette
from webmap.features.layers.grid_tiles import MOST, SMALL, GridTiles
from webmap.modules.declaration import FoundTopic, TopicKind, layer
from webmap.modules.map_layer import MapLayer
from webmap.ros.messages import (
    Int8s,
    MapMetaDataMsg,
    OccupancyGridMsg,
    Stamped,
    cells_of,
)
from webmap.ros.tf import Transform

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Found: TypeAlias = tuple[MapMetaDataMsg, NDArray[np.int8]]

LATE = 15.0
"""Seconds, besides the throttle, by which a whole grid may come after its updates."""

SOON = 2.0
"""Seconds, besides the throttle, within which a whole grid follows an update that does
not fit the grid before."""

KEPT = 200
"""The number of updates that are kept for a whole grid that is still to come."""

_OTHER_VALUES = "other values"
"""The problem of cells that are not -1 to 100."""


class OccupancyGridUpdateMsg(Stamped, frozen=True, kw_only=True):
    """``map_msgs/OccupancyGridUpdate``: a rectangle of a grid."""

    x: int
    """The first column."""

    y: int
    """The first row."""

    width: int
    height: int
    data: Int8s

    @property
    def cells(self) -> "NDArray[np.int8]":
        """The cells, of shape (height, width), read-only.

        Raises:
            ProtocolError: If their number does not match the size.
        """
        return cells_of(self.data, self.width, self.height)


@layer(
    "nav_msgs/OccupancyGrid",
    view=OccupancyGridMsg,
    kinds=[
        TopicKind(
            "costmap",
            {
                r"local_costmap/costmap\Z": "a local costmap",
                r"(?<!global_)costmap/costmap\Z": "a costmap",
                r"\A(?!.*global_costmap/costmap\Z).*costmap": "named a costmap",
            },
            most=1,
            options={"palette": "costmap", "throttle": 500},
            role="costmap",
        ),
        TopicKind(
            "global costmap",
            {r"global_costmap/costmap\Z": "a global costmap"},
            most=1,
            # The whole map, below the local costmap: it is large, and changes slowly.
            options={"palette": "costmap", "throttle": 5000, "order": 15.0},
            role="costmap",
        ),
        TopicKind(
            "map",
            {r"/map\Z": "the usual name", r"map[^/]*\Z": "named a map"},
            most=4,
            shared=True,
            role="map",
        ),
        TopicKind(
            "grid", most=2, options={"palette": "costmap"}, shared=True, role="map"
        ),
    ],
    switch={
        "Maps": ".occupancy-grid:not(.costmap)",
        "Costmaps": ".occupancy-grid.costmap",
    },
    css="occupancy-grid",
    rank=10,
)
class OccupancyGrid(MapLayer):
    """A map or a costmap, shared by all pages.

    The topic has the type ``nav_msgs/OccupancyGrid``; the topic with ``_updates`` added
    has the type ``map_msgs/OccupancyGridUpdate``. Unknown cells are transparent. Cells
    are -1 to 100; other values are drawn in green if they are above 100 and in red to
    yellow if they are below -1, and a notice reports them, unless the palette is
    ``"raw"``.

    The throttle delays whole grids and no updates. So the updates that came before a
    whole grid but have a newer stamp, or the same one, are drawn on that grid too. When
    an update does not fit the grid, the updates wait for the next whole grid.

    A grid of more than a million cells is drawn as tiles of 512 x 512 cells, each an
    image. A tile is drawn and sent again only when its cells have changed. Of a grid of
    more than 16 million cells, several cells are drawn as one, with the greatest of
    their values, so that an occupied cell stays visible; a notice reports that.

    Style it by CSS: ``.occupancy-grid``, with the palette's name as a further class:
    ``.occupancy-grid.costmap { opacity: 0.4 }``.
    """

    only_draws = True

    topic: str = "/map"

    palette: Palette = "map"
    """``"map"``: free is white and occupied black. ``"costmap"``: free is transparent,
    then one hue, denser with the cost. ``"raw"``: the 256 values of a byte from white
    to black.
    """

    throttle: int = 0
    """The least time between two whole grids, in milliseconds."""

    map_frame: str | None = None
    """The map's frame, for data in another frame, such as a local costmap in ``odom``:
    the bridge's ``/tf`` transforms the data to the map. If not given, data is drawn
    without a transform.
    """

    order: float | None = None
    """The drawing order: greater is nearer; robots have 100. If not given, it is 20 for
    a costmap and 10 for any other grid.
    """

    @classmethod
    def options_for(cls, found: FoundTopic) -> dict[str, Any]:
        """Return the options of a grid; the rate of a robot's own grid is limited."""
        options = super().options_for(found)
        if found.kind.name == "grid" and found.own:
            options["throttle"] = 500
        return options

    def build(self) -> None:
        """Make the tiles.

        Raises:
            ConfigError: If there is no such palette.
        """
        check_palette(self.palette)
        self.usual_order = 20.0 if self.palette == "costmap" else 10.0
        self.info: MapMetaDataMsg | None = None
        """Size and position of the newest grid."""
        self.cells: NDArray[np.int8] | None = None
        """The newest cells, of shape (height, width), the lowest row first."""
        self._updates: list[OccupancyGridUpdateMsg] = []
        """Updates that are not drawn yet, the oldest first."""
        self._newest: deque[tuple[float, OccupancyGridUpdateMsg]] = deque(maxlen=KEPT)
        """The newest updates and their stamps, for a whole grid that is to come."""
        self._outgrown: tuple[float, str] | None = None
        """Until when updates wait for the next whole grid, and why."""
        self._copying: asyncio.Task[None] | None = None
        self.svg.classes.add(self.palette)
        # Each of several maps has its own switch.
        self.svg.set("data-layer", self.topic)
        if self.palette == "costmap":
            self.svg.set("data-layer", None).set(opacity=0.7)
        self.tiles = GridTiles(self.svg, self.palette, self._fail)

    def start(self) -> None:
        """Make the tiles, and subscribe to the grid and to its updates."""
        super().start()
        updates = self.topic.rstrip("/") + "_updates"
        self._refusing_updates = MessageProblems(self, updates)
        # Every update counts, so none may be delayed or replaced by the next.
        self.bridge.subscribe(
            updates,
            partial(self._refusing_updates.take, self.on_update),
            "map_msgs/OccupancyGridUpdate",
            decode=OccupancyGridUpdateMsg,
            encoding="binary",
            queue_length=100,
        )

    def read(self, message: OccupancyGridMsg) -> "Found":
        """Return size and position of a grid, and its cells.

        Raises:
            ProtocolError: If its size or its position is not valid.
        """
        info = message.info
        resolution = info.resolution
        if not (math.isfinite(resolution) and resolution > 0):
            raise ProtocolError(
                f"a cell must be a number of metres above 0, got {resolution}"
            )
        _ = info.origin.usable
        cells = message.cells
        side = resolution * max(info.width, info.height)
        if side > FARTHEST:
            raise ProtocolError(
                f"a grid has sides of at most {FARTHEST:g} m, got "
                f"{info.width} x {info.height} cells of {resolution:g} m"
            )
        return info, cells

    def take(self, message: OccupancyGridMsg) -> None:
        """Draw a grid, and the updates that were sent after it but came before it.

        Raises:
            ProtocolError: If it cannot be drawn.
        """
        super().take(message)
        self._outgrown = None
        self.clear_problem(self._refusing_updates)
        stamp = first = message.stamp
        if not self.throttle:  # of two equal stamps, the later message is the newer one
            first = math.nextafter(stamp, math.inf)
        last = stamp + LATE + self.throttle / 1000
        if stamp:
            self._updates = [
                update
                for at, update in self._newest
                if first <= at <= last and self._fits(update)
            ]
        if self._updates:
            self._change()

    def draw(self, found: "Found", at: Transform) -> None:
        """Draw a full grid, which replaces all earlier updates."""
        self.info, self.cells = found
        self._updates.clear()
        if not self._report_other_values(self.cells):
            self.clear_problem(_OTHER_VALUES)
        self.tiles.show(self.cells, self.info.resolution, self.info.origin.planar)
        if self.tiles.coarse > 1:
            height, width = self.cells.shape
            side = self.tiles.coarse
            self.complain(
                f"the grid has {width} x {height} cells, more than {MOST // 1_000_000} "
                f"million: each {side} x {side} cells are drawn as one, with the "
                "greatest of their values"
            )

    def cell_at(self, x: float, y: float) -> int | None:
        """Return the value of the cell at a place, -1 outside; None without a map."""
        if self.cells is None or self.info is None or self.palette != "map":
            return None
        u, v = self.anchor.place.inverse.apply(x, y)
        origin = self.info.origin.planar
        return cell_at(self.cells, self.info.resolution, origin, u, v)

    def on_update(self, update: OccupancyGridUpdateMsg) -> None:
        """Change a rectangle of the grid; does nothing without a grid.

        Raises:
            ProtocolError: If the rectangle extends beyond the grid, or one did shortly
                before: the update then waits for the next whole grid.
        """
        patch, now = update.cells, time.monotonic()
        self._newest.append((update.stamp, update))
        while sum(each.width * each.height for _, each in self._newest) > MOST:
            self._newest.popleft()
        if self.cells is None:
            return
        self._report_other_values(patch)
        if self._fits(update):
            self._updates.append(update)
        else:
            height, width = self.cells.shape
            why = (
                f"an update of {update.width} x {update.height} cells at column "
                f"{update.x}, row {update.y} reaches out of a grid of {width} x "
                f"{height}: the updates wait for the next whole grid"
            )
            until, _ = self._outgrown or (now + self.throttle / 1000 + SOON, "")
            self._outgrown = until, why
            raise ProtocolError(why)
        if self._outgrown is not None and now < self._outgrown[0]:
            raise ProtocolError(self._outgrown[1])
        self._change()

    def _fits(self, update: OccupancyGridUpdateMsg) -> bool:
        """Return whether the rectangle of an update is a part of the grid."""
        assert self.cells is not None
        height, width = self.cells.shape
        left, above = width - update.width, height - update.height
        return bool(0 <= update.x <= left and 0 <= update.y <= above)

    def _report_other_values(self, cells: "NDArray[np.int8]") -> bool:
        text = other_values(cells, self.palette)
        if text:
            self.set_problem(_OTHER_VALUES, f"{self.topic}: {text}")
        return bool(text)

    def _change(self) -> None:
        """Draw the updates that wait, once the cells of a message are copied."""
        assert self.cells is not None
        if not self.cells.flags.writeable and self.cells.size > SMALL:
            if self._copying is None:
                self._copying = spawn(self._copy())
            return
        if not self.cells.flags.writeable:
            self.cells = self.cells.copy()
        self._update()

    async def _copy(self) -> None:
        """Copy the cells of a large message, which others may use, for the updates.

        The copy is made in a thread, since it takes several milliseconds.
        """
        try:
            while self._updates and self.cells is not None and not self.scope.closed:
                given = self.cells
                copy = await asyncio.to_thread(given.copy)
                if self.cells is given:  # no new grid came meanwhile
                    self.cells = copy
                    self._update()
        finally:
            self._copying = None

    def _update(self) -> None:
        """Change the cells by the updates that wait."""
        assert self.cells is not None
        for update in self._updates:
            x, y, patch = update.x, update.y, update.cells
            height, width = patch.shape
            self.cells[y : y + height, x : x + width] = patch
            self.tiles.change(self.cells, x, y, width, height)
        self._updates.clear()
        self.be_new()

    def _fail(self, problem: str | None) -> None:
        """Show why tiles cannot be drawn, or that they can again."""
        if problem is None:
            self.clear_problem(self)
        else:
            self.set_problem(self, f"{self.topic}: {problem}")


def other_values(cells: "NDArray[np.int8]", palette: str) -> str:
    """Return a sentence about cells that are not -1 to 100; empty if there are none."""
    low, high = int(cells.min()), int(cells.max())
    if palette == "raw" or (low >= -1 and high <= 100):
        return ""
    count = int(((cells < -1) | (cells > 100)).sum())
    return (
        f"cells are -1 to 100, but {count} of {cells.size} are not: one is "
        f"{low if low < -1 else high}; they are drawn in green, or in red to yellow"
    )
