"""Pictures in a fleet file: those under everything, and those that robots look like."""

import io
from dataclasses import dataclass
from pathlib import Path as File
from typing import Any

from webmap.cli.fleet import checks
from webmap.cli.fleet.checks import Check, Mistakes
from webmap.cli.fleet.lines import Path
from webmap.console import Picture
from webmap.core.pictures import pictures
from webmap.errors import ConfigError

MOST_PIXELS = 1 << 26
"""Pixels of a picture: a browser has four bytes for each."""

PICTURE: dict[str, Check] = {
    "file": checks.text,
    "width": checks.above_zero("metres"),
    "height": checks.above_zero("metres"),
    "x": checks.finite("a number of metres: how far its middle is before the base"),
    "y": checks.finite("a number of metres: how far its middle is left of the base"),
    "angle": checks.finite("a number of degrees, counter-clockwise"),
}


@dataclass(frozen=True, slots=True)
class PictureLine:
    """The picture of a robot, and where the file says so."""

    table: dict[str, Any]
    path: Path


def read_picture(value: Any, path: Path, mistakes: Mistakes) -> PictureLine:
    """Take the table ``picture`` of a robot."""
    needed = ("file", "width", "height")
    table = checks.table(value, PICTURE, path, mistakes, needed=needed)
    return PictureLine(table, path)


def picture_of(line: PictureLine, folder: File, mistakes: Mistakes) -> Picture | None:
    """Return a picture that pages can load; None, and a mistake, if it is none.

    Args:
        line: What the file says of it.
        folder: What the picture's file is looked for from.
        mistakes: Where what is wrong goes.

    """
    table = dict(line.table)
    file = folder / table.pop("file")
    try:
        data, media_type = picture_file(file)
    except (ConfigError, OSError) as error:
        mistakes.add((*line.path, "file"), str(error))
        return None
    return Picture(pictures.publish(data, media_type), **table)


def picture_file(file: File) -> tuple[bytes, str]:
    """Return what is in a file that browsers can show, and its media type.

    Raises:
        ConfigError: If there is no such file, or it is no picture.

    """
    from webmap.server.files import MEDIA_TYPES
    from webmap.server.published import IMAGES, Published

    known = [end for end, type in MEDIA_TYPES.items() if type.startswith("image/")]
    if file.is_file() and file.suffix.lower() not in known:
        raise ConfigError(
            f"{str(file)!r} is no picture: its name must end in {' '.join(known)}"
        )
    published = Published()  # says what is wrong with the file as a file
    found = published.image(published.publish_image(file).removeprefix(IMAGES))
    if found.media_type.startswith("image/svg"):
        _check_svg(file, found.data)
    else:
        _check_pixels(file, found.data)
    return found.data, found.media_type


def _check_svg(file: File, data: bytes) -> None:
    if b"<svg" not in data[: 1 << 16]:
        raise ConfigError(f"{str(file)!r} is no SVG: it has no element <svg>")


def _check_pixels(file: File, data: bytes) -> None:
    from PIL import Image

    try:
        with Image.open(io.BytesIO(data)) as image:
            width, height = image.size
            image.verify()
    except Exception as error:  # each form of picture has errors of its own
        raise ConfigError(
            f"{str(file)!r} is no picture that can be read: expected what its suffix "
            f"{file.suffix} says, whole; got {_in_words(error)}"
        ) from None
    if width * height > MOST_PIXELS:
        raise ConfigError(
            f"{str(file)!r} has {width} x {height} pixels; expected {MOST_PIXELS} at "
            f"the most"
        )


def _in_words(error: Exception) -> str:
    from PIL import UnidentifiedImageError

    if isinstance(error, UnidentifiedImageError):
        return "something else"
    return str(error) or type(error).__name__
