"""Floor plans: an image with a YAML file in the format of ROS's map_server.

The image is drawn in the console's own colours, once for the light and once for the
dark theme, so that a page can switch without a request.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from webmap.base import geometry
from webmap.base.map_file import MapImage, read_map

if TYPE_CHECKING:
    from PIL.Image import Image

# Wall, unknown, free; unknown is --map-void and free is --map-floor in tokens.css.
COLOURS = {
    "day": ("#3a4654", "#dfe4ea", "#ffffff"),
    "night": ("#8fa0b3", "#0b0f14", "#1b222b"),
}


@dataclass(frozen=True, slots=True)
class Floor:
    """A floor plan with its position in the world."""

    day: Path
    night: Path
    x: float
    """Left edge of the image before the rotation, in metres."""
    y: float
    """Lower edge of the image before the rotation, in metres."""
    width: float
    """Width in metres."""
    height: float
    """Height in metres."""
    yaw: float
    """Rotation about the lower left corner, in radians."""
    bounds: tuple[float, float, float, float]
    """The known part: left, bottom, width and height in metres."""
    plan: MapImage
    """The map that the images show."""

    @property
    def matrix(self) -> geometry.Affine:
        """The transform from the image, whose y points down, to the world."""
        upright = geometry.Affine(1, 0, 0, -1, 0, 2 * self.y + self.height)
        return geometry.Affine.rotation(self.yaw, self.x, self.y) @ upright


def load_floor(file: Path, folder: Path) -> Floor:
    """Read a floor plan and draw it in the console's colours.

    Walls, free and unknown cells follow the rules of map_server: the thresholds, the
    mode and ``negate``.

    Args:
        file: The YAML file of a map, in the format of map_server.
        folder: The folder for the drawn images.

    Raises:
        ConfigError: If the file or its image cannot be read or is not valid.
    """
    plan = read_map(file)
    images = {}
    for name, (wall, unknown, free) in COLOURS.items():
        images[name] = folder / f"{name}.png"
        paint(plan, wall, unknown, free).save(images[name], optimize=True)
    height, width = (cells * plan.resolution for cells in plan.cells.shape)
    x, y, yaw = plan.origin.x, plan.origin.y, plan.origin.yaw
    bounds = known_part(plan)
    day, night = images["day"], images["night"]
    return Floor(day, night, x, y, width, height, yaw, bounds, plan)


def paint(plan: MapImage, wall: str, unknown: str, free: str) -> "Image":
    """Return a map as an image with exactly one colour for each cell value."""
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
    """Return the rectangle of the world that contains all known cells.

    Returns:
        Left, bottom, width and height in metres; of the whole image if the map is
        rotated or has no known cell.
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
