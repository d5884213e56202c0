"""Checks of the files that a fleet file names."""

import io
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.geometry import LocalPlane
from webmap.config.checks import KeyPath, Mistakes
from webmap.config.fleet import ImageConfig, TilesConfig
from webmap.config.robot import PictureConfig
from webmap.core.pictures import pictures
from webmap.features.labels.label_store import label_file, read_labels
from webmap.features.tiles.tile_source import open_tiles

MOST_PIXELS = 1 << 26
"""Most pixels of a picture: a browser uses four bytes for each."""

PICTURES = (".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".svg", ".tif", ".tiff")
"""Suffixes of pictures; such a file in place of a YAML file is a common mistake."""

FORMATS = ("BMP", "GIF", "ICO", "JPEG", "PNG", "WEBP")
"""Formats of pictures that browsers show, by the names of Pillow."""

NEEDED = ("name", "x", "y")
"""The required keys of a label."""


def check_floor(floor: Path, mistakes: Mistakes) -> None:
    """Note the mistakes of a floor plan."""
    from webmap.console.floor import load_floor

    if floor.suffix.lower() in PICTURES:
        mistakes.add(
            ("floor",),
            f"got the picture {str(floor)!r}, expected the YAML file that names it and "
            "its position",
        )
        return
    try:
        with tempfile.TemporaryDirectory() as folder:
            load_floor(floor, Path(folder))
    except (ConfigError, OSError) as error:
        mistakes.add(("floor",), str(error))


def check_images(
    images: Sequence[ImageConfig], folder: Path, mistakes: Mistakes
) -> list[tuple[str, float, float, float, float]]:
    """Return pictures as ``Map.add_image`` takes them; note files that are none."""
    found = []
    for index, image in enumerate(images):
        file = folder / image.file
        try:
            picture_file(file)
        except (ConfigError, OSError) as error:
            mistakes.add(("image", index, "file"), str(error))
            continue
        sides = (image.x, image.y, image.width, image.height)
        found.append((str(file.absolute()), *sides))
    return found


def publish_picture(
    picture: PictureConfig, folder: Path, path: KeyPath, mistakes: Mistakes
) -> str:
    """Return the URL from which pages load the picture of a robot.

    Args:
        picture: The picture.
        folder: Folder to which its file is relative.
        path: The keys that lead to it.
        mistakes: Receives the mistakes; there is no URL then.

    """
    try:
        data, media_type = picture_file(folder / picture.file)
    except (ConfigError, OSError) as error:
        mistakes.add((*path, "file"), str(error))
        return ""
    return pictures.publish(data, media_type)


def label_options(places: Any, folder: Path, mistakes: Mistakes) -> dict[str, Any]:
    """Return the arguments of ``Labels``; note the mistakes.

    Args:
        places: Tables of labels, or the name of a file with them.
        folder: Folder to which the file is relative.
        mistakes: Receives the mistakes.

    """
    if not isinstance(places, str):
        for index, each in enumerate(places):
            _check_label(each, ("labels", index), mistakes)
        return {"labels": places}
    file = folder / places
    try:
        label_file(file)
    except ConfigError as error:
        mistakes.add(("labels",), str(error))
    return {"file": str(file.absolute())}


def _check_label(label: Any, path: KeyPath, mistakes: Mistakes) -> None:
    there = label if isinstance(label, dict) else NEEDED
    missing = [key for key in NEEDED if key not in there]
    for key in missing:
        mistakes.add(path, f'the key "{key}" is missing')
    if missing:
        return
    try:
        read_labels([label], "")
    except ConfigError as error:
        # The label was read as item 0 of a list; its index in the file may differ.
        _, *inner = getattr(error, "path", (0,))
        mistakes.add((*path, *inner), getattr(error, "text", str(error)))


def tile_options(
    tiles: TilesConfig, folder: Path, mistakes: Mistakes
) -> dict[str, Any]:
    """Return the arguments of ``TileLayer``; note missing tiles."""
    options = msgspec.to_builtins(tiles)
    source = options.pop("source")
    try:
        datum = (options.pop("latitude"), options.pop("longitude"))
        LocalPlane(*datum, options.get("east", 0.0))
        # A source with a host is refused as written, before it is used as a path.
        found = open_tiles(source if "://" in source else folder / source)
        close = getattr(found, "close", None)
        if close is not None:
            close()
    except ConfigError as error:
        mistakes.add(("tiles", "source"), str(error))
        return {}
    return {"source": str((folder / source).absolute()), "datum": datum, **options}


def picture_file(file: Path) -> tuple[bytes, str]:
    """Return the contents of a file that browsers can show, and its media type.

    Raises:
        ConfigError: If there is no such file, or it is not a picture.

    """
    from webmap.server.files import IMAGES, MEDIA_TYPES, Published

    known = [end for end, type in MEDIA_TYPES.items() if type.startswith("image/")]
    if file.is_file() and file.suffix.lower() not in known:
        raise ConfigError(
            f"{str(file)!r} is not a picture: its name must end in {' '.join(known)}"
        )
    published = Published()  # raises errors of the file itself
    found = published.image(published.publish_image(file).removeprefix(IMAGES))
    check_picture(file, found.data, found.media_type)
    return found.data, found.media_type


def check_picture(
    file: Path, data: bytes, media_type: str, most_pixels: int = MOST_PIXELS
) -> None:
    """Check that browsers can show a picture.

    Args:
        file: Its name, for the error.
        data: Its content.
        media_type: Its type, by its suffix.
        most_pixels: The most pixels that it may have.

    Raises:
        ConfigError: If they cannot.

    """
    if media_type.startswith("image/svg"):
        _check_svg(file, data)
    else:
        _check_pixels(file, data, most_pixels)


def _check_svg(file: Path, data: bytes) -> None:
    if b"<svg" not in data[: 1 << 16]:
        raise ConfigError(f"{str(file)!r} is not an SVG: it has no element <svg>")


def _check_pixels(file: Path, data: bytes, most_pixels: int) -> None:
    from PIL import Image

    try:
        with Image.open(io.BytesIO(data), formats=FORMATS) as image:
            width, height = image.size
            image.verify()
    except Exception as error:  # each picture format has its own errors
        raise ConfigError(
            f"{str(file)!r} cannot be read: expected a complete picture in the format "
            f"of its suffix {file.suffix}, got {_reason(error)}"
        ) from None
    if width * height > most_pixels:
        raise ConfigError(
            f"{str(file)!r} has {width} x {height} pixels; expected {most_pixels} at "
            f"the most"
        )


def _reason(error: Exception) -> str:
    from PIL import UnidentifiedImageError

    if isinstance(error, UnidentifiedImageError):
        return "another format"
    return str(error) or type(error).__name__
