"""What a fleet file may say, and what that means."""

from dataclasses import dataclass, field
from typing import Any

from webmap.cli.fleet import checks
from webmap.cli.fleet.alignments import Alignment, alignment, bridge_table
from webmap.cli.fleet.buttons import read_buttons
from webmap.cli.fleet.cameras import CameraLine, read_cameras
from webmap.cli.fleet.checks import Check, Mistakes
from webmap.cli.fleet.lines import Path
from webmap.cli.fleet.places import Places, read_places, read_tiles
from webmap.cli.fleet.stopping import read_assist, read_hooks
from webmap.discovery.naming import same_name
from webmap.errors import ConfigError
from webmap.ros.names import normalise_url

TOP = ("title", "floor", "map", "tiles", "labels", "bridges", "robots")
ODOMETRY: dict[str, Check] = {
    "topic": checks.topic,
    "type": checks.message_type(
        "nav_msgs/Odometry",
        "geometry_msgs/Pose",
        "geometry_msgs/PoseStamped",
        "geometry_msgs/PoseWithCovarianceStamped",
        "geometry_msgs/Pose2D",
    ),
    "throttle": checks.milliseconds,
}
TWIST: dict[str, Check] = {
    "topic": checks.topic,
    "type": checks.message_type("geometry_msgs/Twist", "geometry_msgs/TwistStamped"),
    "stops_within": checks.above_zero("seconds"),
    "v_max": checks.above_zero("metres per second"),
    "w_max": checks.above_zero("radians per second"),
    "a_max": checks.above_zero("metres per second squared"),
    "holonomic": checks.yes_or_no,
    "stop_hooks": lambda value: value,  # read with the way to each of them
}
TF: dict[str, Check] = {
    "map_frame": checks.text,
    "base_frame": checks.text,
    "namespace": checks.topic,
    "quiet": checks.yes_or_no,
}
MOVE: dict[str, Check] = {
    "topic": checks.topic,
    "frame": checks.text,
    "cancel_topic": checks.topic,
    "on_operator_loss": checks.one_of("continue", "cancel"),
    "action": checks.topic,
    "action_type": checks.message_type(
        "nav2_msgs/NavigateToPose", "move_base_msgs/MoveBaseAction"
    ),
}
INITIAL_POSE: dict[str, Check] = {
    "topic": checks.topic,
    "covariance": checks.covariance,
}
ROBOT = (
    "name",
    "bridge",
    "base_link",
    "odometry",
    "tf",
    "alignment",
    "twist",
    "move",
    "initial_pose",
    "scan",
    "scan_assist",
    "battery",
    "cameras",
    "buttons",
    "modules",
)
MODULE = ("name", "args", "options")


@dataclass(slots=True)
class ModuleLine:
    """One module of a robot."""

    name: str
    args: list[Any]
    options: dict[str, Any]
    path: Path


@dataclass(slots=True)
class RobotLine:
    """One robot of a file."""

    name: str
    bridge: str
    path: Path
    base_link: str = "base_link"
    odometry: dict[str, Any] | None = None
    tf: dict[str, Any] | None = None
    alignment: Alignment | None = None
    twist: dict[str, Any] | None = None
    move: dict[str, Any] | None = None
    initial_pose: dict[str, Any] | None = None
    scans: list[str] = field(default_factory=list)
    scan_assist: dict[str, Any] | None = None
    battery: str = ""
    cameras: list[CameraLine] = field(default_factory=list)
    buttons: list[dict[str, Any]] = field(default_factory=list)
    modules: list[ModuleLine] = field(default_factory=list)


