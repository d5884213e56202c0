"""The robots behind bridges, found or given with ``--robot``, for the console."""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from webmap.base.echo import echo
from webmap.base.errors import BridgeClosed
from webmap.base.text import escaped
from webmap.config.checks import same_name
from webmap.config.robot import RobotConfig
from webmap.discovery import FoundRobot
from webmap.discovery.findings import free_name
from webmap.discovery.rules import VELOCITY
from webmap.discovery.tables import OVERRULE, drawn_table, robot_table, summary_line
from webmap.fleet.find import Found, find
from webmap.fleet.given import Candidate, offer, set_twice
from webmap.fleet.overrides import SETTABLE_ROLES, Overrides
from webmap.fleet.shown import ShownRobot, ShownRobots
from webmap.fleet.watch import LookingForLayers, LookingForRobots, on_page
from webmap.ros.names import is_topic, is_type, normalise_topic

if TYPE_CHECKING:
    from webmap import Bridge
    from webmap.console import Console


@dataclass(slots=True)
class FoundFleet:
    """The robots that were found, and the data for later searches."""

    given: list[Candidate]
    """Robots given with ``--robot``; the console has them already."""

    robots: list[Candidate] = field(default_factory=list)
    """Robots that were found."""

    behind: "dict[Bridge, Found]" = field(default_factory=dict)
    """The findings of each bridge, before any settings."""

    overrides: Overrides = field(default_factory=Overrides)
    """The settings of robots."""

    def table(self, *, grid: bool, only_given: bool) -> str:
        """Return the topics that the page uses and draws, with reasons, for people.

        Args:
            grid: Whether the robots' own maps are shown under them.
            only_given: Whether only the topics given with ``--robot`` are drawn.

        """
        lines: list[str] = []
        taken: set[tuple[Bridge, str]] = set()
        for bridge, given in self.given:
            lines += ["", f"{given.name} (from --robot)", *_given_table(given)]
            found = self.behind.get(bridge)
            if found is None or only_given:
                continue
            there = offer(given, found.topics, found.findings)
            if (bridge, there.namespace) not in taken:  # it is drawn once
                taken.add((bridge, there.namespace))
                lines += drawn_table(there.namespace, on_page(there.layers, grid))
        for bridge, robot in self.robots:
            lines += ["", f"behind {bridge.url}:", *robot_table(robot)]
            findings = self.behind[bridge].findings
            space = robot.namespace
            guessed = next(r for r in findings.robots if r.namespace == space)
            layers = self.overrides.layers(bridge.url, findings, guessed)
            lines += drawn_table(space, on_page(layers, grid))
        if self.robots:
            lines += ["", OVERRULE]
        return "\n".join(map(escaped, lines)).lstrip("\n") or "No robot is known."

    def show(
        self,
        console: "Console",
        *,
        grid: bool = True,
        only_given: bool = False,
        topics: Mapping[str, str] | None = None,
    ) -> None:
        """Show the robots found now and later, and all their topics that can be drawn.

        Args:
            console: The console, opened with the robots given with ``--robot``.
            grid: Whether the robots' own maps are shown under them.
            only_given: Whether only the topics given with ``--robot`` are drawn.
            topics: Types by topic, if a bridge does not list them.

        """
        shown = ShownRobots(console, self.overrides, given=self.given, grid=grid)
        self._add_all(shown)
        config = self.overrides.config
        given = [
            ShownRobot(bridge, found, made, config(bridge.url, found))
            for (bridge, found), made in zip(self.given, console.given, strict=True)
            if not only_given
        ]
        bridges = dict.fromkeys([*self.behind, *(robot.bridge for robot in given)])
        for bridge in bridges:
            looking = LookingForLayers(bridge, shown, given=given, topics=topics)
            _services.append(looking)

    def hold(
        self,
        console: "Console",
        made_of: Callable[[RobotConfig], RobotConfig],
    ) -> ShownRobots:
        """Hold the robots found now and later, without a page.

        Args:
            console: Takes the maps under the robots.
            made_of: Returns the part of a configuration that a robot is made of here.

        """
        shown = ShownRobots(console, self.overrides, made_of=made_of)
        for robot in self.given:
            shown.add(robot)
        self._add_all(shown)
        for bridge in self.behind:
            _services.append(LookingForLayers(bridge, shown))
        return shown

    def _add_all(self, shown: ShownRobots) -> None:
        for robot in self.robots:
            shown.add(robot)
        for bridge, one in self.behind.items():
            robots = one.findings.robots
            _services.append(LookingForRobots(bridge, robots, shown.came))


