"""The robots behind bridges, found or told, as the console takes them."""

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import click

from webmap.cli.described import describe, overrules
from webmap.cli.draw_layer import shared_map
from webmap.cli.finding import find
from webmap.cli.overruling import Overruling
from webmap.console import RobotDescription
from webmap.discovery import FoundRobot
from webmap.discovery.words import in_one_line, robot_table
from webmap.errors import BridgeClosed

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

    overruling: Overruling = field(default_factory=Overruling)
    """What was said of robots better than it was guessed."""

    def table(self) -> str:
        """Return what the page would use, and why, for people."""
        lines = [f"{about.name} (told with --robot)" for about in self.told]
        for robot, about in self.robots:
            lines += ["", f"behind {about.bridge.url}:", *robot_table(robot)]
        return "\n".join(lines).lstrip("\n") or "No robot is known."

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
                late.show_grid(about.bridge, shared_map(robot))
            late.add(robot, about)
        names = [about.name for about in self.told]
        names += [robot.name for robot, _ in self.robots]
        came = greet(
            late, names, self.stops_within, grid=grid, overruling=self.overruling
        )
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
    topics: Mapping[str, str] | None = None,
    overruling: Overruling | None = None,
) -> FoundFleet:
    """Return the robots behind bridges, and say on standard error what was found.

    Args:
        bridges: The bridges.
        told: Robots that were told by hand; each takes the place of one found.
        wait: How long to wait for a bridge that cannot be reached, in seconds.
        stops_within: Seconds within which every base stops by itself, if known.
        topics: Types by topic, where the bridge cannot be asked for them.
        overruling: What was said of robots better than it is guessed.

    Raises:
        ConfigError: If something was said of a robot that there is not.

    """
    overruling = overruling or Overruling()
    found = asyncio.run(
        find([bridge.url for bridge in bridges], wait=wait, topics=topics)
    )
    names = [robot.name for one in found for robot in one.findings.robots]
    missing = any(isinstance(one.trouble, BridgeClosed) for one in found)
    names += [robot.name for robot in told]
    for sentence in overruling.check(names, all_known=not missing):
        click.echo(sentence, err=True)
    fleet = FoundFleet([*overruling.tell(told)], stops_within, overruling=overruling)
    for bridge, one in zip(bridges, found, strict=True):
        if one.why:
            click.echo(one.why, err=True)
        for robot in overruling.findings(bridge.url, one.findings).robots:
            about = describe(robot, bridge, stops_within=stops_within)
            if any(overrules(other, about) for other in fleet.told):
                continue
            click.echo(f"Found {in_one_line(robot)}", err=True)
            fleet.robots.append((robot, about))
        fleet.known.append((bridge, one.findings.robots))
    return fleet
