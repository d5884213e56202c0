"""A fleet file: its bridges, robots, maps and modules are made, checked and shown."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec

import webmap
from webmap import console
from webmap.base.errors import ConfigError, WebMapError
from webmap.base.local_plane import LocalPlane
from webmap.base.map_file import read_map
from webmap.config.checks import KeyPath, Mistakes, WrongConfig
from webmap.config.fleet import FleetConfig, ImageConfig, TilesConfig, read_fleet
from webmap.config.robot import ModuleConfig, PictureConfig, RobotConfig
from webmap.config.toml_text import read_text, readable_secret
from webmap.core.alignment_store import store
from webmap.core.module_arguments import check_arguments
from webmap.core.pictures import pictures
from webmap.core.registry import map_modules
from webmap.core.robot import ModuleCall, module_call, note_refused
from webmap.features.labels.label_store import label_file, read_labels
from webmap.features.tiles.tile_source import open_tiles
from webmap.fleet.remote_robots import find_agents
from webmap.fleet.robot_files import picture_file
from webmap.poses.alignment import align_bridge
from webmap.ros.names import is_agent_url

if TYPE_CHECKING:
    from webmap import Bridge, Robot

log = logging.getLogger("webmap.cli")


@dataclass(frozen=True, slots=True)
class ReadyFleet:
    """A valid fleet file, with all its objects made."""

    fleet: FleetConfig
    bridges: dict[str, "Bridge"]
    robots: list["Robot"]
    floor: Path | None
    modules: dict[str, dict[str, Any]]
    """Modules of the map with their arguments, by their names."""
    images: list[tuple[str, float, float, float, float]]
    """Pictures as ``Map.add_image`` takes them."""
    others: list[ModuleCall]
    """Further modules of the map that the file lists."""
    agents: list[str]
    """The addresses of routers with agents."""


def prepare(file: Path) -> ReadyFleet:
    """Make all objects of a fleet file, without opening a connection.

    Logs a warning if other users can read a password in it.

    Raises:
        ConfigError: If the file has mistakes; each is listed with its line.
        OSError: If the file cannot be read.

    """
    text, mistakes = read_text(file), Mistakes()
    fleet = read_fleet(text.data, mistakes)
    wrong = {path[:1] for path in mistakes.wrong}
    if ("bridges",) in wrong:
        text.refuse(mistakes)
    warning = readable_secret(file, text.data)
    if warning is not None:
        log.warning("%s", warning)
    bridges = make_bridges(fleet)
    robots = make_robots(fleet, bridges, file.parent, mistakes)
    floor = file.parent / fleet.floor if fleet.floor else None
    if floor is not None:
        check_floor(floor, mistakes)
    modules, images, others = {}, [], []
    if fleet.tiles is not None and ("tiles",) not in wrong:
        modules["TileLayer"] = tile_options(fleet.tiles, file.parent, mistakes)
    if fleet.labels:
        modules["Labels"] = label_options(fleet.labels, file.parent, mistakes)
    if ("image",) not in wrong:
        images = check_images(fleet.image, file.parent, mistakes)
    if ("modules",) not in wrong:
        others = check_modules(fleet.modules, bridges, file.parent, mistakes)
    try:
        text.refuse(mistakes)
    except ConfigError:
        for robot in robots:
            robot.destroy()
        raise
    agents = [each.url for each in fleet.bridges.values() if is_agent_url(each.url)]
    return ReadyFleet(fleet, bridges, robots, floor, modules, images, others, agents)


def make_bridges(fleet: FleetConfig) -> dict[str, "Bridge"]:
    """Return the bridges of a file, by name, without those for agents."""
    bridges = {}
    for name, config in fleet.bridges.items():
        if is_agent_url(config.url):
            continue
        bridges[name] = webmap.Bridge(config.url, name=name)
        if config.alignment is not None:
            align_bridge(bridges[name], *config.alignment)
    return bridges


def make_robots(
    fleet: FleetConfig,
    bridges: Mapping[str, "Bridge"],
    folder: Path,
    mistakes: Mistakes,
) -> list["Robot"]:
    """Return the robots of a file; note what a robot or a module refuses.

    Args:
        fleet: The configuration in the file.
        bridges: Its bridges, by name.
        folder: The file's folder, to which the robots' pictures are relative.
        mistakes: Receives the mistakes. Parts of robots with known mistakes are left
            out, so that mistakes in other parts are found too.

    """
    wrong: dict[object, list[KeyPath]] = {}
    for each in mistakes.wrong:
        if each[:1] == ("robots",) and len(each) > 1:
            wrong.setdefault(each[1], []).append(each)
    robots = []
    for index, made in enumerate(fleet.robots):
        path: KeyPath = ("robots", index)
        config = _without(made, wrong.get(index, []))
        if config is None:
            continue
        picture = ""
        if config.picture is not None:
            where = (*path, "picture")
            picture = publish_picture(config.picture, folder, where, mistakes)
        try:
            robots.append(console.make_robot(config, bridges, picture))
        except WrongConfig as error:
            mistakes.take(path, error.mistakes)
    return robots


def _without(config: RobotConfig, wrong: list[KeyPath]) -> RobotConfig | None:
    """Return a robot without its wrong parts; None if no robot remains."""
    plain = RobotConfig(name=config.name)
    for path in wrong:
        key = str(path[2]) if len(path) > 2 else "name"
        if key in ("name", "bridge"):
            return None
        if key in RobotConfig.__struct_fields__:  # else there is no such key
            config = config.with_part(key, getattr(plain, key))
    return config


def check_modules(
    modules: list[ModuleConfig],
    bridges: Mapping[str, "Bridge"],
    folder: Path,
    mistakes: Mistakes,
) -> list[ModuleCall]:
    """Return the modules of the map; note arguments that a module refuses.

    Args:
        modules: The modules in the file.
        bridges: Its bridges, by name.
        folder: The file's folder, to which the maps of ``MapFile`` are relative.
        mistakes: Receives the mistakes.

    """
    found = []
    for index, module in enumerate(modules):
        path: KeyPath = ("modules", index)
        name, args, options = module_call(module, bridges.__getitem__)
        try:
            check_arguments(map_modules[name], args, options)
        except WebMapError as error:
            note_refused(mistakes, path, module, error)
        else:
            if name == "MapFile":
                args, options = _map_file(module, folder, path, mistakes)
            found.append((name, args, options))
    return found


def _map_file(
    module: ModuleConfig, folder: Path, path: KeyPath, mistakes: Mistakes
) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """Return the arguments of a map file, which is read to check that it is a map."""
    options = dict(module.options)
    name, *others = [options.pop("file")] if "file" in options else module.args
    inner: KeyPath = ("options", "file") if "file" in module.options else ("args", 0)
    file = (folder / name).absolute()
    with mistakes.at((*path, *inner)):
        read_map(file)
    return (str(file), *others), options


def open_fleet(ready: ReadyFleet, *, incidents: bool = False) -> None:
    """Serve the console with these robots at ``/``.

    Args:
        ready: The fleet.
        incidents: Whether the last minutes of the robots are recorded.

    """
    options: dict[str, Any] = {"incidents": incidents}
    if ready.fleet.title:
        options["title"] = ready.fleet.title
    bridges = list(ready.bridges.values())
    if ready.agents:
        urls = sorted(each.url for each in ready.fleet.bridges.values())
        options["place"] = "\n".join(urls)
    agents = find_agents(ready.agents, bridges)
    shown = console.open_console(bridges, [], floor=ready.floor, **options)
    for name, arguments in ready.modules.items():
        shown.set_module(name, **arguments)
    show_scenery(shown, ready)
    restore(ready.robots)
    for robot in ready.robots:
        shown.add(robot)
    for each in agents:
        each.show_on(shown)


def show_scenery(shown: console.Console, ready: ReadyFleet) -> None:
    """Show the images and maps under the robots on a console."""
    for image in ready.images:
        shown.add_image(*image)
    for grid in ready.fleet.map:
        shown.add_grid(ready.bridges[grid.bridge], grid.topic, **grid.options)
    for name, args, others in ready.others:
        shown.add_module(name, *args, **others)


def restore(robots: "list[Robot]") -> None:
    """Restore alignments that people set on a page, unless the file has newer ones."""
    for robot in robots:
        store.restore(robot)


PICTURES = (".bmp", ".jpeg", ".jpg", ".pgm", ".png", ".svg", ".tif", ".tiff")
"""Suffixes of pictures; such a file in place of a YAML file is a common mistake."""


def check_floor(floor: Path, mistakes: Mistakes) -> None:
    """Note the mistakes of a floor plan."""
    if floor.suffix.lower() in PICTURES:
        mistakes.add(
            ("floor",),
            f"got the picture {str(floor)!r}, expected the YAML file that names it and "
            "its position",
        )
        return
    with mistakes.at(("floor",)):
        read_map(floor)


def check_images(
    images: Sequence[ImageConfig], folder: Path, mistakes: Mistakes
) -> list[tuple[str, float, float, float, float]]:
    """Return pictures as ``Map.add_image`` takes them; note files that are none."""
    found = []
    for index, image in enumerate(images):
        file = folder / image.file
        with mistakes.at(("image", index, "file")):
            picture_file(file)
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
    with mistakes.at((*path, "file")):
        return pictures.publish(*picture_file(folder / picture.file))
    return ""


def label_options(places: Any, folder: Path, mistakes: Mistakes) -> dict[str, Any]:
    """Return the arguments of ``Labels``; note the mistakes.

    Args:
        places: Tables of labels, or the name of a file with them.
        folder: Folder to which the file is relative.
        mistakes: Receives the mistakes.

    """
    if not isinstance(places, str):
        read_labels(places, ("labels",), mistakes)
        return {"labels": places}
    file = folder / places
    with mistakes.at(("labels",)):
        label_file(file)
    return {"file": str(file.absolute())}


def tile_options(
    tiles: TilesConfig, folder: Path, mistakes: Mistakes
) -> dict[str, Any]:
    """Return the arguments of ``TileLayer``; note missing tiles."""
    options = msgspec.to_builtins(tiles)
    source = options.pop("source")
    datum = (options.pop("latitude"), options.pop("longitude"))
    with mistakes.at(("tiles", "source")):
        LocalPlane(*datum, options.get("east", 0.0))
        # A source with a host is refused as written, before it is used as a path.
        found = open_tiles(source if "://" in source else folder / source)
        close = getattr(found, "close", None)
        if close is not None:
            close()
    return {"source": str((folder / source).absolute()), "datum": datum, **options}
