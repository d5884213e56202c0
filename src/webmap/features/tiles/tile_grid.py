"""The tiles that a view needs, and their positions on the map.

Tiles are numbered as in web maps: z, x from west, y from north, in the spherical
Mercator projection.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from webmap.base.geometry import PLANE_RADIUS, Affine, LocalPlane

MAX_ZOOM = 24
WORLD = 40_075_016.686
"""Length of the equator, in metres."""

OVERLAP = 1 / 512
"""Enlargement of a drawn tile, so that there is no visible seam between tiles."""


class Tile(NamedTuple):
    """The number of a tile."""

    z: int
    x: int
    y: int


class TileGrid:
    """Tiles on the plane of a map.

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

    def wanted(self, view: Affine, width: float, height: float) -> list[Tile]:
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
