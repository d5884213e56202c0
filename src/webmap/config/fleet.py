"""Fleet files: the bridges, robots, maps and modules of a fleet.

A file is read strictly: every mistake is reported with its line. The keys are
documented in ``docs/howto/fleet-file.md``.
"""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

import msgspec

from webmap.base.errors import ConfigError
from webmap.base.text import escaped
from webmap.config import checks
from webmap.config.checks import KeyPath, Mistakes, key_path_text, same_name, show
from webmap.config.reading import ONE_OR_MORE, Config, ReadBy, read
from webmap.config.robot import (
    Alignment,
    ModuleConfig,
    RobotConfig,
    bridges_of,
    read_robot,
)
from webmap.ros.names import is_agent_url, normalise_url

_address = checks.expecting(
    'the address of a bridge, such as "ws://robot:9090"', normalise_url
)


class BridgeConfig(Config, kw_only=True, frozen=True):
    """A bridge: its address, and the alignment of its robots on the common map."""

    url: Annotated[str, _address]
    alignment: Alignment | None = None

    @classmethod
    def expand(cls, value: Any) -> dict[str, Any]:
        """Return the table for a URL alone."""
        return {"url": value}


class MapConfig(Config, kw_only=True, frozen=True):
    """A map that a bridge publishes, drawn under the robots."""

    bridge: Annotated[str, checks.text] = ""
    """The name of its bridge; the only one if not given."""
    topic: Annotated[str, checks.topic]
    palette: Literal["map", "costmap", "raw"] | None = None
    order: Annotated[float, checks.finite("a number; robots have 100")] | None = None

    @property
    def options(self) -> dict[str, Any]:
        """The options of ``Console.add_grid`` that it has."""
        options = {"palette": self.palette, "order": self.order}
        return {key: value for key, value in options.items() if value is not None}


class ImageConfig(Config, kw_only=True, frozen=True):
    """A picture under everything else."""

    file: Annotated[str, checks.text]
    x: Annotated[float, checks.finite("a number of metres: the left edge")]
    y: Annotated[float, checks.finite("a number of metres: the lower edge")]
    width: Annotated[float, checks.above_zero("metres")]
    height: Annotated[float, checks.above_zero("metres")]


def _tile_size(value: Any) -> int:
    size = checks.whole(256, 512)(value)
    if size not in (256, 512):
        raise ConfigError("256 or 512")
    return int(size)


class TilesConfig(Config, kw_only=True, frozen=True):
    """Tiles, and the place on the Earth where the map has its origin."""

    source: Annotated[str, checks.text]
    latitude: Annotated[float, checks.between(-89.999, 89.999, "degrees")]
    longitude: Annotated[float, checks.between(-360, 360, "degrees")]
    east: Annotated[float, checks.between(-360, 360, "degrees")] | None = None
    attribution: Annotated[str, checks.text] | None = None
    tile_size: Annotated[int, checks.expecting("256 or 512", _tile_size)] | None = None
    most: Annotated[int, checks.whole(1, 256)] | None = None
    opacity: Annotated[float, checks.between(0, 1, "full opacity")] | None = None


def _labels(value: Any) -> Any:
    if isinstance(value, list) or (isinstance(value, str) and value.strip()):
        return value
    raise ConfigError("a file's name, or a table [[labels]] for each")


def _bridges(value: Any, path: KeyPath, mistakes: Mistakes) -> dict[str, BridgeConfig]:
    if not isinstance(value, Mapping) or not value:
        got = "nothing" if value is None else show(value)
        example = 'a table [bridges] with lines such as hall = "ws://robot:9090"'
        mistakes.add(path, f"got {got}, expected {example}")
        return {}
    found = {}
    for name, each in value.items():
        if name in checks.HEAD and isinstance(each, str) and "://" not in each:
            advice = f"write the {name} of the file above the first [table]"
            mistakes.add((*path, name), f"got {show(each)} for a bridge; {advice}")
            continue
        bridge = read(BridgeConfig, each, (*path, name), mistakes)
        if bridge is not None:
            found[name] = bridge
    return found


def _robots(value: Any, path: KeyPath, mistakes: Mistakes) -> list[RobotConfig]:
    if not isinstance(value, list) or not value:
        got = "nothing" if value is None else show(value)
        more = " in double brackets" if isinstance(value, Mapping) else ""
        message = f"got {got}, expected a table [[robots]]{more} for each"
        mistakes.add(path, message)
        return []
    robots = []
    for index, each in enumerate(value):
        inner = (*path, index)
        robot = read_robot(each, inner, mistakes) or RobotConfig(name="")
        if isinstance(each, Mapping) and isinstance(each.get("name"), str):
            checks.checked(checks.name, robot.name, (*inner, "name"), mistakes)
        robots.append(robot)
        if isinstance(each, Mapping) and "scan_assist" in each and "twist" not in each:
            message = 'scan assist slows a driven robot: the key "twist" is missing'
            mistakes.add((*inner, "scan_assist"), message)
    return robots


