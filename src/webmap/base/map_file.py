"""Maps from disk, in the format of ROS's map_server: a YAML file and an image."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from webmap.base.errors import ConfigError
from webmap.base.geometry import FARTHEST, Affine, Pose
from webmap.base.lined_yaml import LinedYaml
from webmap.base.plain_files import resolved

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from PIL import Image

MAX_YAML = 1 << 14
"""Most bytes of the YAML file; map_server writes 200, and long files read slowly."""

MAX_PIXELS = 1 << 26

MAX_DECODED = 128 << 20
"""Most bytes of the decoded image; it is decoded as a whole."""

PIECE = 1024
"""Side of the squares that are converted at a time, with about 20 bytes per pixel."""

_PIXEL = {"1": 1, "L": 1, "P": 1, "I;16": 2, "I;16B": 2, "I;16L": 2}
"""Bytes of a decoded pixel, by the mode of the image; 4 in other modes."""

FINEST = 1e-4
"""The least side of a cell, in metres; a smaller number has another unit."""

FORMATS = ("PPM", "PNG", "BMP", "JPEG")
"""The formats that map_server reads, by magic bytes; PPM includes PGM."""

MAGIC = (b"P", b"\x89PNG", b"BM", b"\xff\xd8")
"""The first bytes of files of these formats."""

MODES = ("trinary", "scale", "raw")
TRUTH = {"0": False, "0.0": False, "1": True, "1.0": True}
TRUTH |= {"false": False, "true": True}


@dataclass(frozen=True, slots=True, eq=False)
class MapImage:
    """A map with the fields of ``nav_msgs/OccupancyGrid``."""

    cells: "NDArray[np.int8]"
    """Of shape (height, width), the lowest row first: 0 to 100, or -1 unknown."""

    resolution: float
    """The side of a cell, in metres."""

    origin: Pose
    """The pose of the lower left corner of the first cell."""

    image: Path
    """The image file of the map."""


def cell_at(
    cells: "NDArray[np.int8]", resolution: float, origin: Pose, x: float, y: float
) -> int:
    """Return the value of the cell at a place of the map's frame; -1 outside of it.

    Args:
        cells: Of shape (height, width), the lowest row first.
        resolution: The side of a cell, in metres.
        origin: The pose of the lower left corner of the first cell.
        x: Metres along x.
        y: Metres along y.
    """
    u, v = Affine.into_pose(origin).apply(x, y)
    column, row = math.floor(u / resolution), math.floor(v / resolution)
    height, width = cells.shape
    inside = 0 <= column < width and 0 <= row < height
    return int(cells[row, column]) if inside else -1


@dataclass(frozen=True, slots=True)
class _Settings:
    image: Path
    resolution: float
    origin: Pose
    negate: bool
    occupied: float
    free: float
    mode: str


def read_map(file: Path) -> MapImage:
    """Read a map.

    Args:
        file: The YAML file; its image is in the same folder or below.

    Raises:
        ConfigError: If a file cannot be read or is invalid; the error message names the
            file, the wrong value and the expected one.

    """
    settings = _settings(file)
    # An image has its first row at the top, a grid at the bottom.
    cells = _read_image(file, settings)[::-1]
    side = max(cells.shape) * settings.resolution
    if side > FARTHEST:
        raise ConfigError(
            f"{file}: got a side of {side:g} m ({max(cells.shape)} cells of "
            f"{settings.resolution:g} m), expected at most {FARTHEST:g} m"
        )
    return MapImage(cells, settings.resolution, settings.origin, settings.image)


def _settings(file: Path) -> _Settings:
    size = file.stat().st_size if file.is_file() else 0
    if size > MAX_YAML:
        raise ConfigError(
            f"{file}: got {size} bytes, expected at most {MAX_YAML} for a map's YAML"
        )
    yaml_file = LinedYaml(file, texts=True)
    table = yaml_file.data
    if not isinstance(table, dict):
        got = "a list" if isinstance(table, list) else repr(table)[:60]
        raise yaml_file.wrong(
            (),
            "needs image, resolution and origin, each as a line KEY: VALUE, got "
            + ("nothing" if table is None else got),
        )
    resolution = _number(yaml_file, table.get("resolution"), ("resolution",))
    if resolution <= 0:
        raise yaml_file.wrong(
            ("resolution",), f"resolution must be above 0, got {resolution}"
        )
    if resolution < FINEST:
        raise yaml_file.wrong(
            ("resolution",),
            f"resolution must be {FINEST:g} m a cell at the least, got {resolution:g}",
        )
    origin = table.get("origin")
    if not isinstance(origin, list) or len(origin) != 3:
        raise yaml_file.wrong(
            ("origin",), f"origin must be [x, y, yaw], got {origin!r}"
        )
    x, y, yaw = (
        _number(yaml_file, part, ("origin", place)) for place, part in enumerate(origin)
    )
    if max(abs(x), abs(y)) > FARTHEST:
        raise yaml_file.wrong(
            ("origin",),
            f"origin must be within {FARTHEST:g} m, got ({x:g}, {y:g})",
        )
    negate = TRUTH.get(str(table.get("negate", "0")).lower())
    if negate is None:
        raise yaml_file.wrong(
            ("negate",), f"negate must be 0 or 1, got {table['negate']!r}"
        )
    occupied = _number(
        yaml_file, table.get("occupied_thresh"), ("occupied_thresh",), "0.65"
    )
    free = _number(yaml_file, table.get("free_thresh"), ("free_thresh",), "0.196")
    if not 0 <= free < occupied <= 1:
        raise yaml_file.wrong(
            ("free_thresh",),
            f"needs 0 <= free_thresh < occupied_thresh <= 1, got {free} and {occupied}",
        )
    mode = str(table.get("mode", "trinary")).lower()
    if mode not in MODES:
        raise yaml_file.wrong(
            ("mode",), f"mode must be {', '.join(MODES)}, got {table['mode']!r}"
        )
    image = _image_path(yaml_file, table.get("image"))
    pose = Pose(x, y, yaw)
    return _Settings(image, resolution, pose, negate, occupied, free, mode)


def _number(
    yaml_file: LinedYaml, value: object, path: tuple[str | int, ...], default: str = ""
) -> float:
    text = default if value is None and default else value
    try:
        number = float(text) if isinstance(text, str) else math.nan
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise yaml_file.wrong(path, f"{path[0]} must be a finite number, got {text!r}")
    return number


def _image_path(yaml_file: LinedYaml, name: object) -> Path:
    path = ("image",)
    if not isinstance(name, str) or not name or "\0" in name:
        raise yaml_file.wrong(path, f"image must be the name of a file, got {name!r}")
    try:
        folder = resolved(yaml_file.file).parent
        image = resolved(folder / name)
    except ConfigError as error:
        raise yaml_file.wrong(path, str(error)) from None
    if not image.is_relative_to(folder):
        raise yaml_file.wrong(
            path,
            f"the image {name!r} is not in the folder of the YAML file; put it there "
            "and write its name without a folder",
        )
    # Opening a pipe would block, and a device may have no end.
    if not image.is_file():
        raise yaml_file.wrong(path, f"there is no image file {name!r}")
    return image


def _read_image(file: Path, settings: _Settings) -> "NDArray[np.int8]":
    """Return the cells of an image, the upper row first."""
    from PIL import Image, UnidentifiedImageError

    too_many = (Image.DecompressionBombError, Image.DecompressionBombWarning)
    begins = b""
    Image.preinit()  # has readers of FORMATS; otherwise Pillow imports all readers
    try:
        with settings.image.open("rb") as stream:
            begins = stream.read(8)
        with Image.open(settings.image, formats=FORMATS) as opened:
            if opened.width * opened.height > MAX_PIXELS:
                raise ConfigError(
                    f"{file}: the image has {opened.width} x {opened.height} pixels, "
                    f"expected at most {MAX_PIXELS} in all"
                )
            size = opened.width * opened.height * _PIXEL.get(opened.mode, 4)
            if size > MAX_DECODED:
                raise ConfigError(
                    f"{file}: the image has {opened.width} x {opened.height} pixels, "
                    f"which take {size >> 20} MiB decoded, expected at most "
                    f"{MAX_DECODED >> 20} MiB: save it in grey, with a byte a pixel"
                )
            return _cells_of(opened, settings)
    except too_many as error:
        raise ConfigError(f"{file}: the image is too large: {error}") from error
    except UnidentifiedImageError as error:
        raise ConfigError(
            f"{file}: the image must be PGM, PNG, BMP or JPEG, got {_kind(begins)}"
        ) from error
    except (OSError, ValueError, SyntaxError) as error:
        if isinstance(error, ConfigError):
            raise
        raise ConfigError(f"{file}: the image cannot be read: {error}") from error


def _cells_of(image: "Image.Image", settings: _Settings) -> "NDArray[np.int8]":
    """Return the cells of an image, converted piece by piece."""
    import numpy as np

    width, height = image.size
    cells = np.empty((height, width), np.int8)
    for top in range(0, height, PIECE):
        for left in range(0, width, PIECE):
            right, below = min(width, left + PIECE), min(height, top + PIECE)
            light = _light(image.crop((left, top, right, below)), settings.mode)
            cells[top:below, left:right] = _cells(light, settings)
    return cells


def _light(image: "Image.Image", mode: str) -> "NDArray[np.float32]":
    """Return the lightness of each pixel, 0 to 1, the upper row first.

    As in map_server, the lightness is the mean of the colours. The meaning of an alpha
    channel depends on the mode: in ``trinary`` it counts as one more colour, in
    ``scale`` a pixel that is not opaque is unknown, here NaN, and in ``raw`` it is
    ignored.
    """
    import numpy as np

    has_alpha = image.has_transparency_data
    if image.mode.startswith("I"):
        return np.asarray(np.asarray(image) / 65535, np.float32)
    if image.mode == "L" and not has_alpha:
        return np.asarray(image, np.float32) / np.float32(255)
    pixels = np.asarray(image.convert("RGBA" if has_alpha else "RGB"))
    counted = pixels if mode == "trinary" else pixels[..., :3]
    light: NDArray[np.float32] = counted.mean(axis=2, dtype=np.float32) / 255
    if has_alpha and mode == "scale":
        light[pixels[..., 3] < 255] = np.nan
    return light


def _kind(begins: bytes) -> str:
    """Return the kind of a file that is not an image, by its first bytes."""
    if not begins:
        return "an empty file"
    further = " but cannot be decoded" if begins.startswith(MAGIC) else ""
    return f"a file that begins with {begins!r}{further}"


def _cells(light: "NDArray[np.float32]", settings: _Settings) -> "NDArray[np.int8]":
    import numpy as np

    if settings.mode == "raw":
        values = np.rint(light * 255)
        values[values > 100] = -1
        return values.astype(np.int8)
    clear = np.isnan(light)
    light = np.nan_to_num(light)
    chance = light if settings.negate else 1 - light
    low, high = settings.free, settings.occupied
    cells = np.full(light.shape, -1, np.int8)
    if settings.mode == "scale":
        between = np.rint(99 * (chance - low) / (high - low)).clip(1, 99)
        cells[:] = between.astype(np.int8)
    cells[chance > high] = 100
    cells[chance < low] = 0
    cells[clear] = -1
    return cells
