"""Grids as tiles: each tile is a picture of its own, drawn when its cells change."""

import asyncio
import hashlib
import math
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from webmap.base.errors import ProtocolError
from webmap.base.geometry import Affine, Pose
from webmap.base.processes import load_soon
from webmap.base.scope import Removal, keep, no_scope
from webmap.base.tasks import spawn
from webmap.core.pictures import Picture
from webmap.features.layers.grid_picture import draw_in_worker, grid_png, place_grid
from webmap.ros.offload import worker_kept
from webmap.scene.element import Element

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

ONE = 1 << 20
"""Cells up to which a grid is one tile, as are most floors of buildings."""

SIDE = 512
"""The side of a tile of a larger grid, in cells."""

OVERLAP = 8
"""Further cells of a tile at its right and at its top, which the next tile draws too.

The edges of a picture are blended with what is below. Without the overlap that would
be the background: a line between two tiles. So the overlap must be at least a pixel
wide: there is no line while up to eight cells share a pixel of the screen.
"""

SMALL = 1 << 18
"""Cells up to which a grid is drawn at once; the worker process draws larger grids."""

MOST = 1 << 24
"""Cells up to which each cell is drawn as a pixel of its own; of a larger grid, a pixel
shows the greatest value of several cells, so that an occupied cell is always seen."""

BATCH = 4
"""Tiles that the worker process draws at a time, so that others get their turn."""

SAME = 0.01
"""Greatest offset between two grids whose cells count as aligned, in cells."""

Place = tuple[int, int]
"""Column and row of a tile in its lattice."""


class Lattice(NamedTuple):
    """Where the cells of several grids lie, so that a grid that grows keeps its tiles.

    A robot that explores publishes its map with another origin and another size each
    time; most of its cells stay where they were.
    """

    origin: Pose
    """The pose of the lower left corner of cell (0, 0)."""

    resolution: float
    """The side of a cell, in metres."""

    def cell_of(self, origin: Pose, resolution: float) -> tuple[int, int] | None:
        """Return the cell at a grid's origin; None if the cells are not aligned."""
        yaw = self.origin.yaw
        if (resolution, origin.yaw) != (self.resolution, yaw):
            return None
        east, north = origin.x - self.origin.x, origin.y - self.origin.y
        cos, sin = math.cos(yaw), math.sin(yaw)
        column = (cos * east + sin * north) / resolution
        row = (cos * north - sin * east) / resolution
        nearest = round(column), round(row)
        off = max(abs(column - nearest[0]), abs(row - nearest[1]))
        return nearest if off <= SAME else None

    def place(self, column: int, row: int, height: int) -> Affine:
        """Return the transform of a picture, for ``Picture.show``.

        Args:
            column: The first column of its cells.
            row: The lowest row of its cells.
            height: The number of its rows.
        """
        start = self.origin.x, self.origin.y
        turned = Affine.translation(*start) @ Affine.rotation(self.origin.yaw)
        x, y = turned.apply(column * self.resolution, row * self.resolution)
        return place_grid(Pose(x, y, self.origin.yaw), height * self.resolution)


class _Drawing(NamedTuple):
    """The cells of one tile at one time, and where they belong."""

    place: Place
    number: int
    cells: "NDArray[np.int8]"
    matrix: Affine
    resolution: float


class _Tile:
    def __init__(self) -> None:
        self.picture: Picture | None = None
        """None until it is drawn, and while nothing of it can be seen."""
        self.taken: tuple[bytes, Affine] | None = None
        """The digest of its cells when they were last read, and their place."""
        self.shown = 0
        """The number of the drawing that is shown."""


