"""What of the world a fleet file tells: labels of places, and tiles of a map."""

from pathlib import Path as File
from typing import Any

from webmap.cli.fleet import checks
from webmap.cli.fleet.checks import Check, Mistakes
from webmap.cli.fleet.lines import Path
from webmap.core.labels import label_file, read_labels
from webmap.core.local_plane import LocalPlane
from webmap.core.tile_source import open_tiles
from webmap.errors import ConfigError

Places = list[Any] | str
"""Tables of labels, or the name of a file with them."""


def _number(low: float, high: float, unit: str) -> Check:
    def check(value: Any) -> float:
        number = isinstance(value, int | float) and not isinstance(value, bool)
        if not number or not low <= value <= high:
            raise ConfigError(f"a number of {unit} from {low:g} to {high:g}")
        return float(value)

    return check


def _whole(low: int, high: int) -> Check:
    def check(value: Any) -> int:
        number = isinstance(value, int) and not isinstance(value, bool)
        if not number or not low <= value <= high:
            raise ConfigError(f"a whole number from {low} to {high}")
        return int(value)

    return check


TILES: dict[str, Check] = {
    "source": checks.text,
    "latitude": _number(-89.999, 89.999, "degrees"),
    "longitude": _number(-360, 360, "degrees"),
    "east": _number(-360, 360, "degrees"),
    "attribution": checks.text,
    "tile_size": _whole(256, 512),
    "most": _whole(1, 256),
    "opacity": _number(0, 1, "full opacity"),
}

NEEDED = ("name", "x", "y")
"""What every label says."""


def read_places(value: Any, path: Path, mistakes: Mistakes) -> Places:
    """Take tables ``[[labels]]``, or the name of a file with labels."""
    if isinstance(value, str):
        return str(checks.one(checks.text, value, path, mistakes) or "")
    if not isinstance(value, list):
        words = "expected a file's name, or a table [[labels]] for each"
        mistakes.add(path, f"got {checks.show(value)}, {words}")
        return []
    for index, each in enumerate(value):
        there = each if isinstance(each, dict) else NEEDED
        missing = [key for key in NEEDED if key not in there]
        for key in missing:
            mistakes.add((*path, index), f'the key "{key}" is missing')
        if missing:
            continue
        try:
            read_labels([each], "")
        except ConfigError as error:
            # It was read as the first of a list; the file may have it elsewhere.
            _, *inner = getattr(error, "way", (0,))
            mistakes.add((*path, index, *inner), getattr(error, "words", str(error)))
    return value


def read_tiles(value: Any, path: Path, mistakes: Mistakes) -> dict[str, Any]:
    """Take a table ``[tiles]``."""
    needed = ("source", "latitude", "longitude")
    return checks.table(value, TILES, path, mistakes, needed=needed)


def label_options(places: Places, folder: File, mistakes: Mistakes) -> dict[str, Any]:
    """Return the arguments of ``Labels``; what a file of them lacks is noted."""
    if not isinstance(places, str):
        return {"labels": places}
    file = folder / places
    try:
        label_file(file)
    except ConfigError as error:
        mistakes.add(("labels",), str(error))
    return {"file": str(file.absolute())}


def tile_options(
    tiles: dict[str, Any], folder: File, mistakes: Mistakes
) -> dict[str, Any]:
    """Return the arguments of ``TileLayer``; tiles that are not there are noted."""
    options = dict(tiles)
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
