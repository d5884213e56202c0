"""Grids of cells as pictures: the colours of cells and the position of the picture."""

import io
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, TypeAlias

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.geometry import Affine, Pose
from webmap.ros.offload import aside

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

Palette: TypeAlias = Literal["map", "costmap", "raw"]
"""The names of :data:`PALETTES`."""


def check_palette(palette: str) -> None:
    """Check the name of a palette.

    Raises:
        ConfigError: If there is no palette of that name.
    """
    if palette not in PALETTES:
        known = ", ".join(PALETTES)
        raise ConfigError(f"a palette is one of {known}, got {palette!r}")


def place_grid(origin: Pose, height: float) -> Affine:
    """Return the transform of a grid's picture, for ``Picture.show``.

    Args:
        origin: The pose of the lower left corner of the grid's first cell.
        height: Height of the whole grid, in metres.
    """
    cos, sin = math.cos(origin.yaw), math.sin(origin.yaw)
    placed = Affine(cos, sin, -sin, cos, origin.x, origin.y)
    return placed @ Affine(1, 0, 0, -1, 0, height)


async def draw_in_worker(
    pieces: "Sequence[NDArray[np.int8]]", palette: str
) -> list[bytes]:
    """Return pieces of a large grid as PNGs, drawn by the worker process.

    Args:
        pieces: Arrays like that of :func:`grid_png`.
        palette: The name of one of :data:`PALETTES`.

    Raises:
        ProtocolError: If the worker fails.
    """
    data = b"".join(piece.tobytes() for piece in pieces)
    shapes = [piece.shape for piece in pieces]
    drawn = await aside(pngs_of_bytes, data, shapes, palette)
    return msgspec.msgpack.decode(drawn, type=list[bytes])


def pngs_of_bytes(data: bytes, shapes: list[list[int]], palette: str) -> bytes:
    """Return the PNGs of pieces of a grid as a list in MessagePack.

    Args:
        data: The rows of all pieces, one after the other.
        shapes: Height and width of each piece, in cells.
        palette: The name of one of :data:`PALETTES`.
    """
    import numpy as np

    cells, at, drawn = np.frombuffer(data, np.int8), 0, []
    for height, width in shapes:
        piece = cells[at : at + height * width].reshape(height, width)
        drawn.append(grid_png(piece, palette))
        at += height * width
    return msgspec.msgpack.encode(drawn)


def grid_png(cells: "NDArray[np.int8]", palette: str) -> bytes:
    """Return a grid as a PNG of one pixel per cell, its highest row at the top.

    It is empty if no cell of the grid can be seen.

    Args:
        cells: Array of shape (height, width), the lowest row first.
        palette: The name of one of :data:`PALETTES`.
    """
    import numpy as np
    from PIL import Image

    height, width = cells.shape
    pixels = np.ascontiguousarray(cells[::-1]).view(np.uint8)
    colours = PALETTES[palette]
    seen = np.array([colour[3] > 0 for colour in colours])
    if not seen[pixels].any():
        return b""
    image = Image.frombytes("P", (width, height), pixels.tobytes())
    image.putpalette([part for colour in colours for part in colour[:3]])
    out = io.BytesIO()
    alpha = bytes(colour[3] for colour in colours)
    image.save(out, "PNG", transparency=alpha, compress_level=1)
    return out.getvalue()


Colour = tuple[int, int, int, int]

CLEAR: Colour = (0, 0, 0, 0)

COST = (79, 70, 229)
"""The hue of a costmap: one, so that neither robots nor scans are mistaken for it."""


def _other_colour(value: int) -> Colour:
    """Return the colour of a cell that is neither a cost nor a probability."""
    if value == 255:
        return CLEAR
    if value <= 127:
        return (0, 255, 0, 255)
    return (255, 255 * (value - 128) // 126, 0, 255)


def _map_colour(value: int) -> Colour:
    if value > 100:
        return _other_colour(value)
    grey = 255 - 255 * value // 100
    return (grey, grey, grey, 255)


def _costmap_colour(value: int) -> Colour:
    if value == 0:
        return CLEAR
    if value > 100:
        return _other_colour(value)
    inscribed = {99: 190, 100: 255}
    return (*COST, inscribed.get(value, 30 + 110 * value // 98))


# Indexed by the value of a cell as a byte: -1, which is unknown, is 255.
PALETTES: dict[str, list[Colour]] = {
    "map": [_map_colour(value) for value in range(256)],
    "costmap": [_costmap_colour(value) for value in range(256)],
    "raw": [(255 - value, 255 - value, 255 - value, 255) for value in range(256)],
}
"""The colours of each palette; those of RViz for a map and for raw values.

A cell above 100 is green, and one below -1 is red to yellow: these values mean nothing.
"""
