"""What lies under the robots of a fleet file: maps, pictures and modules of the map."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path as File
from typing import TYPE_CHECKING, Any

from webmap.cli.fleet import checks
from webmap.cli.fleet.checks import Check, Mistakes
from webmap.cli.fleet.lines import Path
from webmap.cli.fleet.pictures import picture_file
from webmap.cli.fleet.robots import in_words, meant
from webmap.cli.fleet.schema import ModuleLine
from webmap.core.module_arguments import WrongArguments, check_arguments
from webmap.core.registry import map_modules
from webmap.errors import ConfigError, WebMapError
from webmap.map_file import read_map

if TYPE_CHECKING:
    from webmap import Bridge
    from webmap.console import Console


@dataclass(frozen=True, slots=True)
class MapModule:
    """A module of the map, with what it gets."""

    name: str
    args: tuple[Any, ...]
    options: dict[str, Any]


def read_maps(
    value: Any, known_bridge: Check, only: str | None, mistakes: Mistakes
) -> list[dict[str, Any]]:
    """Take a table ``[map]``, or a table ``[[map]]`` for each of several.

    Args:
        value: The table, or the array of them.
        known_bridge: Takes the name of a bridge.
        only: The name of the only bridge, which need not be said.
        mistakes: Where every mistake goes.

    Returns:
        For each ``bridge`` and ``topic``, and the other arguments of
        ``OccupancyGrid`` that were said.

    """
    fields: dict[str, Check] = {
        "bridge": known_bridge,
        "topic": checks.topic,
        "palette": checks.one_of("map", "costmap", "raw"),
        "order": checks.finite("a number; robots have 100"),
    }
    found: list[dict[str, Any]] = []
    for path, table in _tables(value, "map"):
        if isinstance(table, dict) and "bridge" not in table and only is not None:
            table = {"bridge": only, **table}
        needed = ("bridge", "topic")
        said = checks.table(table, fields, path, mistakes, needed=needed)
        place = (said.get("bridge"), said.get("topic"))
        if place in [(other.get("bridge"), other.get("topic")) for other in found]:
            mistakes.add(path, f"the map {place[1]} of {place[0]} stands there already")
        found.append(said)
    return found


def read_images(value: Any, mistakes: Mistakes) -> list[dict[str, Any]]:
    """Take a table ``[image]``, or a table ``[[image]]`` for each of several."""
    fields: dict[str, Check] = {
        "file": checks.text,
        "x": checks.finite("a number of metres: the left edge"),
        "y": checks.finite("a number of metres: the lower edge"),
        "width": checks.above_zero("metres"),
        "height": checks.above_zero("metres"),
    }
    return [
        checks.table(table, fields, path, mistakes, needed=tuple(fields))
        for path, table in _tables(value, "image")
    ]


def check_images(
    images: list[dict[str, Any]], folder: File, mistakes: Mistakes
) -> list[tuple[str, float, float, float, float]]:
    """Return pictures as ``Map.add_image`` takes them; what is none is noted."""
    found = []
    for index, image in enumerate(images):
        file = folder / image["file"]
        try:
            picture_file(file)
        except (ConfigError, OSError) as error:
            mistakes.add(("image", index, "file"), str(error))
            continue
        sides = (image["x"], image["y"], image["width"], image["height"])
        found.append((str(file.absolute()), *sides))
    return found


def check_modules(
    modules: list[ModuleLine],
    bridges: Mapping[str, "Bridge"],
    folder: File,
    mistakes: Mistakes,
) -> list[MapModule]:
    """Return the modules of the map; what one does not take is noted.

    Args:
        modules: What the file says.
        bridges: Its bridges, by name.
        folder: The file's own, in which the maps of ``MapFile`` are looked for.
        mistakes: Where what is wrong goes.

    """
    found = []
    for line in modules:
        args = tuple(meant(value, bridges) for value in line.args)
        options = {key: meant(value, bridges) for key, value in line.options.items()}
        try:
            check_arguments(map_modules[line.name], args, options)
        except WrongArguments as error:
            for wrong in error.wrong:
                mistakes.add((*line.path, *wrong.way), in_words(line, wrong))
        except WebMapError as error:
            mistakes.add((*line.path, "name"), str(error))
        else:
            if line.name == "MapFile":
                args, options = _map_file(line, folder, mistakes)
            found.append(MapModule(line.name, args, options))
    return found


def _map_file(
    line: ModuleLine, folder: File, mistakes: Mistakes
) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """Return the arguments of a map from disk, which is read to see that it is one."""
    options = dict(line.options)
    name, *others = [options.pop("file")] if "file" in options else line.args
    way = ("options", "file") if "file" in line.options else ("args", 0)
    file = (folder / name).absolute()
    try:
        read_map(file)
    except (ConfigError, OSError) as error:
        mistakes.add((*line.path, *way), str(error))
    return (str(file), *others), options


def show_scenery(
    shown: "Console",
    maps: list[dict[str, Any]],
    images: list[tuple[str, float, float, float, float]],
    modules: list[MapModule],
    bridges: Mapping[str, "Bridge"],
) -> None:
    """Show on a console what lies under its robots."""
    for image in images:
        shown.add_image(*image)
    for grid in maps:
        options = {key: grid[key] for key in ("palette", "order") if key in grid}
        shown.add_grid(bridges[grid["bridge"]], grid["topic"], **options)
    for module in modules:
        shown.add_module(module.name, *module.args, **module.options)


def _tables(value: Any, key: str) -> list[tuple[Path, Any]]:
    if isinstance(value, list):
        return [((key, index), each) for index, each in enumerate(value)]
    return [((key,), value)]
