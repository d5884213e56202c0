"""From a fleet file to robots."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import webmap
from webmap.cli.fleet import checks
from webmap.cli.fleet.alignments import align_bridges
from webmap.cli.fleet.cameras import add_cameras
from webmap.cli.fleet.checks import Mistakes
from webmap.cli.fleet.pictures import picture_of
from webmap.cli.fleet.schema import Fleet, ModuleLine, RobotLine
from webmap.console import RobotDescription
from webmap.console.fleet import make_robot
from webmap.core.module_arguments import WrongArgument, WrongArguments
from webmap.core.registry import robot_modules
from webmap.discovery.drawing import scan_name
from webmap.errors import WebMapError

if TYPE_CHECKING:
    from webmap import Bridge, Robot


def make_bridges(fleet: Fleet) -> dict[str, "Bridge"]:
    """Return the bridges of a file, by name."""
    bridges = {
        name: webmap.Bridge(url, name=name) for name, url in fleet.bridges.items()
    }
    align_bridges(fleet.alignments, bridges)
    return bridges


def make_robots(
    fleet: Fleet, bridges: Mapping[str, "Bridge"], folder: Path, mistakes: Mistakes
) -> list["Robot"]:
    """Return the robots of a file; what a robot or a module refuses is noted.

    Args:
        fleet: What the file says.
        bridges: Its bridges, by name.
        folder: The file's own, in which the robots' pictures are looked for.
        mistakes: Where what is wrong goes.

    """
    return [_robot(line, bridges, folder, mistakes) for line in fleet.robots]


def _robot(
    line: RobotLine, bridges: Mapping[str, "Bridge"], folder: Path, mistakes: Mistakes
) -> "Robot":
    bridge = bridges[line.bridge]
    first, *others = line.scans or [""]
    picture = None
    if line.picture is not None:
        picture = picture_of(line.picture, folder, mistakes)
    robot = make_robot(
        RobotDescription(
            name=line.name,
            bridge=bridge,
            scan=first,
            battery=line.battery,
            picture=picture,
        )
    )
    robot.base_link = line.base_link
    if line.alignment is not None:
        robot.set_alignment(*line.alignment)
    for number, topic in enumerate(others, 2):
        scanner = robot.add_module(
            "LaserScanner",
            bridge,
            topic,
            max_dots=None,
            throttle=100,
            name=scan_name(number),
        )
        robot.svg.insert(1, scanner.svg)
    setters: dict[str, tuple[dict[str, Any] | None, Callable[..., None]]] = {
        "odometry": (line.odometry, robot.set_odometry_topic),
        "tf": (line.tf, robot.set_tf),
        "twist": (line.twist, robot.set_twist_topic),
        "move": (line.move, robot.set_move_topic),
        "scan_assist": (
            line.scan_assist,
            lambda bridge, **options: robot.set_scan_assist(**options),
        ),
        "initial_pose": (line.initial_pose, robot.set_initial_pose_topic),
    }
    for key, (options, setter) in setters.items():
        if options is not None:
            try:
                setter(bridge, **options)
            except WebMapError as error:
                mistakes.add((*line.path, key), str(error))
    if line.buttons:
        try:
            robot.add_module("Buttons", bridge, line.buttons)
        except WebMapError as error:
            mistakes.add((*line.path, "buttons"), str(error))
    add_cameras(robot, bridge, line.cameras)
    for module in line.modules:
        _add_module(robot, module, bridges, mistakes)
    return robot


def _add_module(
    robot: "Robot",
    module: ModuleLine,
    bridges: Mapping[str, "Bridge"],
    mistakes: Mistakes,
) -> None:
    args = [meant(value, bridges) for value in module.args]
    options = {key: meant(value, bridges) for key, value in module.options.items()}
    try:
        robot_modules[module.name]
    except WebMapError as error:
        mistakes.add((*module.path, "name"), str(error))
        return
    try:
        robot.add_module(module.name, *args, **options)
    except WrongArguments as error:
        for wrong in error.wrong:
            mistakes.add((*module.path, *wrong.way), in_words(module, wrong))
    except WebMapError as error:
        # What a module says of a value begins with the name of the argument.
        key = str(error).partition(" ")[0].rstrip(":")
        way = ("options", key) if key in options else ()
        mistakes.add((*module.path, *way), f"{module.name}: {error}")
    except Exception as error:  # a module of somebody else's may raise anything
        said = f"{type(error).__name__}: {error}"
        mistakes.add(module.path, f"{module.name} refused its arguments: {said}")


def in_words(module: ModuleLine, wrong: WrongArgument) -> str:
    """Return what is wrong with an argument, as a fleet file's reader says it."""
    if not wrong.got:
        return f"{module.name}: {wrong.words}"
    expected = wrong.words
    if expected == "a Bridge":
        expected = 'a bridge, such as { bridge = "hall" }'
    of = f", for {wrong.name} of {module.name}"
    return f"got {checks.show(wrong.got[0])}, expected {expected}{of}"


def meant(value: Any, bridges: Mapping[str, "Bridge"]) -> Any:
    """Return an argument, and for ``{ bridge = "north" }`` that bridge."""
    if isinstance(value, dict) and set(value) == {"bridge"}:
        return bridges[value["bridge"]]
    return value