class GridTiles:
    """Draws a grid into a group; a change costs as much as the tiles it touches.

    A small grid is drawn at once. The tiles of a larger one are drawn by the worker
    process, a few at a time, those first that have waited longest. A tile without a
    visible cell has no picture.

    Args:
        group: The group; it gets one ``<image>`` for each tile.
        palette: The name of a palette.
        failed: Called with a sentence when tiles cannot be drawn, and with None when
            they can again.
    """

    def __init__(
        self, group: Element, palette: str, failed: Callable[[str | None], object]
    ) -> None:
        self.palette = palette
        self.tiles: dict[Place, _Tile] = {}
        self._group = group
        self._failed = failed
        self._cells: NDArray[np.int8] | None = None
        self._lattice: Lattice | None = None
        self._first = (0, 0)
        """The cell of the lattice at the grid's lower left corner."""
        self._side = SIDE
        self.coarse = 1
        """The cells along each side of a pixel."""
        self._undrawn: dict[Place, None] = {}
        """The tiles to draw, the one that has waited longest first."""
        self._numbers = 0
        self._drawing: asyncio.Task[None] | None = None
        self._closed = False
        load_soon("PIL.PngImagePlugin")
        keep(Removal(self._end))

    @property
    def is_drawing(self) -> bool:
        """Whether tiles wait for the worker process."""
        return self._drawing is not None

    def show(self, cells: "NDArray[np.int8]", resolution: float, origin: Pose) -> None:
        """Show a whole grid.

        Args:
            cells: Array of shape (height, width), the lowest row first. It is read
                while the tiles are drawn.
            resolution: The side of a cell, in metres.
            origin: The pose of the lower left corner of the first cell.
        """
        self._cells = cells
        self._lay(resolution, origin)
        height, width = cells.shape
        self._mark(self._places(0, 0, width, height))

    def change(
        self, cells: "NDArray[np.int8]", x: int, y: int, width: int, height: int
    ) -> None:
        """Show the changed cells of a rectangle of the grid.

        Args:
            cells: The whole grid, of the shape that was shown.
            x: The first column.
            y: The lowest row.
            width: In cells.
            height: In cells.
        """
        self._cells = cells
        # The tiles to the left and below draw these cells too.
        overlap = OVERLAP * self.coarse
        left, low = max(0, x - overlap), max(0, y - overlap)
        self._mark(self._places(left, low, x + width - left, y + height - low))

    def _lay(self, resolution: float, origin: Pose) -> None:
        """Find the tiles of the grid, and remove those of earlier grids."""
        assert self._cells is not None
        height, width = self._cells.shape
        self._side, first = max(width, height), None
        self.coarse = max(1, math.ceil(math.sqrt(width * height / MOST)))
        if width * height > ONE:
            self._side = SIDE * self.coarse
            # The pixels of a coarse grid begin at its own first cell.
            if self._lattice is not None and self.coarse == 1:
                first = self._lattice.cell_of(origin, resolution)
        if first is None:
            self._lattice, first = Lattice(origin, resolution), (0, 0)
        self._first = first
        wanted = set(self._places(0, 0, width, height))
        for place in self.tiles.keys() - wanted:
            self._hide(self.tiles.pop(place))
            self._undrawn.pop(place, None)
        for place in wanted - self.tiles.keys():
            self.tiles[place] = _Tile()

    def _places(self, x: int, y: int, width: int, height: int) -> Iterator[Place]:
        """Return the tiles that have a cell of a rectangle of the grid."""
        left, low, side = self._first[0] + x, self._first[1] + y, self._side
        for row in range(low // side, (low + height - 1) // side + 1):
            for column in range(left // side, (left + width - 1) // side + 1):
                yield column, row

    def _mark(self, places: Iterator[Place]) -> None:
        for place in places:
            self._undrawn.setdefault(place)
        if self._cells is not None and self._cells.size <= SMALL:
            while self._undrawn:
                drawing = self._next()
                if drawing is not None:
                    self._put(drawing, grid_png(drawing.cells, self.palette))
        elif self._drawing is None and self._undrawn:
            self._drawing = spawn(self._draw_on())

    def _next(self) -> _Drawing | None:
        """Read the cells of the next tile; None if they are already drawn there."""
        place = next(iter(self._undrawn))
        del self._undrawn[place]
        assert self._cells is not None
        assert self._lattice is not None
        height, width = self._cells.shape
        (column, row), (left, low) = place, self._first
        overlap = OVERLAP * self.coarse
        x, end_x = _span(column, self._side, left, width, overlap)
        y, end_y = _span(row, self._side, low, height, overlap)
        cells = downsample(self._cells[y:end_y, x:end_x], self.coarse, self.palette)
        tile = self.tiles[place]
        matrix = self._lattice.place(x + left, y + low, len(cells) * self.coarse)
        digest = hashlib.blake2b(repr(cells.shape).encode(), digest_size=16)
        digest.update(cells.data)
        taken = digest.digest(), matrix
        if tile.taken == taken:
            return None
        tile.taken = taken
        self._numbers += 1
        resolution = self._lattice.resolution * self.coarse
        return _Drawing(place, self._numbers, cells, matrix, resolution)

    async def _draw_on(self) -> None:
        """Let the worker process draw until all tiles are up to date."""
        try:
            async with worker_kept():
                while self._undrawn and not self._closed:
                    await self._draw_batch()
        finally:
            self._drawing = None

    async def _draw_batch(self) -> None:
        batch: list[_Drawing] = []
        while self._undrawn and len(batch) < BATCH and not self._closed:
            drawing = self._next()
            if drawing is not None:
                batch.append(drawing)
            await asyncio.sleep(0)
        if not batch:
            return
        try:
            pngs = await draw_in_worker([each.cells for each in batch], self.palette)
        except ProtocolError as error:
            for each in batch:
                tile = self.tiles.get(each.place)
                if tile is not None:
                    tile.taken = None
            if not self._closed:
                self._failed(str(error))
            return
        if self._closed:
            return
        self._failed(None)
        for drawing, png in zip(batch, pngs, strict=True):
            self._put(drawing, png)

    def _put(self, drawing: _Drawing, png: bytes) -> None:
        """Show a drawn tile, unless a newer drawing of it is already shown."""
        tile = self.tiles.get(drawing.place)
        if tile is None or drawing.number < tile.shown:
            return
        tile.shown = drawing.number
        if not png:
            self._hide(tile)
            return
        if tile.picture is None:
            with no_scope():
                tile.picture = Picture()
            self._group.append(tile.picture.element)
        height, width = (n * drawing.resolution for n in drawing.cells.shape)
        tile.picture.show(png, drawing.matrix, width, height, drawing.resolution)

    def _hide(self, tile: _Tile) -> None:
        picture, tile.picture = tile.picture, None
        if picture is not None:
            picture.clear()
            picture.element.remove()

    def _end(self) -> None:
        self._closed = True
        for tile in self.tiles.values():
            self._hide(tile)
        self.tiles.clear()
        self._undrawn.clear()


def downsample(
    cells: "NDArray[np.int8]", times: int, palette: str
) -> "NDArray[np.int8]":
    """Return a copy of cells with the greatest value of each square of cells.

    Args:
        cells: Array of shape (height, width).
        times: The side of a square, in cells; the squares at the end may be cut.
        palette: The name of a palette; of ``"raw"``, 255 is the greatest value, else
            100.
    """
    import numpy as np

    if times == 1:
        return cells.copy()
    given = cells.view(np.uint8) if palette == "raw" else cells
    rows = _greatest(given, times)
    return _greatest(rows.T, times).T.copy().view(np.int8)


def _greatest(cells: "NDArray[Any]", times: int) -> "NDArray[Any]":
    """Return the greatest of each ``times`` rows."""
    import numpy as np

    out = cells[::times].copy()
    for start in range(1, times):
        some = cells[start::times]
        np.maximum(out[: len(some)], some, out=out[: len(some)])
    return out


def _span(
    number: int, side: int, first: int, count: int, overlap: int
) -> tuple[int, int]:
    """Return the first cell of a tile in its grid, and the cell after its last.

    Args:
        number: The tile's column or row.
        side: The side of a tile.
        first: The cell of the lattice at the grid's first cell.
        count: The number of cells of the grid.
        overlap: The further cells at the end of a tile.
    """
    start = max(0, number * side - first)
    return start, min(count, (number + 1) * side - first + overlap)
