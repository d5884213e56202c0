"""What a fleet file says of stop hooks and scan assist."""

from typing import Any

from webmap.cli.fleet import checks
from webmap.cli.fleet.checks import Check, Mistakes
from webmap.cli.fleet.lines import Path
from webmap.errors import ConfigError
from webmap.ros.names import normalise_topic


def read_hooks(value: Any, path: Path, mistakes: Mistakes) -> list[dict[str, str]]:
    """Return the stop hooks that an array of tables says; what is wrong is noted."""
    if not isinstance(value, list):
        expected = 'an array such as [{topic = "/lock"}]'
        mistakes.add(path, f"got {checks.show(value)}, expected {expected}")
        return []
    return [_hook(each, (*path, index), mistakes) for index, each in enumerate(value)]


def _hook(value: Any, path: Path, mistakes: Mistakes) -> dict[str, str]:
    if not isinstance(value, dict):
        expected = 'a table such as {topic = "/lock"} or {service = "/e_stop"}'
        mistakes.add(path, f"got {checks.show(value)}, expected {expected}")
        return {}
    if ("topic" in value) == ("service" in value):
        mistakes.add(path, 'expected the key "topic" or the key "service", one of them')
        return {}
    place = "topic" if "topic" in value else "service"
    type = "std_msgs/Bool" if place == "topic" else "std_srvs/Trigger"
    known: dict[str, Check] = {place: _name, "type": checks.message_type(type)}
    return checks.table(value, known, path, mistakes)


def _name(value: Any) -> str:
    try:
        return normalise_topic(value)
    except ConfigError:
        raise ConfigError('a name, such as "/lock"') from None


def read_assist(
    value: Any, path: Path, driven: bool, mistakes: Mistakes
) -> dict[str, Any]:
    """Return the arguments of ``set_scan_assist`` that a table says.

    Args:
        value: The table.
        path: The way to it.
        driven: Whether the robot has a topic for velocity.
        mistakes: Where what is wrong goes.

    """
    if not driven:
        mistakes.add(
            path, 'scan assist slows a driven robot: the key "twist" is missing'
        )
    return checks.table(value, ASSIST, path, mistakes, needed=("topic", "footprint"))


def _footprint(value: Any) -> Any:
    if _number(value) and value > 0:
        return float(value)
    corners = value if isinstance(value, list) else []
    pairs = [
        tuple(map(float, corner))
        for corner in corners
        if isinstance(corner, list) and len(corner) == 2 and all(map(_number, corner))
    ]
    if len(pairs) < 3 or len(pairs) < len(corners):
        raise ConfigError(
            "the robot's radius in metres, above 0, or 3 corners of its outline or "
            "more, such as [[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]]"
        )
    return pairs


def _any(unit: str) -> Check:
    def check(value: Any) -> float:
        if not _number(value):
            raise ConfigError(f"a number of {unit}")
        return float(value)

    return check


def _from_zero(unit: str) -> Check:
    def check(value: Any) -> float:
        if not _number(value) or value < 0:
            raise ConfigError(f"a number of {unit} from 0 on")
        return float(value)

    return check


def _number(value: Any) -> bool:
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return abs(value) <= checks.LARGEST  # which no infinity is, and no NaN


ASSIST: dict[str, Check] = {
    "topic": checks.topic,
    "footprint": _footprint,
    "x": _any("metres"),
    "y": _any("metres"),
    "angle": _any("degrees"),
    "upside_down": checks.yes_or_no,
    "frame": checks.text,
    "stop_distance": _from_zero("metres"),
    "brake": checks.above_zero("metres per second squared"),
    "blind": checks.one_of("stop", "creep"),
    "creep": _from_zero("metres per second"),
}