class FleetConfig(Config, kw_only=True, frozen=True):
    """The content of a fleet file."""

    title: Annotated[str, checks.name] = ""
    floor: Annotated[str, checks.text] = ""
    map: Annotated[list[MapConfig], ONE_OR_MORE] = []
    image: Annotated[list[ImageConfig], ONE_OR_MORE] = []
    modules: list[ModuleConfig] = []
    """Modules of the map."""
    check_every: Annotated[float, checks.duration] | None = None
    """The same key of each robot with a twist topic, unless it has its own."""
    tiles: TilesConfig | None = None
    labels: Annotated[list[Any] | str, _labels] = ""
    """Tables of labels, or the name of a file with them."""
    bridges: Annotated[dict[str, BridgeConfig], ReadBy(_bridges)] = {}
    robots: Annotated[list[RobotConfig], ReadBy(_robots)] = []

    def to_dict(self) -> dict[str, Any]:
        """Return the configuration as plain data, as in a file."""
        data: dict[str, Any] = msgspec.to_builtins(self)
        return data


def read_fleet(data: Mapping[str, Any], mistakes: Mistakes) -> FleetConfig:
    """Return the configuration in a file's table; mistakes are added.

    Args:
        data: The table from the TOML reader.
        mistakes: The list for every mistake. Parts with a mistake are unusable in the
            result.

    """
    whole = {"bridges": None, "robots": None, **data}
    if whole["robots"] is None and _has_agents(whole["bridges"]):
        del whole["robots"]  # the agents have their own
    fleet = read(FleetConfig, whole, (), mistakes)
    assert fleet is not None, "a file is a table"
    if fleet.bridges:
        fleet = _linked(fleet, mistakes)
    if fleet.check_every is not None:
        robots = [_with_check(each, fleet.check_every) for each in fleet.robots]
        fleet = msgspec.structs.replace(fleet, robots=robots)
    _no_name_twice(fleet.robots, mistakes)
    _no_base_twice(fleet, mistakes)
    return fleet


def _with_check(robot: RobotConfig, every: float) -> RobotConfig:
    """Return a robot that demands a check, unless it says itself how often."""
    twist = robot.twist
    if twist is None or twist.check_every is not None:
        return robot
    checked = msgspec.structs.replace(twist, check_every=every)
    return robot.with_part("twist", checked)


def _has_agents(bridges: Any) -> bool:
    values = bridges.values() if isinstance(bridges, Mapping) else ()
    urls = [each.get("url") if isinstance(each, Mapping) else each for each in values]
    return any(isinstance(url, str) and is_agent_url(url) for url in urls)


def _linked(fleet: FleetConfig, mistakes: Mistakes) -> FleetConfig:
    """Return a fleet whose robots and maps all name their bridge."""
    # A bridge with a mistake has no address.
    urls = {name: str(each.url) for name, each in fleet.bridges.items()}
    own = [name for name, url in urls.items() if not is_agent_url(url)]
    only = own[0] if len(own) == 1 else ""
    for name, bridge in fleet.bridges.items():
        if name not in own and bridge.alignment is not None:
            message = "the fleet file of each agent has the alignment of its robots"
            mistakes.add(("bridges", name, "alignment"), message)
    replace = msgspec.structs.replace
    maps = [replace(each, bridge=each.bridge or only) for each in fleet.map]
    robots = [replace(each, bridge=each.bridge or only) for each in fleet.robots]
    named: list[tuple[KeyPath, str]] = []
    places: set[tuple[str, str]] = set()
    wrong = {path[:2] for path in mistakes.wrong}
    for index, each in enumerate(maps):
        path: KeyPath = ("map",) if len(maps) == 1 else ("map", index)
        named.append(((*path, "bridge") if each.bridge else path, each.bridge))
        place = (each.bridge, each.topic)
        if each.topic and place in places:
            message = f"the map {each.topic} of {each.bridge} is in the file already"
            mistakes.add(("map", index), message)
        places.add(place)
    for index, module in enumerate(fleet.modules):
        named += [(("modules", index, *w), name) for w, name in bridges_of(module)]
    for index, robot in enumerate(robots):
        path = ("robots", index)
        if robot.bridge:
            named += [((*path, *inner), name) for inner, name in robot.bridges()]
        elif robot.name:
            message = 'the key "bridge" is missing: there are several bridges'
            mistakes.add(path, message)
        if path not in wrong:
            robot.resolved().motion.check(path, mistakes)
    for path, name in named:
        if not name:
            mistakes.add(path, 'the key "bridge" is missing')
        elif name in fleet.bridges and name not in own:
            message = f"{name} is for agents, whose own fleet files have their robots"
            mistakes.add(path, message)
        elif name not in fleet.bridges:
            listed = f"the name of a bridge ({', '.join(fleet.bridges)})"
            hint = checks.did_you_mean(name, fleet.bridges)
            mistakes.add(path, f"got {show(name)}, expected {listed}{hint}")
    return msgspec.structs.replace(fleet, map=maps, robots=robots)


