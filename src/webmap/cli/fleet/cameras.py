"""The cameras of a robot in a fleet file: by topic, or by address on the web."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from webmap.cli.fleet import checks
from webmap.cli.fleet.checks import Check, Mistakes
from webmap.cli.fleet.lines import Path
from webmap.discovery.naming import same_name
from webmap.errors import ConfigError
from webmap.ros.image_address import EXAMPLE, parse_address

if TYPE_CHECKING:
    from webmap import Bridge, Robot


@dataclass(frozen=True, slots=True)
class CameraLine:
    """One camera: a topic, or an address."""

    name: str
    topic: str = ""
    url: str = ""
    throttle: int | None = None


def _address(value: Any) -> str:
    try:
        parse_address(value)
    except ConfigError:
        raise ConfigError(f'the address of a camera, such as "{EXAMPLE}"') from None
    return str(value)


FIELDS: dict[str, Check] = {
    "topic": checks.topic,
    "url": _address,
    "name": checks.text,
    "throttle": checks.milliseconds,
}


def read_cameras(value: Any, path: Path, mistakes: Mistakes) -> list[CameraLine]:
    """Return the cameras of one robot; what is wrong is noted.

    Args:
        value: A topic, an address, a table with more, or an array of those.
        path: Where it stands.
        mistakes: Where every mistake goes.

    """
    if not isinstance(value, list):
        meant = [(value, path)]
    else:
        meant = [(each, (*path, index)) for index, each in enumerate(value)]
    cameras: list[CameraLine] = []
    for number, (each, where) in enumerate(meant, 1):
        otherwise = "Camera" if len(meant) == 1 else f"Camera {number}"
        camera = _camera(each, where, mistakes, otherwise)
        if any(same_name(camera.name) == same_name(other.name) for other in cameras):
            mistakes.add(
                where,
                f'a second camera is called "{camera.name}"; give each its own name',
            )
        cameras.append(camera)
    return cameras


def _camera(value: Any, path: Path, mistakes: Mistakes, name: str) -> CameraLine:
    if isinstance(value, str):
        value = {"url" if "://" in value else "topic": value}
        table = checks.table(value, FIELDS, path[:-1], Mistakes())
        if None in table.values():
            got = checks.show(next(iter(value.values())))
            mistakes.add(path, f"got {got}, expected {_EITHER}")
        return CameraLine(name, table.get("topic") or "", table.get("url") or "")
    if not isinstance(value, dict):
        mistakes.add(path, f"got {checks.show(value)}, expected {_EITHER}, or a table")
        return CameraLine(name)
    table = checks.table(value, FIELDS, path, mistakes)
    if ("topic" in value) == ("url" in value):
        mistakes.add(path, 'a camera has either a "topic" or a "url"')
    return CameraLine(
        table.get("name") or name,
        table.get("topic") or "",
        table.get("url") or "",
        table.get("throttle"),
    )


_EITHER = f'a topic, or an address such as "{EXAMPLE}"'


def add_cameras(robot: "Robot", bridge: "Bridge", cameras: list[CameraLine]) -> None:
    """Give a robot its cameras."""
    for camera in cameras:
        more = {} if camera.throttle is None else {"throttle": camera.throttle}
        if camera.url:
            robot.add_module("HttpCamera", camera.url, camera.name, **more)
        elif camera.topic:
            robot.add_module("Camera", bridge, camera.topic, camera.name, **more)
