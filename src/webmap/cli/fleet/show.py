"""Showing the robots of a fleet file."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from webmap import console
from webmap.cli.fleet.alignments import restore
from webmap.cli.fleet.checks import Mistakes
from webmap.cli.fleet.file import read_fleet
from webmap.cli.fleet.places import label_options, tile_options
from webmap.cli.fleet.robots import make_bridges, make_robots
from webmap.cli.fleet.scenery import (
    MapModule,
    check_images,
    check_modules,
    show_scenery,
)
from webmap.cli.fleet.schema import Fleet
from webmap.cli.fleet.secrets import readable_secret
from webmap.errors import ConfigError

if TYPE_CHECKING:
    from webmap import Bridge, Robot


log = logging.getLogger("webmap.cli")

PICTURES = (".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".svg", ".tif", ".tiff")
"""Names that end so are the picture of a floor plan, given in place of its YAML."""


@dataclass(frozen=True, slots=True)
class ReadyFleet:
    """A file that is right, with everything in it made."""

    fleet: Fleet
    bridges: dict[str, "Bridge"]
    robots: list["Robot"]
    floor: Path | None
    modules: dict[str, dict[str, Any]]
    """Modules of the map with their arguments, by their names."""
    images: list[tuple[str, float, float, float, float]]
    """Pictures as ``Map.add_image`` takes them."""
    others: list[MapModule]
    """The modules of the map that the file names."""


def prepare(file: Path) -> ReadyFleet:
    """Make everything that a file says; no link is opened yet.

    Logs a warning if other users can read a password in it.

    Raises:
        ConfigError: If anything in it is wrong; every mistake is named with its line.
        OSError: If it cannot be read.

    """
    fleet, text = read_fleet(file)
    warning = readable_secret(file, text.data)
    if warning is not None:
        log.warning("%s", warning)
    mistakes = Mistakes()
    bridges = make_bridges(fleet)
    robots = make_robots(fleet, bridges, file.parent, mistakes)
    floor = file.parent / fleet.floor if fleet.floor else None
    if floor is not None:
        _check_floor(floor, mistakes)
    modules = {}
    if fleet.tiles is not None:
        modules["TileLayer"] = tile_options(fleet.tiles, file.parent, mistakes)
    if fleet.labels is not None:
        modules["Labels"] = label_options(fleet.labels, file.parent, mistakes)
    images = check_images(fleet.images, file.parent, mistakes)
    others = check_modules(fleet.modules, bridges, file.parent, mistakes)
    text.refuse(mistakes)
    return ReadyFleet(fleet, bridges, robots, floor, modules, images, others)


def _check_floor(floor: Path, mistakes: Mistakes) -> None:
    import tempfile

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


def open_fleet(ready: ReadyFleet) -> None:
    """Make the console with these robots the page at ``/``."""
    options = {"title": ready.fleet.title} if ready.fleet.title else {}
    bridges = list(ready.bridges.values())
    shown = console.open_console(bridges, [], floor=ready.floor, **options)
    for name, arguments in ready.modules.items():
        shown.set_module(name, **arguments)
    maps = ready.fleet.maps
    show_scenery(shown, maps, ready.images, ready.others, ready.bridges)
    restore(ready.robots)
    for robot in ready.robots:
        shown.add(robot)
