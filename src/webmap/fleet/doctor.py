"""The robots that ``webmap doctor`` checks, if a person configured them."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TypeAlias

import click

from webmap.discovery import Findings
from webmap.discovery.doctor import ConfiguredRobot
from webmap.discovery.findings import ROLES, FoundRobot, TopicRole
from webmap.ros.names import normalise_url

Configured: TypeAlias = Callable[[Findings], Sequence[ConfiguredRobot]]
"""Returns the robots as they were configured, from the findings of a bridge."""


def bridges_of(
    given: Sequence[str], robots: Sequence[str], settings: Sequence[str]
) -> list[tuple[str, Configured]]:
    """Return each bridge to check, with the settings for the robots behind it.

    The addresses of routers are returned as they are.

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
    has_settings = bool(robots or settings)
    if files and (has_settings or len(given) > 1):
        raise click.UsageError(
            f"{files[0]} configures the bridges and the robots; leave out --robot, "
            "--set and other addresses"
        )
    if files:
        return _of_file(Path(files[0]))
    if has_settings and len(given) > 1:
        raise click.UsageError(
            f"--robot and --set apply to the robots of one bridge, got {len(given)} "
            "bridges; run the command once for each bridge"
        )
    configured = (
        _with_options(given[0], robots, settings) if has_settings else _always(())
    )
    return [(normalise_url(text), configured) for text in given]


def _is_file(text: str) -> bool:
    return text.lower().endswith(".toml") and "://" not in text


def _always(robots: Sequence[ConfiguredRobot]) -> Configured:
    return lambda _found: robots


def _of_file(file: Path) -> list[tuple[str, Configured]]:
    from webmap.features.doctor.configured_robots import (
        ModuleArguments,
        configured_robots,
    )
    from webmap.fleet.fleet_file import prepare

    ready = prepare(file)
    maps: list[ModuleArguments] = []
    for grid in ready.fleet.map:
        where = (ready.bridges[grid.bridge], grid.topic)
        maps.append(("OccupancyGrid", where, {"palette": grid.palette}))
    return [
        *(
            (bridge.url, _always(configured_robots(ready.robots, bridge, maps)))
            for bridge in ready.bridges.values()
        ),
        *((url, _always(())) for url in ready.agents),
    ]


def _with_options(
    url: str, robots: Sequence[str], settings: Sequence[str]
) -> Configured:
    import webmap
    from webmap.fleet.overrides import Overrides, parse_setting
    from webmap.fleet.robot_options import parse_robots

    overrides = Overrides([parse_setting(text) for text in settings])
    given = parse_robots(robots, [webmap.Bridge(url)])
    if given:
        overrides.check([robot.found.name for robot in given], all_known=True)
        return _always(
            [_from_given(robot) for _, robot in overrides.apply_to_options(given)]
        )

    def overridden(found: Findings) -> Sequence[ConfiguredRobot]:
        overrides.check([robot.name for robot in found.robots], all_known=True)
        better = overrides.findings(normalise_url(url), found).robots
        pairs = zip(found.robots, better, strict=True)
        return [_of_found(robot, there) for there, robot in pairs]

    return overridden


def _from_given(robot: FoundRobot) -> ConfiguredRobot:
    """Return a robot of ``--robot``; its other roles are as discovery found them."""
    from webmap.fleet.overrides import SETTABLE_ROLES

    roles: list[TopicRole] = ["pose", *SETTABLE_ROLES]
    if not robot.topic("odometry"):
        roles.append("tf")  # drawn by frames only if odometry names the frame
    return ConfiguredRobot(robot.name, _topics(robot, roles))


def _of_found(robot: FoundRobot, there: FoundRobot) -> ConfiguredRobot:
    """Return the roles of a found robot that the settings change."""
    roles = [r for r in ROLES if robot.guesses.get(r) != there.guesses.get(r)]
    topics = _topics(robot, roles)
    return ConfiguredRobot(robot.name, topics, robot.base_frame, found_as=there.name)


def _topics(
    robot: FoundRobot, roles: Iterable[TopicRole]
) -> dict[TopicRole, tuple[tuple[str, str], ...]]:
    return {
        role: tuple((each.topic, each.type) for each in robot.guesses.get(role, ()))
        for role in roles
    }
