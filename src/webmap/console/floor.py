"""Floor plans: an image with the YAML beside it that ROS's map_server reads.

The image is drawn anew in the console's own colours, once for the day and once for
the night, since a page can show either without asking.
"""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

from webmap import geometry
from webmap.errors import ConfigError
from webmap.lined_yaml import LinedYaml

if TYPE_CHECKING:
    from PIL.Image import Image

MAX_YAML = 1 << 14
"""Bytes of the YAML; a map's own has 200. Reading takes longer than in proportion where
mappings are merged into one another."""

MAX_PIXELS = 1 << 26

UNKNOWN = 205
"""The grey level by which map_saver says that nobody knows."""

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


class FloorFile(msgspec.Struct):
    """The keys of the YAML that matter for drawing."""

    image: str
    resolution: float
    origin: tuple[float, float, float]
    negate: bool = False


def load_floor(file: Path, folder: Path) -> Floor:
    """Read a floor plan and draw it in the console's colours.

    Args:
        file: The YAML file of a map, as map_server takes it.
        folder: Where the drawn images go.

    Raises:
        ConfigError: If the file or its image cannot be read or makes no sense.

    """
    from PIL import ImageOps

    _check_size(file)
    said = LinedYaml(file)
    plan = read_plan(said)
    grey = read_image(_image_file(said, plan.image))
    if plan.negate:
        grey = ImageOps.invert(grey)
    images = {}
    for name, (wall, unknown, free) in COLOURS.items():
        images[name] = folder / f"{name}.png"
        paint(grey, wall, unknown, free).save(images[name], optimize=True)
    x, y, yaw = plan.origin
    width, height = (pixels * plan.resolution for pixels in grey.size)
    bounds = known_part(grey, plan)
    return Floor(images["day"], images["night"], x, y, width, height, yaw, bounds)


def _check_size(file: Path) -> None:
    """Refuse a YAML file that is no map's before it is taken apart.

    Raises:
        ConfigError: If it is too large.

    """
    try:
        size = file.stat().st_size
    except OSError:
        return  # whoever reads it says so
    if size > MAX_YAML:
        raise ConfigError(
            f"floor {file}: {size} bytes are no map's YAML, which has {MAX_YAML} at "
            "the most; name the .yaml beside the image"
        )


def read_plan(said: LinedYaml) -> FloorFile:
    """Return what the YAML file of a map says.

    Raises:
        ConfigError: If it makes no sense; file and line are named.

    """
    try:
        plan = msgspec.convert(_plain(said.data), FloorFile)
    except msgspec.ValidationError as error:
        # It ends with the way, as in "at `$.origin[1]`".
        found = re.search(r"`\$\.(\w+)", str(error))
        raise said.wrong((found[1],) if found else (), f"floor: {error}") from None
    if not (math.isfinite(plan.resolution) and plan.resolution > 0):
        words = f"resolution must be metres above 0, got {plan.resolution}"
        raise said.wrong(("resolution",), f"floor: {words}")
    if not all(map(math.isfinite, plan.origin)):
        words = f"origin must be three finite numbers, got {list(plan.origin)}"
        raise said.wrong(("origin",), f"floor: {words}")
    return plan


def read_image(file: Path) -> "Image":
    """Read the image of a map, in grey.

    Raises:
        ConfigError: If it is no image, or too large.

    """
    from PIL import Image

    try:
        with Image.open(file) as image:
            if image.width * image.height > MAX_PIXELS:
                raise ConfigError(
                    f"floor image {file}: {image.width} x {image.height} pixels are "
                    f"too many; {MAX_PIXELS} in all are the limit"
                )
            if "A" not in image.getbands() and "transparency" not in image.info:
                return image.convert("L")
            clear = Image.new("LA", image.size, (UNKNOWN, 255))
            return Image.alpha_composite(
                clear.convert("RGBA"), image.convert("RGBA")
            ).convert("L")
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        if isinstance(error, ConfigError):
            raise
        raise ConfigError(f"floor image {file}: {error}") from error


def paint(grey: "Image", wall: str, unknown: str, free: str) -> "Image":
    """Return a grey image in other colours, exactly one for each grey level."""
    from PIL import Image, ImageOps

    ramp = Image.frombytes("L", (256, 1), bytes(range(256)))
    colours = ImageOps.colorize(ramp, wall, free, unknown, 0, 254, UNKNOWN)
    painted = Image.frombytes("P", grey.size, grey.tobytes())
    painted.putpalette(colours.tobytes())
    return painted


def known_part(grey: "Image", plan: FloorFile) -> tuple[float, float, float, float]:
    """Return the rectangle of the world in which the map knows anything.

    Returns:
        Left, bottom, width and height in metres, of the whole image if it is turned
        or knows nothing.

    """
    box = grey.point([0 if level == UNKNOWN else 255 for level in range(256)]).getbbox()
    x, y, yaw = plan.origin
    if box is None or yaw:
        box = (0, 0, *grey.size)
    left, top, right, bottom = (pixels * plan.resolution for pixels in box)
    height = grey.height * plan.resolution
    corners = [
        geometry.Affine.rotation(yaw, x, y).apply(x + u, y + height - v)
        for u in (left, right)
        for v in (top, bottom)
    ]
    xs, ys = zip(*corners, strict=True)
    return (min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys))


def _plain(data: Any) -> Any:
    """Take the numbers 0 and 1 for ``negate``, as map_saver writes it."""
    if isinstance(data, dict) and data.get("negate") in (0, 1):
        return {**data, "negate": bool(data["negate"])}
    return data


def _image_file(said: LinedYaml, name: str) -> Path:
    if "\0" in name:
        raise said.wrong(("image",), "floor: image must be the name of a file")
    folder = said.file.resolve().parent
    image = (folder / name).resolve()
    if Path(name).is_absolute() or not image.is_relative_to(folder):
        words = f"the image {name!r} is not in the folder of the YAML file"
        advice = "put it there and write its bare name"
        raise said.wrong(("image",), f"floor: {words}; {advice}")
    if not image.is_file():
        raise said.wrong(("image",), f"floor: there is no image file {image}")
    return image
