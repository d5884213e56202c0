"""Floor plans in the form of ROS's map_server: a YAML file and an image."""

import math
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from webmap.errors import ConfigError
from webmap.plain_files import read_file

FLOOR = Path(__file__).parent / "data" / "floor.yaml"
"""The floor plan that comes with the simulator."""

FREE, OCCUPIED, UNKNOWN = 0, 100, -1

_LARGEST = 1 << 20


@dataclass(frozen=True, slots=True, eq=False)
class FloorPlan:
    """A grid of cells as ``nav_msgs/OccupancyGrid`` has it."""

    occupancy: NDArray[np.int8]
    """Of shape (rows, columns), the lowest row first: 0 to 100, or -1 unknown."""

    resolution: float
    """The side of a cell, in metres."""

    x: float
    """The left edge of the first column, in metres."""

    y: float
    """The lower edge of the first row, in metres."""

    image: Path | None = None
    """The file it was read from."""

    def cell(self, x: float, y: float) -> tuple[int, int]:
        """Return the row and the column that hold a point, perhaps outside."""
        return (
            math.floor((y - self.y) / self.resolution),
            math.floor((x - self.x) / self.resolution),
        )

    def center(self, row: int, column: int) -> tuple[float, float]:
        """Return the middle of a cell, in metres."""
        return (
            self.x + (column + 0.5) * self.resolution,
            self.y + (row + 0.5) * self.resolution,
        )


class _Loader(yaml.SafeLoader):
    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        # A few of them in one another stand for more than any memory holds.
        if self.check_event(yaml.AliasEvent):
            raise ValueError("aliases (*name) have no place in a map's YAML")
        return super().compose_node(parent, index)


def load_map(path: Path | str) -> FloorPlan:
    """Return the floor plan of a map_server YAML file.

    Args:
        path: Of the YAML file. Its image must lie in the same folder or below.

    Raises:
        ConfigError: If a file is missing, or says something that makes no map.

    """
    path = Path(path)
    settings = _read_settings(path)
    image = _image_path(path, settings)
    resolution = _number(path, settings, "resolution")
    if not resolution > 0:
        raise ConfigError(f"{path}: resolution must be above 0, got {resolution}")
    x, y = _origin(path, settings)
    occupancy = _occupancy(path, settings, _read_pixels(image))
    # An image has its first row at the top, a grid at the bottom.
    return FloorPlan(np.ascontiguousarray(occupancy[::-1]), resolution, x, y, image)


def _read_settings(path: Path) -> dict[str, Any]:
    try:
        data = read_file(path, _LARGEST)
        settings = yaml.load(data, _Loader)  # noqa: S506 - it is a safe one
    except OSError as error:
        raise ConfigError(f"{path}: no map there ({error.strerror})") from error
    except ConfigError:
        raise
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ConfigError(f"{path}: not a YAML file: {error}") from error
    if not isinstance(settings, dict):
        raise ConfigError(f"{path}: needs image, resolution and origin")
    return settings


def _image_path(path: Path, settings: dict[str, Any]) -> Path:
    name = settings.get("image")
    if not isinstance(name, str) or not name:
        raise ConfigError(f"{path}: image must be the name of a file, got {name!r}")
    folder = path.parent.resolve()
    image = (folder / name).resolve()
    if not image.is_relative_to(folder):
        raise ConfigError(f"{path}: image {name!r} lies outside the map's folder")
    return image


def _number(
    path: Path, settings: dict[str, Any], key: str, default: Any = None
) -> float:
    value = settings.get(key, default)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value):
        raise ConfigError(f"{path}: {key} must be a number, got {value!r}")
    return float(value)


def _origin(path: Path, settings: dict[str, Any]) -> tuple[float, float]:
    origin = settings.get("origin")
    if not isinstance(origin, list) or len(origin) != 3:
        raise ConfigError(f"{path}: origin must be [x, y, yaw], got {origin!r}")
    x, y, yaw = (_number(path, {"origin": value}, "origin") for value in origin)
    if yaw:
        raise ConfigError(f"{path}: an origin with a yaw is not supported, got {yaw}")
    return x, y


def _read_pixels(image: Path) -> NDArray[np.float64]:
    """Return how light each pixel is, 0 to 1, the upper row first."""
    from PIL import Image

    too_large = (Image.DecompressionBombError, Image.DecompressionBombWarning)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(image) as opened:
                deep = opened.mode.startswith("I")
                pixels = np.asarray(opened if deep else opened.convert("RGB"))
    except too_large as error:
        raise ConfigError(f"{image}: too large for a map: {error}") from error
    except FileNotFoundError as error:
        raise ConfigError(f"{image}: no such image") from error
    except (OSError, ValueError, SyntaxError) as error:
        raise ConfigError(f"{image}: not an image that can be read: {error}") from error
    if deep:
        return np.asarray(pixels / 65535)
    # As map_server: colours count by their mean.
    return np.asarray(pixels.mean(axis=2) / 255)


def _occupancy(
    path: Path, settings: dict[str, Any], light: NDArray[np.float64]
) -> NDArray[np.int8]:
    mode = settings.get("mode", "trinary")
    negate = bool(settings.get("negate", 0))
    occupied_above = _number(path, settings, "occupied_thresh", 0.65)
    free_below = _number(path, settings, "free_thresh", 0.196)
    if not 0 <= free_below < occupied_above <= 1:
        raise ConfigError(
            f"{path}: needs 0 <= free_thresh < occupied_thresh <= 1,"
            f" got {free_below} and {occupied_above}"
        )
    chance = light if negate else 1 - light
    if mode == "raw":
        values = np.rint(light * 255)
        return np.where(values <= OCCUPIED, values, UNKNOWN).astype(np.int8)
    if mode not in ("trinary", "scale"):
        raise ConfigError(f"{path}: mode must be trinary, scale or raw, got {mode!r}")
    between: Any = UNKNOWN
    if mode == "scale":
        between = np.rint(
            99 * (chance - free_below) / (occupied_above - free_below)
        ).clip(1, 99)
    return np.select(
        [chance > occupied_above, chance < free_below], [OCCUPIED, FREE], between
    ).astype(np.int8)
