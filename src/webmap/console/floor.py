"""Floor plans: an image with the YAML beside it that ROS's map_server reads.

The image is drawn anew in the console's own colours, once for the day and once for
the night, since a page can show either without asking.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from webmap.base import geometry
from webmap.base.map_file import MapImage, read_map

if TYPE_CHECKING:
    from PIL.Image import Image

# Wall, unknown and free; unknown is --map-void and free --map-floor of tokens.css.
COLOURS = {
    "day": ("#3a4654", "#dfe4ea", "#ffffff"),
    "night": ("#8fa0b3", "#0b0f14", "#1b222b"),
}


@dataclass(frozen=True, slots=True)
class Floor:
    """A floor plan, ready to be placed in the world."""

    day: Path
    night: Path
    x: float
    """The image's left edge before it is turned, in metres."""
    y: float
    """The image's lower edge before it is turned, in metres."""
    width: float
    """In metres."""
    height: float
    """In metres."""
    yaw: float
    """How far it is turned about its lower left corner, in radians."""
    bounds: tuple[float, float, float, float]
    """What is known of it: left, bottom, width and height in metres."""

    @property
    def matrix(self) -> geometry.Affine:
        """What carries the image, which has y downward, to its place in the world."""
        upright = geometry.Affine(1, 0, 0, -1, 0, 2 * self.y + self.height)
        return geometry.Affine.rotation(self.yaw, self.x, self.y) @ upright


def load_floor(file: Path, folder: Path) -> Floor:
    """Read a floor plan and draw it in the console's colours.

    Walls, free floor and what nobody knows are what map_server makes of the image: by
    the thresholds, the mode and ``negate``.

    Args:
        file: The YAML file of a map, as map_server takes it.
        folder: Where the drawn images go.

    Raises:
        ConfigError: If the file or its image cannot be read or makes no sense.

    """
    plan = read_map(file)
    images = {}
    for name, (wall, unknown, free) in COLOURS.items():
        images[name] = folder / f"{name}.png"
        paint(plan, wall, unknown, free).save(images[name], optimize=True)
    height, width = (cells * plan.resolution for cells in plan.cells.shape)
    x, y, yaw = plan.origin.x, plan.origin.y, plan.origin.yaw
    bounds = known_part(plan)
    return Floor(images["day"], images["night"], x, y, width, height, yaw, bounds)


def paint(plan: MapImage, wall: str, unknown: str, free: str) -> "Image":
    """Return a map as an image: exactly one colour for each value of a cell."""
    from PIL import Image, ImageColor, ImageOps

    ramp = Image.frombytes("L", (101, 1), bytes(range(101)))
    colours = ImageOps.colorize(ramp, free, wall, blackpoint=0, whitepoint=100)
    palette = bytearray(256 * 3)
    palette[: 101 * 3] = colours.tobytes()
    palette[255 * 3 :] = bytes(ImageColor.getrgb(unknown))  # -1 as a byte
    height, width = plan.cells.shape
    painted = Image.frombytes("P", (width, height), plan.cells[::-1].tobytes())
    painted.putpalette(bytes(palette))
    return painted


def known_part(plan: MapImage) -> tuple[float, float, float, float]:
    """Return the rectangle of the world in which the map knows anything.

    Returns:
        Left, bottom, width and height in metres, of the whole image if it is turned
        or knows nothing.

    """
    rows, columns = plan.cells.shape
    at = plan.origin
    known = plan.cells != -1
    ups, sides = known.any(axis=1).nonzero()[0], known.any(axis=0).nonzero()[0]
    box = (0, 0, columns, rows)
    if len(ups) and not at.yaw:
        box = (int(sides[0]), int(ups[0]), int(sides[-1]) + 1, int(ups[-1]) + 1)
    left, bottom, right, top = (cells * plan.resolution for cells in box)
    corners = [
        geometry.Affine.rotation(at.yaw, at.x, at.y).apply(at.x + u, at.y + v)
        for u in (left, right)
        for v in (bottom, top)
    ]
    xs, ys = zip(*corners, strict=True)
    return (min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys))