@dataclass(slots=True)
class Fleet:
    """What a file says."""

    bridges: dict[str, str] = field(default_factory=dict)
    """Addresses by name."""

    alignments: dict[str, Alignment] = field(default_factory=dict)
    """Of bridges, by name."""

    robots: list[RobotLine] = field(default_factory=list)
    title: str = ""
    floor: str = ""
    map: tuple[str, str] | None = None
    """The map under the robots: the name of a bridge, and a topic."""

    tiles: dict[str, Any] | None = None
    labels: Places | None = None


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
    for key in ("title", "floor"):
        if key in data:
            setattr(fleet, key, checks.one(checks.text, data[key], (key,), mistakes))
    fleet.bridges, fleet.alignments = _bridges(data.get("bridges"), mistakes)
    if "map" in data:
        fleet.map = _map(data["map"], fleet.bridges, mistakes)
    if "tiles" in data:
        fleet.tiles = read_tiles(data["tiles"], ("tiles",), mistakes)
    if "labels" in data:
        fleet.labels = read_places(data["labels"], ("labels",), mistakes)
    robots = data.get("robots")
    if not isinstance(robots, list) or not robots:
        got = "nothing" if robots is None else checks.show(robots)
        mistakes.add(("robots",), f"got {got}, expected a table [[robots]] for each")
        return fleet
    for index, value in enumerate(robots):
        fleet.robots.append(_robot(value, ("robots", index), fleet.bridges, mistakes))
    _no_name_twice(fleet.robots, mistakes)
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
        else:
            urls[name] = checks.one(_address, bridge, path, mistakes) or ""
    return urls, alignments


def _map(
    value: Any, bridges: dict[str, str], mistakes: Mistakes
) -> tuple[str, str] | None:
    path: Path = ("map",)
    known: dict[str, Check] = {
        "bridge": lambda name: _known_bridge(name, bridges),
        "topic": checks.topic,
    }
    if isinstance(value, dict) and "bridge" not in value and len(bridges) == 1:
        value = {"bridge": next(iter(bridges)), **value}
    meant = checks.table(value, known, path, mistakes, needed=("bridge", "topic"))
    return (str(meant.get("bridge")), str(meant.get("topic")))


def _address(value: Any) -> str:
    try:
        return normalise_url(value)
    except ConfigError:
        raise ConfigError(
            'the address of a rosbridge, such as "ws://robot:9090"'
        ) from None


def _robot(
    value: Any, path: Path, bridges: dict[str, str], mistakes: Mistakes
) -> RobotLine:
    robot = RobotLine("", "", path)
    if not isinstance(value, dict):
        mistakes.add(path, f"got {checks.show(value)}, expected a table [[robots]]")
        return robot
    for key in value:
        if key not in ROBOT:
            checks.unknown(key, ROBOT, (*path, key), mistakes)
    if "name" not in value:
        mistakes.add(path, 'the key "name" is missing')
    robot.bridge = _bridge(value, path, bridges, mistakes)
    for key in ("name", "base_link"):
        if key in value:
            got = checks.one(checks.text, value[key], (*path, key), mistakes)
            setattr(robot, key, got or "")
    known = {
        "odometry": ODOMETRY,
        "twist": TWIST,
        "move": MOVE,
        "initial_pose": INITIAL_POSE,
    }
    for key, fields in known.items():
        if key in value:
            setattr(robot, key, _topic(value[key], fields, (*path, key), mistakes))
    if robot.twist is not None and "stop_hooks" in robot.twist:
        where = (*path, "twist", "stop_hooks")
        hooks = read_hooks(robot.twist["stop_hooks"], where, mistakes)
        robot.twist["stop_hooks"] = hooks
    if "scan_assist" in value:
        where = (*path, "scan_assist")
        driven = "twist" in value
        robot.scan_assist = read_assist(value["scan_assist"], where, driven, mistakes)
    if "tf" in value:
        robot.tf = _frames(value["tf"], (*path, "tf"), mistakes)
    if "alignment" in value:
        where = (*path, "alignment")
        robot.alignment = checks.one(alignment, value["alignment"], where, mistakes)
    if "battery" in value:
        where = (*path, "battery")
        robot.battery = checks.one(checks.topic, value["battery"], where, mistakes)
    if "scan" in value:
        robot.scans = _scans(value["scan"], (*path, "scan"), mistakes)
    if "cameras" in value:
        where = (*path, "cameras")
        robot.cameras = read_cameras(value["cameras"], where, mistakes)
    if "buttons" in value:
        robot.buttons = read_buttons(value["buttons"], (*path, "buttons"), mistakes)
    robot.modules = _modules(
        value.get("modules", []), (*path, "modules"), bridges, mistakes
    )
    return robot


