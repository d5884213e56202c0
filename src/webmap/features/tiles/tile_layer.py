"""Map tiles from this machine's disk, below everything else."""

import asyncio
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from webmap.base.errors import ConfigError
from webmap.base.geometry import Affine
from webmap.base.local_plane import PLANE_RADIUS, LocalPlane
from webmap.base.scope import Removal, keep
from webmap.base.tasks import spawn
from webmap.config.fleet import TilesConfig
from webmap.config.reading import read_key
from webmap.core.map import Map
from webmap.core.pictures import pictures
from webmap.core.registry import map_modules
from webmap.features.tiles.tile_source import Tile, open_tiles
from webmap.scene import svg
from webmap.scene.element import Element
from webmap.scene.node import Fragment

ORDER = -1.0
"""Below the images of the map."""

PAUSE = 0.1
"""Least time between two updates of the needed tiles, in seconds."""

WORLD = 40_075_016.686
"""Length of the equator, in metres."""

OVERLAP = 1 / 512
"""Enlargement of a drawn tile, so that there is no visible seam between tiles."""


class _DrawnTile(NamedTuple):
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
        map: Map,
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
        options = {"tile_size": tile_size, "most": most, "opacity": opacity}
        for key, value in options.items():
            read_key(TilesConfig, key, value, "the tiles")
        plane = LocalPlane(*datum, east)
        self.map = map
        self.source = open_tiles(source)
        self.grid = TileGrid(plane, self.source.zooms, size=tile_size, most=most)
        self.shown: dict[Tile, _DrawnTile | None] = {}
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
        wanted = self.grid.tiles_in_view(
            map.world.tf, map.canvas_width, map.canvas_height
        )
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
        self.shown[tile] = _DrawnTile(image, url)

    def _drop(self, tile: Tile) -> None:
        shown = self.shown.pop(tile)
        if shown is not None:
            shown.element.remove()
            pictures.retire(shown.url)

    def _complain(self, text: str) -> None:
        if not self._is_reported:
            self._is_reported = True
            self.map.report_error(f"a tile is not shown: {text}")


