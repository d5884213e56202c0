"""Grids of cells as pictures: the colours of cells and the position of the picture."""

import io
import math
from typing import TYPE_CHECKING, Literal, TypeAlias

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


async def draw_aside(cells: "NDArray[np.int8]", palette: str) -> bytes:
    """Return a large grid as a PNG, drawn by the worker process.

    Args:
        cells: Array of shape (height, width), the lowest row first.
        palette: The name of one of :data:`PALETTES`.

    Raises:
        ProtocolError: If the worker fails.
    """
    import numpy as np

    data = np.ascontiguousarray(cells).data.cast("B")
    return bytes(await aside(png_of_bytes, data, cells.shape[1], palette))


def png_of_bytes(data: bytes, width: int, palette: str) -> bytes:
    """Return a grid, given as the bytes of its rows, as a PNG like :func:`grid_png`."""
    import numpy as np

    return grid_png(np.frombuffer(data, np.int8).reshape(-1, width), palette)


def grid_png(cells: "NDArray[np.int8]", palette: str) -> bytes:
    """Return a grid as a PNG of one pixel per cell, its highest row at the top.

    Args:
        cells: Array of shape (height, width), the lowest row first.
        palette: The name of one of :data:`PALETTES`.
    """
    import numpy as np
    from PIL import Image

    height, width = cells.shape
    pixels = np.ascontiguousarray(cells[::-1]).view(np.uint8)
    image = Image.frombytes("P", (width, height), pixels.tobytes())
    colours = PALETTES[palette]
    image.putpalette([part for colour in colours for part in colour[:3]])
    out = io.BytesIO()
    alpha = bytes(colour[3] for colour in colours)
    image.save(out, "PNG", transparency=alpha, compress_level=1)
    return out.getvalue()


Colour = tuple[int, int, int, int]

CLEAR: Colour = (0, 0, 0, 0)


def _map_colour(value: int) -> Colour:
    if value > 100:
        return CLEAR
    grey = 255 - 255 * value // 100
    return (grey, grey, grey, 255)


def _costmap_colour(value: int) -> Colour:
    if value == 0 or value > 100:
        return CLEAR
    if value == 100:
        return (255, 0, 255, 255)
    if value == 99:
        return (0, 255, 255, 255)
    red = 255 * value // 98
    return (red, 0, 255 - red, 255)


# Indexed by the value of a cell as a byte: -1, which is unknown, is 255.
PALETTES: dict[str, list[Colour]] = {
    "map": [_map_colour(value) for value in range(256)],
    "costmap": [_costmap_colour(value) for value in range(256)],
    "raw": [(255 - value, 255 - value, 255 - value, 255) for value in range(256)],
}
"""The colours of each palette; those of RViz where RViz has the palette."""
