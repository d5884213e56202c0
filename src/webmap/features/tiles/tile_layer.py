"""Map tiles from this machine's disk, below everything else."""

import asyncio
import math
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from webmap.base.errors import ConfigError
from webmap.base.geometry import LocalPlane
from webmap.base.scope import Removal, keep
from webmap.base.tasks import spawn
from webmap.core.pictures import pictures
from webmap.core.registry import map_modules
from webmap.features.tiles.tile_grid import OVERLAP, Tile, TileGrid
from webmap.features.tiles.tile_source import open_tiles
from webmap.scene import svg
from webmap.scene.element import Element
from webmap.scene.node import Fragment

if TYPE_CHECKING:
    from webmap.core.map import Map

ORDER = -1.0
"""Below the images of the map."""

PAUSE = 0.1
"""Least time between two updates of the needed tiles, in seconds."""

MOST = 256
"""Upper limit of the option ``most``."""


class _Shown(NamedTuple):
    element: Element
    url: str


@map_modules.register
class TileLayer:
    """Draws satellite or street tiles from a folder or an MBTiles file.

    The level follows the zoom, and only visible tiles are loaded. A missing tile leaves
    its place empty. With the same datum ``NavSatFix`` uses the same projection.

    Style it by CSS: ``.tiles`` and ``.webmap-attribution``.

    Args:
        map: The map.
        source: A folder with ``z/x/y.png``, or an MBTiles file; never another host.
        datum: Latitude and longitude of the map's origin, in degrees.
        east: Rotation of the map's x from east, in degrees, counter-clockwise from
            above: 90 if x points north.
        attribution: The owner of the tiles, which most licences require to be shown; by
            default the attribution of the file.
        tile_size: The side of a tile in pixels, 256 or 512.
        most: Greatest number of tiles that are loaded at once for a page.
        opacity: From 0 to 1.

    Raises:
        ConfigError: If there are no such tiles, or the datum is outside its ranges.
    """

    def __init__(
        self,
        map: "Map",
        source: str | Path,
        datum: tuple[float, float],
        *,
        east: float = 0.0,
        attribution: str | None = None,
        tile_size: int = 256,
        most: int = 64,
        opacity: float = 1.0,
    ) -> None:
        if len(datum) != 2:
            raise ConfigError(
                f"datum is a latitude and a longitude in degrees, got {datum!r}"
            )
        if tile_size not in (256, 512):
            raise ConfigError(f"tile_size is 256 or 512, got {tile_size!r}")
        if not 1 <= most <= MOST:
            raise ConfigError(f"most is a number of tiles up to {MOST}, got {most!r}")
        if not (0 <= opacity <= 1):
            raise ConfigError(f"opacity is from 0 to 1, got {opacity!r}")
        plane = LocalPlane(*datum, east)
        self.map = map
        self.source = open_tiles(source)
        self.grid = TileGrid(plane, self.source.zooms, size=tile_size, most=most)
        self.shown: dict[Tile, _Shown | None] = {}
        """The tiles on the map; None for a missing tile."""
        self.svg: Element = svg.g(class_="tiles", pointer_events="none")
        self.svg.set(opacity=None if math.isclose(opacity, 1) else opacity)
        self._fragment = Fragment(self.svg)
        self._is_reported = False
        self._closed = False
        self._dirty = False
        self._looking: asyncio.Task[None] | None = None
        map.mount(self._fragment, order=ORDER)
        keep(Removal(self._end))
        words = self.source.attribution if attribution is None else attribution
        self.browser_part = map.add_browser_part(
            self,
            "features/tiles/tile_layer.js",
            {"attribution": words},
            "features/tiles/tile_layer.css",
        )
        self.on_view()

    def on_view(self) -> None:
        """Update the tiles that the view needs."""
        self._dirty = True
        if self._looking is None and not self._closed:
            self._looking = spawn(self._look_on())

    def _end(self) -> None:
        self._closed = True
        for tile in list(self.shown):
            self._drop(tile)
        self.map.unmount(self._fragment)
        close = getattr(self.source, "close", None)
        if close is not None:
            # In a thread, because closing waits for a read in progress.
            asyncio.get_running_loop().run_in_executor(None, close)

    async def _look_on(self) -> None:
        try:
            while self._dirty and not self._closed:
                self._dirty = False
                await self._look()
                await asyncio.sleep(PAUSE)
        finally:
            self._looking = None

    async def _look(self) -> None:
        map = self.map
        wanted = self.grid.wanted(map.world.tf, map.canvas_width, map.canvas_height)
        for tile in wanted:
            if self._dirty or self._closed:  # the view has changed
                return
            if tile not in self.shown:
                self._make_room(wanted)
                await self._load(tile)
        # Only now, so that no gap is visible while the level changes.
        for tile in self.shown.keys() - set(wanted):
            self._drop(tile)

    def _make_room(self, wanted: list[Tile]) -> None:
        """Remove tiles, so that the next tile does not exceed the greatest number."""
        spare = (tile for tile in list(self.shown) if tile not in wanted)
        while len(self.shown) >= self.grid.most:
            self._drop(next(spare))

    async def _load(self, tile: Tile) -> None:
        try:
            found = await asyncio.to_thread(self.source.read, tile)
        except (ConfigError, OSError, MemoryError) as error:
            found = None
            if not self._closed:
                self._complain(str(error))
        if self._closed:
            return
        if found is None:
            self.shown[tile] = None
            return
        url = pictures.publish(*found)
        image = svg.image(preserveAspectRatio="none", class_="tile", href=url)
        image.set(width=1 + OVERLAP, height=1 + OVERLAP)
        image.set("data-tile", f"{tile.z}/{tile.x}/{tile.y}")
        image.set_matrix(self.grid.place(tile))
        self.svg.append(image)
        self.shown[tile] = _Shown(image, url)

    def _drop(self, tile: Tile) -> None:
        shown = self.shown.pop(tile)
        if shown is not None:
            shown.element.remove()
            pictures.retire(shown.url)

    def _complain(self, text: str) -> None:
        if not self._is_reported:
            self._is_reported = True
            self.map.report_error(f"a tile is not shown: {text}")