class TileGrid:
    """The tiles that a view needs, and their positions on the plane of a map.

    Tiles are numbered as in web maps: z, x from west, y from north, in the spherical
    Mercator projection.

    Args:
        plane: The plane.
        zooms: The available levels, ascending.
        size: The side of a tile, in pixels.
        most: Greatest number of tiles that are shown at once.
    """

    def __init__(
        self, plane: LocalPlane, zooms: Sequence[int], *, size: int, most: int
    ) -> None:
        self.plane = plane
        self.zooms = sorted(zooms)
        self.size = size
        self.most = most

    def tiles_in_view(self, view: Affine, width: float, height: float) -> list[Tile]:
        """Return the tiles in a view, the middle of the view first.

        The level is the one whose pixels are nearest to the screen's in size, or a
        coarser one if that would be too many tiles.

        Args:
            view: The transform from the map, in metres, to pixels.
            width: Width of the canvas, in pixels.
            height: Height of the canvas, in pixels.
        """
        if width <= 0 or height <= 0 or not self.zooms:
            return []
        level = self._level(math.sqrt(abs(view.determinant)))
        tiles = self._at(level, view, width, height)
        while tiles is None or len(tiles) > self.most:
            at = self.zooms.index(level)
            if at == 0:
                break
            level = self.zooms[at - 1]
            tiles = self._at(level, view, width, height)
        if tiles is None:
            reach = math.ceil(math.sqrt(self.most))
            tiles = self._at(level, view, width, height, reach=reach) or []
        middle = width / 2, height / 2
        tiles.sort(key=lambda tile: math.dist(self._on_screen(tile, view), middle))
        return tiles[: self.most]

    def place(self, tile: Tile) -> Affine:
        """Return a tile's transform to the map, from x right and y down, 0 to 1."""
        west, north = self._corner(tile.z, tile.x, tile.y)
        east = self._corner(tile.z, tile.x + 1, tile.y)
        south = self._corner(tile.z, tile.x, tile.y + 1)
        last = self._corner(tile.z, tile.x + 1, tile.y + 1)
        # The fourth corner is off by far less than a pixel; the error is shared.
        spare = [
            (last[i] - east[i] - south[i] + (west, north)[i]) / 4 for i in range(2)
        ]
        return Affine(
            east[0] - west + spare[0],
            east[1] - north + spare[1],
            south[0] - west + spare[0],
            south[1] - north + spare[1],
            west - spare[0] / 2,
            north - spare[1] / 2,
        )

    def _level(self, scale: float) -> int:
        """Return the level for a scale in pixels per metre."""
        round_here = WORLD * math.cos(math.radians(self.plane.latitude))
        exact = math.log2(max(scale * round_here / self.size, 1e-9))
        return min(self.zooms, key=lambda zoom: (abs(zoom - exact), zoom))

    def _at(
        self,
        z: int,
        view: Affine,
        width: float,
        height: float,
        *,
        reach: int | None = None,
    ) -> list[Tile] | None:
        """Return the visible tiles of a level; None if they are far too many.

        With ``reach`` only the tiles within this number from the middle tile are
        considered.
        """
        inverse = view.inverse
        numbers = [
            self._number(z, *inverse.apply(width * i / 8, height * j / 8))
            for i in range(9)
            for j in range(9)
            if i in (0, 8) or j in (0, 8)
        ]
        x, y = self._number(z, *inverse.apply(width / 2, height / 2))
        west, east = _span([column for column, _ in numbers], 2**z)
        first, last = (int(fn(row for _, row in numbers)) for fn in (min, max))
        if reach is not None:
            west, east = max(west, int(x) - reach), min(east, int(x) + reach)
            first, last = max(first, int(y) - reach), min(last, int(y) + reach)
        elif (east - west + 1) * (last - first + 1) > 8 * self.most:
            return None
        return [
            tile
            for row in range(first, last + 1)
            for column in range(west, east + 1)
            if self._is_seen(tile := Tile(z, column % 2**z, row), view, width, height)
        ]

    def _number(self, z: int, x: float, y: float) -> tuple[float, float]:
        """Return a point of the plane in tiles of a level, from north-west."""
        away = math.hypot(x, y)
        if away > PLANE_RADIUS:  # the area beyond is not drawn
            x, y = x * PLANE_RADIUS / away, y * PLANE_RADIUS / away
        latitude, longitude = self.plane.to_globe(x, y)
        lat = math.radians(max(-85.0511, min(85.0511, latitude)))
        row = (1 - math.asinh(math.tan(lat)) / math.pi) / 2 * 2**z
        # Longitudes continue over the date line, like those of the plane.
        return (longitude + 180) / 360 * 2**z, min(max(row, 0.0), 2**z - 1e-6)

    def _is_seen(self, tile: Tile, view: Affine, width: float, height: float) -> bool:
        onto = view @ self.place(tile)
        corners = [onto.apply(u, v) for u in (0, 1) for v in (0, 1)]
        across, down = zip(*corners, strict=True)
        beside = max(across) <= 0 or min(across) >= width
        return not (beside or max(down) <= 0 or min(down) >= height)

    def _on_screen(self, tile: Tile, view: Affine) -> tuple[float, float]:
        return (view @ self.place(tile)).apply(0.5, 0.5)

    def _corner(self, z: int, x: float, y: float) -> tuple[float, float]:
        longitude = x / 2**z * 360 - 180
        latitude = math.degrees(math.atan(math.sinh(math.pi * (1 - 2 * y / 2**z))))
        return self.plane.from_globe(latitude, longitude)


def _span(numbers: Sequence[float], around: int) -> tuple[int, int]:
    """Return the first and last column; longitudes continue over the date line."""
    return math.floor(min(numbers)), min(
        math.floor(max(numbers)), math.floor(min(numbers)) + around - 1
    )
