"""Reading a fleet file's table: its bridges, its map, and its robots one by one."""

from functools import partial
from typing import Any

from webmap.cli.fleet import checks
from webmap.cli.fleet.alignments import Alignment, bridge_table
from webmap.cli.fleet.checks import HEAD, Mistakes
from webmap.cli.fleet.lines import Path, way_in_words
from webmap.cli.fleet.places import read_places, read_tiles
from webmap.cli.fleet.robot_table import known_bridge, read_modules, read_robot
from webmap.cli.fleet.scenery import read_images, read_maps
from webmap.cli.fleet.schema import TOP, Fleet, RobotLine
from webmap.discovery.naming import same_name
from webmap.errors import ConfigError
from webmap.ros.names import normalise_url


def read_table(data: dict[str, Any], mistakes: Mistakes) -> Fleet:
    """Return what a file's table means; what is wrong is noted.

    Args:
        data: The table as the TOML reader gives it.
        mistakes: Where every mistake goes. If there is one, the result is of no use.

    """
    for key in data:
        if key not in TOP:
            checks.unknown(key, TOP, (key,), mistakes)
    fleet = Fleet()
    for key in HEAD:
        if key in data:
            check = checks.name if key == "title" else checks.text
            setattr(fleet, key, checks.one(check, data[key], (key,), mistakes))
    fleet.bridges, fleet.alignments = _bridges(data.get("bridges"), mistakes)
    if "map" in data:
        only = next(iter(fleet.bridges)) if len(fleet.bridges) == 1 else None
        known = partial(known_bridge, bridges=fleet.bridges)
        fleet.maps = read_maps(data["map"], known, only, mistakes)
    if "image" in data:
        fleet.images = read_images(data["image"], mistakes)
    if "modules" in data:
        where = ("modules",)
        fleet.modules = read_modules(data["modules"], where, fleet.bridges, mistakes)
    if "tiles" in data:
        fleet.tiles = read_tiles(data["tiles"], ("tiles",), mistakes)
    if "labels" in data:
        fleet.labels = read_places(data["labels"], ("labels",), mistakes)
    robots = data.get("robots")
    if not isinstance(robots, list) or not robots:
        got = "nothing" if robots is None else checks.show(robots)
        more = " in two brackets" if isinstance(robots, dict) else ""
        words = f"got {got}, expected a table [[robots]]{more} for each"
        mistakes.add(("robots",), words)
        return fleet
    for index, value in enumerate(robots):
        fleet.robots.append(
            read_robot(value, ("robots", index), fleet.bridges, mistakes)
        )
    _no_name_twice(fleet.robots, mistakes)
    _no_base_twice(fleet, mistakes)
    return fleet


def _bridges(
    value: Any, mistakes: Mistakes
) -> tuple[dict[str, str], dict[str, Alignment]]:
    if not isinstance(value, dict) or not value:
        got = "nothing" if value is None else checks.show(value)
        example = 'a table [bridges] with lines such as hall = "ws://robot:9090"'
        mistakes.add(("bridges",), f"got {got}, expected {example}")
        return {}, {}
    urls, alignments = {}, {}
    for name, bridge in value.items():
        path: Path = ("bridges", name)
        if isinstance(bridge, dict):
            urls[name], stated = bridge_table(bridge, _address, path, mistakes)
            if stated is not None:
                alignments[name] = stated
        elif name in HEAD and not _is_address(bridge):
            words = f"the file's own {name} stands before the first [table]"
            mistakes.add(path, f"got {checks.show(bridge)} for a bridge; {words}")
        else:
            urls[name] = checks.one(_address, bridge, path, mistakes) or ""
    return urls, alignments


def _address(value: Any) -> str:
    try:
        return normalise_url(value)
    except ConfigError:
        raise ConfigError(
            'the address of a rosbridge, such as "ws://robot:9090"'
        ) from None


def _is_address(value: Any) -> bool:
    try:
        _address(value)
    except ConfigError:
        return False
    return True


def _no_base_twice(fleet: Fleet, mistakes: Mistakes) -> None:
    """Refuse two robots with one base: who drives the one would move the other."""
    first: dict[tuple[str, str], RobotLine] = {}
    for robot in fleet.robots:
        topic = (robot.twist or {}).get("topic")
        url = fleet.bridges.get(robot.bridge)
        if not topic or not url:
            continue
        other = first.setdefault((url, topic), robot)
        if other is not robot:
            mistakes.add(
                (*robot.path, "twist", "topic"),
                f'got the text "{topic}", which drives "{other.name}" '
                f"({way_in_words(other.path)}) already, expected a topic of its own",
            )


def _no_name_twice(robots: list[RobotLine], mistakes: Mistakes) -> None:
    first: dict[str, RobotLine] = {}
    for robot in robots:
        other = first.setdefault(same_name(robot.name), robot)
        if other is not robot and robot.name:
            mistakes.add(
                (*robot.path, "name"),
                f'got the text "{robot.name}", expected a name that differs from '
                f'"{other.name}" ({way_in_words(other.path)}) by more than case and '
                f"Unicode form",
            )
