"""Reading one robot of a fleet file."""

from typing import Any

from webmap.cli.fleet import checks
from webmap.cli.fleet.alignments import alignment
from webmap.cli.fleet.buttons import read_buttons
from webmap.cli.fleet.cameras import read_cameras
from webmap.cli.fleet.checks import Check, Mistakes
from webmap.cli.fleet.lines import Path
from webmap.cli.fleet.pictures import read_picture
from webmap.cli.fleet.schema import (
    INITIAL_POSE,
    MOVE,
    ODOMETRY,
    ROBOT,
    TF,
    TWIST,
    ModuleLine,
    RobotLine,
)
from webmap.cli.fleet.stopping import read_assist, read_hooks
from webmap.errors import ConfigError


def read_robot(
    value: Any, path: Path, bridges: dict[str, str], mistakes: Mistakes
) -> RobotLine:
    """Return what one of the tables ``[[robots]]`` means; mistakes are noted."""
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
    for key, check in (("name", checks.name), ("base_link", checks.text)):
        if key in value:
            got = checks.one(check, value[key], (*path, key), mistakes)
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
    if "picture" in value:
        robot.picture = read_picture(value["picture"], (*path, "picture"), mistakes)
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
    robot.modules = read_modules(
        value.get("modules", []), (*path, "modules"), bridges, mistakes
    )
    return robot


def _bridge(
    value: dict[str, Any], path: Path, bridges: dict[str, str], mistakes: Mistakes
) -> str:
    if "bridge" not in value:
        if len(bridges) == 1:
            return next(iter(bridges))
        if not bridges:  # which is a mistake of its own
            return ""
        mistakes.add(path, 'the key "bridge" is missing: there are several bridges')
        return ""
    name = value["bridge"]
    where = (*path, "bridge")
    checks.one(lambda got: known_bridge(got, bridges), name, where, mistakes)
    return name if isinstance(name, str) else ""


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


def read_modules(
    value: Any, path: Path, bridges: dict[str, str], mistakes: Mistakes
) -> list[ModuleLine]:
    """Return what an array of modules means; mistakes are noted."""
    if not isinstance(value, list):
        way = ".".join(str(part) for part in path if isinstance(part, str))
        mistakes.add(
            path,
            f"got {checks.show(value)}, expected an array of tables: [[{way}]] in two "
            "brackets for each",
        )
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
                lambda got: known_bridge(got, bridges), each["bridge"], where, mistakes
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


def known_bridge(name: Any, bridges: dict[str, str]) -> str:
    """Let the name of a bridge of the file pass.

    Raises:
        ConfigError: If there is none of that name.

    """
    if not isinstance(name, str) or name not in bridges:
        listed = ", ".join(bridges) or "none"
        raise ConfigError(
            f"the name of a bridge ({listed}){checks.near(name, bridges)}"
        )
    return name
