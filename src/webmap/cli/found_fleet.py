"""The robots behind bridges, found or told, as the console takes them."""

import asyncio
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from webmap.cli.described import describe, overrules
from webmap.cli.draw_layer import meant, shared_map
from webmap.cli.echo import echo
from webmap.cli.finding import Found, find
from webmap.cli.names import set_twice
from webmap.cli.overruling import TOLD, Overruling
from webmap.cli.told import offer
from webmap.console import RobotDescription
from webmap.discovery import FoundRobot
from webmap.discovery.layers import FoundLayer
from webmap.discovery.naming import free_name, same_name
from webmap.discovery.rules import VELOCITY
from webmap.discovery.words import OVERRULE, drawn_table, in_one_line, robot_table
from webmap.errors import BridgeClosed
from webmap.outside_text import escaped
from webmap.ros.names import is_topic, is_type, normalise_topic

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

    behind: "dict[Bridge, Found]" = field(default_factory=dict)
    """What was found behind each bridge, before anybody said anything."""

    overruling: Overruling = field(default_factory=Overruling)
    """What was said of robots better than it was guessed."""

    def table(self, *, grid: bool, as_told: bool) -> str:
        """Return what the page would use and draw, and why, for people.

        Args:
            grid: Whether the robots' own maps are shown under them.
            as_told: Whether of robots that were told no more is drawn than that.

        """
        lines: list[str] = []
        taken: set[tuple[Bridge, str]] = set()
        for about in self.told:
            lines += ["", f"{about.name} (told with --robot)", *_told_table(about)]
            found = self.behind.get(about.bridge)
            if found is None or as_told:
                continue
            there = offer(about, found.topics, found.findings)
            if (about.bridge, there.namespace) not in taken:  # it is drawn once
                taken.add((about.bridge, there.namespace))
                layers = _on_page(there.layers, grid)
                lines += drawn_table(there.namespace, layers, there.left_out)
        for robot, about in self.robots:
            lines += ["", f"behind {about.bridge.url}:", *robot_table(robot)]
            findings = self.behind[about.bridge].findings
            space = robot.namespace
            guessed = next(r for r in findings.robots if r.namespace == space)
            fixed = self.overruling.fixed(about.bridge.url, guessed)
            layers = _on_page(meant(findings.layers[space], guessed, fixed), grid)
            lines += drawn_table(space, layers, findings.left_out[space])
        if self.robots:
            lines += ["", OVERRULE]
        return "\n".join(map(escaped, lines)).lstrip("\n") or "No robot is known."

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
            late,
            names,
            self.stops_within,
            grid=grid,
            overruling=self.overruling,
            told=self.told,
        )
        for bridge, found in self.behind.items():
            robots = found.findings.robots
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
        ConfigError: If something was said of a robot that there is not, or a person
            gave it the name of another.

    """
    overruling = overruling or Overruling()
    found = asyncio.run(
        find([bridge.url for bridge in bridges], wait=wait, topics=topics)
    )
    names = [robot.name for one in found for robot in one.findings.robots]
    missing = any(isinstance(one.trouble, BridgeClosed) for one in found)
    names += [robot.name for robot in told]
    for sentence in overruling.check(names, all_known=not missing):
        echo(sentence, err=True)
    fleet = FoundFleet([*overruling.tell(told)], stops_within, overruling=overruling)
    behind = {bridge: one.topics for bridge, one in zip(bridges, found, strict=True)}
    fleet.told = [_typed(robot, behind[robot.bridge]) for robot in fleet.told]
    taken = {same_name(other.name) for other in fleet.told}
    for bridge, one in zip(bridges, found, strict=True):
        if one.why:
            echo(one.why, err=True)
        for robot in overruling.findings(bridge.url, one.findings).robots:
            about = describe(robot, bridge, stops_within=stops_within)
            about = _typed(about, one.topics)
            if any(overrules(other, about) for other in fleet.told):
                continue
            if same_name(robot.name) in taken and overruling.names(robot.name):
                raise set_twice(robot.name)
            robot = replace(robot, name=free_name(robot.name, taken))
            about = replace(about, name=robot.name)
            echo(f"Found {in_one_line(robot)}", err=True)
            fleet.robots.append((robot, about))
        fleet.behind[bridge] = one
    return fleet


def told_fleet(
    bridges: Sequence["Bridge"], told: Sequence[RobotDescription], *, wait: float
) -> FoundFleet:
    """Return robots that were told, with what is behind their bridges besides.

    Says on standard error if a bridge does not tell that.

    Args:
        bridges: The bridges.
        told: The robots.
        wait: How long to wait for a bridge that cannot be reached, in seconds.

    """
    found = asyncio.run(find([bridge.url for bridge in bridges], wait=wait))
    for one in found:
        if one.trouble is not None:
            echo(
                f"{one.url}: {one.trouble}. No more is known of what can be drawn "
                f"than was told with --robot.",
                err=True,
            )
    return FoundFleet([*told], behind=dict(zip(bridges, found, strict=True)))


def _typed(about: RobotDescription, topics: Mapping[str, str]) -> RobotDescription:
    """Return a robot with the type of its velocity, if the topics behind it tell it."""
    if about.twist_type or not is_topic(about.twist):
        return about
    type = topics.get(normalise_topic(about.twist), "").strip()
    return replace(about, twist_type=type) if is_type(type, *VELOCITY) else about


def _told_table(about: RobotDescription) -> list[str]:
    """Return what was said of a robot, one role a line."""
    lines = []
    for role, name in TOLD.items():
        said = getattr(about, name)
        topics = [said] if isinstance(said, str) else said
        if role == "velocity" and said and about.twist_type:
            topics = [f"{said}  {about.twist_type}"]
        lines += [f"  {role:<11} {topic}" for topic in topics if topic]
    return lines


def _on_page(layers: Sequence[FoundLayer], grid: bool) -> list[FoundLayer]:
    """Return the layers without maps, where a floor plan is in their place."""
    return [layer for layer in layers if grid or layer.kind not in ("map", "grid")]
