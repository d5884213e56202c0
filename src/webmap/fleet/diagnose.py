"""The robots that ``webmap doctor`` checks, if a person configured them."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TypeAlias

import click

from webmap.discovery import Findings
from webmap.discovery.doctor import MeantRobot
from webmap.discovery.found import ROLES, FoundRobot, Role
from webmap.ros.names import normalise_url

Meant: TypeAlias = Callable[[Findings], Sequence[MeantRobot]]
"""Returns the robots as they were configured, from the findings of a bridge."""


def bridges_of(
    given: Sequence[str], robots: Sequence[str], settings: Sequence[str]
) -> list[tuple[str, Meant]]:
    """Return each bridge to check, with the settings for the robots behind it.

    Args:
        given: The addresses of bridges, or one fleet file.
        robots: The values of ``--robot``.
        settings: The values of ``--set``.

    Raises:
        UsageError: If ``--robot`` or ``--set`` is given with several bridges, or with
            a fleet file, which has these settings itself.
        ConfigError: If a setting does not fit the robots.
        OSError: If the file cannot be read.

    """
    files = [text for text in given if _is_file(text)]
    said = bool(robots or settings)
    if files and (said or len(given) > 1):
        raise click.UsageError(
            f"{files[0]} configures the bridges and the robots; leave out --robot, "
            "--set and other addresses"
        )
    if files:
        return _of_file(Path(files[0]))
    if said and len(given) > 1:
        raise click.UsageError(
            f"--robot and --set apply to the robots of one bridge, got {len(given)} "
            "bridges; run the command once for each bridge"
        )
    meant = _said(given[0], robots, settings) if said else _always(())
    return [(normalise_url(text), meant) for text in given]


def _is_file(text: str) -> bool:
    return text.lower().endswith(".toml") and "://" not in text


def _always(robots: Sequence[MeantRobot]) -> Meant:
    return lambda _found: robots


def _of_file(file: Path) -> list[tuple[str, Meant]]:
    from webmap.features.doctor.in_use import Made, in_use
    from webmap.fleet.made import prepare

    ready = prepare(file)
    maps: list[Made] = []
    for grid in ready.fleet.map:
        where = (ready.bridges[grid.bridge], grid.topic)
        maps.append(("OccupancyGrid", where, {"palette": grid.palette}))
    return [
        (bridge.url, _always(in_use(ready.robots, bridge, maps)))
        for bridge in ready.bridges.values()
    ]


def _said(url: str, robots: Sequence[str], settings: Sequence[str]) -> Meant:
    import webmap
    from webmap.fleet.overrides import Overruling, parse_setting
    from webmap.fleet.stated import told_robots

    overruling = Overruling([parse_setting(text) for text in settings])
    told = told_robots(robots, [webmap.Bridge(url)])
    if told:
        overruling.check([robot.found.name for robot in told], all_known=True)
        return _always([_of_told(robot) for _, robot in overruling.tell(told)])

    def overruled(found: Findings) -> Sequence[MeantRobot]:
        overruling.check([robot.name for robot in found.robots], all_known=True)
        better = overruling.findings(normalise_url(url), found).robots
        pairs = zip(found.robots, better, strict=True)
        return [_of_found(robot, there) for there, robot in pairs]

    return overruled


def _of_told(robot: FoundRobot) -> MeantRobot:
    """Return a robot of ``--robot``; its other roles are as discovery found them."""
    from webmap.fleet.overrides import TOLD

    roles: list[Role] = ["pose", *TOLD]
    if not robot.topic("odometry"):
        roles.append("tf")  # drawn by frames only if odometry names the frame
    return MeantRobot(robot.name, _topics(robot, roles))


def _of_found(robot: FoundRobot, there: FoundRobot) -> MeantRobot:
    """Return the roles of a found robot that the settings change."""
    roles = [r for r in ROLES if robot.guesses.get(r) != there.guesses.get(r)]
    topics = _topics(robot, roles)
    return MeantRobot(robot.name, topics, robot.base_frame, found_as=there.name)


def _topics(
    robot: FoundRobot, roles: Iterable[Role]
) -> dict[Role, tuple[tuple[str, str], ...]]:
    return {
        role: tuple((each.topic, each.type) for each in robot.guesses.get(role, ()))
        for role in roles
    }