def _no_base_twice(fleet: FleetConfig, mistakes: Mistakes) -> None:
    """Refuse two robots with one base: driving one would move the other."""
    first: dict[tuple[str, str], int] = {}
    for index, robot in enumerate(fleet.robots):
        twist = robot.resolved().twist
        bridge = None if twist is None else fleet.bridges.get(twist.bridge)
        if twist is None or bridge is None or not twist.topic:
            continue
        other = first.setdefault((bridge.url, twist.topic), index)
        if other != index:
            mistakes.add(
                ("robots", index, "twist", "topic"),
                f'got the text "{twist.topic}", which drives '
                f'"{fleet.robots[other].name}" ({key_path_text(("robots", other))}) '
                "already, expected a topic of its own",
            )


def _no_name_twice(robots: Sequence[RobotConfig], mistakes: Mistakes) -> None:
    first: dict[str, int] = {}
    for index, robot in enumerate(robots):
        if not robot.name:
            continue
        other = first.setdefault(same_name(robot.name), index)
        if other != index:
            mistakes.add(
                ("robots", index, "name"),
                f'got the text "{robot.name}", expected a name that differs from '
                f'"{robots[other].name}" ({key_path_text(("robots", other))}) by more '
                "than case and Unicode form",
            )


# Writing of files.

SHORT = ("odometry", "twist", "move", "initial_pose", "cameras")
"""Keys whose value may be a topic alone."""

RemarkTexts = Mapping[KeyPath, str]


def dump(
    data: Mapping[str, Any],
    *,
    remarks: RemarkTexts | None = None,
    below: Mapping[KeyPath, Sequence[str]] | None = None,
    head: str = "",
) -> str:
    """Return the text of a fleet file.

    Args:
        data: The content, from :meth:`FleetConfig.to_dict`.
        remarks: Comments after values, by path.
        below: Comments on separate lines below values.
        head: Text before everything else.

    """
    writer = _TomlWriter(remarks or {}, below or {})
    plain = {key: each for key, each in data.items() if not _is_table(each)}
    lines = writer.pairs((), plain)
    for key in ("bridges", "map", "image", "modules", "tiles", "labels", "robots"):
        value = data.get(key)
        if value is None or not _is_table(value):
            continue
        if isinstance(value, Mapping):
            lines += ["", f"[{key}]", *writer.pairs((key,), value)]
        else:
            for index, each in enumerate(value):
                table = writer.pairs((key, index), each)
                lines += ["", f"[[{key}]]", *table, *writer.under((key, index))]
    # Remarks contain topic names too; a line break in one would begin a table.
    text = "\n".join(map(escaped, lines)).lstrip("\n")
    return f"{head}\n{text}\n" if head else f"{text}\n"


def _is_table(value: object) -> bool:
    return bool(value) and (
        isinstance(value, Mapping)
        or (isinstance(value, list) and all(isinstance(v, Mapping) for v in value))
    )


class _TomlWriter:
    """Writes TOML tables with comments."""

    def __init__(
        self, remarks: RemarkTexts, below: Mapping[KeyPath, Sequence[str]]
    ) -> None:
        self._remarks = remarks
        self._below = below
        self._with_remarks = {
            path[:length] for path in remarks for length in range(len(path))
        }
        """The paths of tables and lists with a remark inside."""

    def pairs(self, path: KeyPath, table: Mapping[str, Any]) -> list[str]:
        """Return the lines of a table, one per key, without its header."""
        lines = []
        for key, value in table.items():
            lines += self._pair((*path, key), _key(key), value)
            lines += self.under((*path, key))
        return lines

    def under(self, path: KeyPath) -> list[str]:
        """Return the comments below a value."""
        return [f"# {each}" for each in self._below.get(path, ())]

    def _pair(self, path: KeyPath, name: str, value: Any) -> list[str]:
        if isinstance(value, Mapping) and path in self._with_remarks:
            lines = []
            for key, each in value.items():
                lines += self._pair((*path, key), f"{name}.{_key(key)}", each)
            return lines
        if isinstance(value, list) and path[-1] in ("modules", "cameras", "buttons"):
            rows = [
                f"  {self._value(each, path)},{self._remark((*path, index))}"
                for index, each in enumerate(value)
            ]
            return [f"{name} = [", *rows, "]"]
        return [f"{name} = {self._value(value, path)}{self._remark(path)}"]

    def _remark(self, path: KeyPath) -> str:
        return f" # {self._remarks[path]}" if path in self._remarks else ""

    def _value(self, value: Any, path: KeyPath = ()) -> str:
        match value:
            case str():
                return _text(value)
            case bool():
                return str(value).lower()
            case list() | tuple():
                return f"[{', '.join(map(self._value, value))}]"
            case Mapping() if path and path[-1] in SHORT and set(value) == {"topic"}:
                return _text(value["topic"])
            case Mapping():
                pairs = [f"{_key(k)} = {self._value(v)}" for k, v in value.items()]
                return f"{{ {', '.join(pairs)} }}"
        return str(value)


def _text(value: str) -> str:
    # A JSON text is also a TOML text, except for unprintable characters.
    text = msgspec.json.encode(value).decode()
    return "".join(c if c.isprintable() else f"\\U{ord(c):08x}" for c in text)


def _key(name: str) -> str:
    plain = name.replace("-", "").replace("_", "")
    return name if plain.isascii() and plain.isalnum() else _text(name)