def _bridge(
    value: dict[str, Any], path: Path, bridges: dict[str, str], mistakes: Mistakes
) -> str:
    if "bridge" not in value:
        if len(bridges) == 1:
            return next(iter(bridges))
        mistakes.add(path, 'the key "bridge" is missing: there are several bridges')
        return ""
    name = value["bridge"]
    where = (*path, "bridge")
    checks.one(lambda got: _known_bridge(got, bridges), name, where, mistakes)
    return name if isinstance(name, str) else ""


def _known_bridge(name: Any, bridges: dict[str, str]) -> str:
    if not isinstance(name, str) or name not in bridges:
        listed = ", ".join(bridges) or "none"
        raise ConfigError(
            f"the name of a bridge ({listed}){checks.near(name, bridges)}"
        )
    return name


def _topic(
    value: Any, fields: dict[str, Check], path: Path, mistakes: Mistakes
) -> dict[str, Any]:
    """Take a topic's name, or a table with it and more."""
    if isinstance(value, dict):
        # Goals may go to an action alone; elsewhere that key is unknown.
        needed = () if "action" in value else ("topic",)
        return checks.table(value, fields, path, mistakes, needed=needed)
    return {"topic": checks.one(checks.topic, value, path, mistakes)}


def _frames(value: Any, path: Path, mistakes: Mistakes) -> dict[str, Any] | None:
    """Take true or false, or a table with more."""
    if isinstance(value, bool):
        return {} if value else None
    if isinstance(value, dict):
        return checks.table(value, TF, path, mistakes)
    got = checks.show(value)
    mistakes.add(path, f"got {got}, expected true, false or a table")
    return None


def _scans(value: Any, path: Path, mistakes: Mistakes) -> list[str]:
    listed = value if isinstance(value, list) else [value]
    return [
        checks.one(
            checks.topic,
            each,
            (*path, index) if isinstance(value, list) else path,
            mistakes,
        )
        for index, each in enumerate(listed)
    ]


def _modules(
    value: Any, path: Path, bridges: dict[str, str], mistakes: Mistakes
) -> list[ModuleLine]:
    if not isinstance(value, list):
        mistakes.add(path, f"got {checks.show(value)}, expected an array of tables")
        return []
    return [
        _module(each, (*path, index), bridges, mistakes)
        for index, each in enumerate(value)
    ]


def _module(
    value: Any, path: Path, bridges: dict[str, str], mistakes: Mistakes
) -> ModuleLine:
    meant = checks.table(
        value,
        {"name": checks.text, "args": _array, "options": _table},
        path,
        mistakes,
        needed=("name",),
    )
    args, options = meant.get("args") or [], meant.get("options") or {}
    for key, each in [*enumerate(args), *options.items()]:
        if isinstance(each, dict) and set(each) == {"bridge"}:
            kind = "args" if isinstance(key, int) else "options"
            where = (*path, kind, key, "bridge")
            checks.one(
                lambda got: _known_bridge(got, bridges), each["bridge"], where, mistakes
            )
    return ModuleLine(meant.get("name") or "", args, options, path)


def _array(value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise ConfigError("an array of arguments")
    return value


def _table(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ConfigError("a table of arguments by name")
    return value


def _no_name_twice(robots: list[RobotLine], mistakes: Mistakes) -> None:
    first: dict[str, RobotLine] = {}
    for robot in robots:
        other = first.setdefault(same_name(robot.name), robot)
        if other is not robot and robot.name:
            mistakes.add(
                (*robot.path, "name"),
                f'got the text "{robot.name}", expected a name that differs from '
                f'"{other.name}" by more than case and Unicode form',
            )