_services: list[object] = []
"""Objects that live as long as the process; this list keeps them alive."""


def find_fleet(
    bridges: Sequence["Bridge"],
    given: Sequence[Candidate],
    *,
    wait: float,
    topics: Mapping[str, str] | None = None,
    overrides: Overrides | None = None,
) -> FoundFleet:
    """Return the robots behind bridges, and print the findings on standard error.

    Args:
        bridges: The bridges.
        given: Robots given with ``--robot``; each replaces the found robot.
        wait: How long to wait for an unreachable bridge, in seconds.
        topics: Types by topic, if the bridge does not list them.
        overrides: The settings of robots.

    Raises:
        ConfigError: If a setting names a robot that does not exist, or gives a robot
            the name of another one.

    """
    overrides = overrides or Overrides()
    found = asyncio.run(
        find([bridge.url for bridge in bridges], wait=wait, topics=topics)
    )
    names = [robot.name for one in found for robot in one.findings.robots]
    missing = any(isinstance(one.trouble, BridgeClosed) for one in found)
    names += [robot.found.name for robot in given]
    for sentence in overrides.check(names, all_known=not missing):
        echo(sentence, err=True)
    fleet = FoundFleet([], overrides=overrides)
    behind = {bridge: one.topics for bridge, one in zip(bridges, found, strict=True)}
    for bridge, robot in overrides.apply_to_given(given):
        fleet.given.append(Candidate(bridge, _typed(robot, behind[bridge])))
    taken = {same_name(other.found.name) for other in fleet.given}
    for bridge, one in zip(bridges, found, strict=True):
        if one.why:
            echo(one.why, err=True)
        for robot in overrides.findings(bridge.url, one.findings).robots:
            robot = _typed(robot, one.topics)
            if any(o.is_also(Candidate(bridge, robot)) for o in fleet.given):
                continue
            if same_name(robot.name) in taken and overrides.names(robot.name):
                raise set_twice(robot.name)
            robot = replace(robot, name=free_name(robot.name, taken))
            echo(f"Found {summary_line(robot)}", err=True)
            fleet.robots.append(Candidate(bridge, robot))
        fleet.behind[bridge] = one
    return fleet


def given_fleet(
    bridges: Sequence["Bridge"], given: Sequence[Candidate], *, wait: float
) -> FoundFleet:
    """Return robots given with ``--robot``, with the findings of their bridges.

    Prints on standard error if a bridge does not list its topics.

    Args:
        bridges: The bridges.
        given: The robots.
        wait: How long to wait for an unreachable bridge, in seconds.

    """
    found = asyncio.run(find([bridge.url for bridge in bridges], wait=wait))
    for one in found:
        if one.trouble is not None:
            echo(
                f"{one.url}: {one.trouble}. Only the topics of --robot can be drawn.",
                err=True,
            )
    return FoundFleet([*given], behind=dict(zip(bridges, found, strict=True)))


def _typed(robot: FoundRobot, topics: Mapping[str, str]) -> FoundRobot:
    """Return a robot with the type of its velocity topic, if the bridge lists it."""
    velocity = robot.first("velocity")
    if velocity is None or velocity.type or not is_topic(velocity.topic):
        return robot
    type = topics.get(normalise_topic(velocity.topic), "").strip()
    if not is_type(type, *VELOCITY):
        return robot
    others = robot.guesses["velocity"][1:]
    typed = (replace(velocity, type=type), *others)
    return replace(robot, guesses={**robot.guesses, "velocity": typed})


def _given_table(robot: FoundRobot) -> list[str]:
    """Return the given topics of a robot, one on each line."""
    listed = [
        (role, guess)
        for role in SETTABLE_ROLES
        for guess in robot.guesses.get(role, ())
    ]
    return [
        f"  {role:<11} {guess.topic}{f'  {guess.type}' if guess.type else ''}"
        for role, guess in listed
    ]
