"""Checks of the files that a fleet file names."""

import io
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.local_plane import LocalPlane
from webmap.config.checks import Mistakes, Way
from webmap.config.fleet import ImageConfig, TilesConfig
from webmap.config.robot import PictureConfig
from webmap.core.pictures import pictures
from webmap.features.labels.label_store import label_file, read_labels
from webmap.features.tiles.tile_source import open_tiles

MOST_PIXELS = 1 << 26
"""Pixels of a picture: a browser has four bytes for each."""

PICTURES = (".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".svg", ".tif", ".tiff")
"""Names that end so are the picture of a floor plan, given in place of its YAML."""

NEEDED = ("name", "x", "y")
"""What every label says."""


def check_floor(floor: Path, mistakes: Mistakes) -> None:
    """Note what is wrong with a floor plan."""
    from webmap.console.floor import load_floor

    if floor.suffix.lower() in PICTURES:
        words = f"got the picture {str(floor)!r}, expected the YAML file beside it"
        mistakes.add(("floor",), f"{words}, which says where it lies")
        return
    try:
        with tempfile.TemporaryDirectory() as folder:
            load_floor(floor, Path(folder))
    except (ConfigError, OSError) as error:
        mistakes.add(("floor",), str(error))


def check_images(
    images: Sequence[ImageConfig], folder: Path, mistakes: Mistakes
) -> list[tuple[str, float, float, float, float]]:
    """Return pictures as ``Map.add_image`` takes them; what is none is noted."""
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
    picture: PictureConfig, folder: Path, way: Way, mistakes: Mistakes
) -> str:
    """Return the URL that pages load the picture of a robot from.

    Args:
        picture: The picture.
        folder: What its file is looked for from.
        way: The way to it.
        mistakes: Where what is wrong goes; there is no URL then.

    """
    try:
        data, media_type = picture_file(folder / picture.file)
    except (ConfigError, OSError) as error:
        mistakes.add((*way, "file"), str(error))
        return ""
    return pictures.publish(data, media_type)


def label_options(places: Any, folder: Path, mistakes: Mistakes) -> dict[str, Any]:
    """Return the arguments of ``Labels``; what is wrong is noted.

    Args:
        places: Tables of labels, or the name of a file with them.
        folder: What the file is looked for from.
        mistakes: Where every mistake goes.

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


def _check_label(label: Any, way: Way, mistakes: Mistakes) -> None:
    there = label if isinstance(label, dict) else NEEDED
    missing = [key for key in NEEDED if key not in there]
    for key in missing:
        mistakes.add(way, f'the key "{key}" is missing')
    if missing:
        return
    try:
        read_labels([label], "")
    except ConfigError as error:
        # It was read as the first of a list; the file may have it elsewhere.
        _, *inner = getattr(error, "way", (0,))
        mistakes.add((*way, *inner), getattr(error, "words", str(error)))


def tile_options(
    tiles: TilesConfig, folder: Path, mistakes: Mistakes
) -> dict[str, Any]:
    """Return the arguments of ``TileLayer``; tiles that are not there are noted."""
    options = msgspec.to_builtins(tiles)
    source = options.pop("source")
    try:
        datum = (options.pop("latitude"), options.pop("longitude"))
        LocalPlane(*datum, options.get("east", 0.0))
        # What names a host is refused as it stands, before it is taken for a file.
        found = open_tiles(source if "://" in source else folder / source)
        close = getattr(found, "close", None)
        if close is not None:
            close()
    except ConfigError as error:
        mistakes.add(("tiles", "source"), str(error))
        return {}
    return {"source": str((folder / source).absolute()), "datum": datum, **options}


def picture_file(file: Path) -> tuple[bytes, str]:
    """Return what is in a file that browsers can show, and its media type.

    Raises:
        ConfigError: If there is no such file, or it is no picture.

    """
    from webmap.server.files import IMAGES, MEDIA_TYPES, Published

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


def _check_svg(file: Path, data: bytes) -> None:
    if b"<svg" not in data[: 1 << 16]:
        raise ConfigError(f"{str(file)!r} is no SVG: it has no element <svg>")


def _check_pixels(file: Path, data: bytes) -> None:
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
