"""The robots behind bridges, found or told, as the console takes them."""

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import click

from webmap.cli.described import describe, overrules
from webmap.cli.finding import find
from webmap.console import RobotDescription
from webmap.discovery import FoundRobot
from webmap.discovery.words import in_one_line

if TYPE_CHECKING:
    from webmap import Bridge
    from webmap.console import Console


@dataclass(slots=True)
class FoundFleet:
    """The robots that were found, and what is known when it is looked again."""

    told: list[RobotDescription]
    """Robots that were told by hand; the console has them already."""

    stops_within: float | None = None
    robots: list[tuple[FoundRobot, RobotDescription]] = field(default_factory=list)
    """Robots that were found, and the same as the console takes them."""

    known: list[tuple["Bridge", tuple[FoundRobot, ...]]] = field(default_factory=list)
    """For each bridge the robots that were found, also those told by hand."""

    def show(self, console: "Console", *, grid: bool) -> None:
        """Show what was found and what comes later.

        Args:
            console: The console, which has been opened.
            grid: Whether the robots' own map is shown under them.

        """
        from webmap.cli.latecomers import LateRobots, LookingForRobots, greet

        late = LateRobots(console)
        for robot, about in self.robots:
            if grid:
                late.show_grid(about.bridge, robot.topic("map"))
            late.add(robot, about)
        names = [about.name for about in self.told]
        names += [robot.name for robot, _ in self.robots]
        came = greet(late, names, self.stops_within, grid=grid)
        for bridge, robots in self.known:
            _services.append(LookingForRobots(bridge, robots, came))


_services: list[object] = []
"""What runs as long as the process does; nobody else holds it."""


def find_fleet(
    bridges: Sequence["Bridge"],
    told: Sequence[RobotDescription],
    *,
    wait: float,
    stops_within: float | None,
) -> FoundFleet:
    """Return the robots behind bridges, and say on standard error what was found.

    Args:
        bridges: The bridges.
        told: Robots that were told by hand; each takes the place of one found.
        wait: How long to wait for a bridge that cannot be reached, in seconds.
        stops_within: Seconds within which every base stops by itself, if known.

    """
    found = asyncio.run(find([bridge.url for bridge in bridges], wait=wait))
    fleet = FoundFleet([*told], stops_within)
    for bridge, one in zip(bridges, found, strict=True):
        if one.why:
            click.echo(one.why, err=True)
        for robot in one.findings.robots:
            about = describe(robot, bridge, stops_within=stops_within)
            if any(overrules(other, about) for other in told):
                continue
            click.echo(f"Found {in_one_line(robot)}", err=True)
            fleet.robots.append((robot, about))
        fleet.known.append((bridge, one.findings.robots))
    return fleet
