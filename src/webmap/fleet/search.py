"""Searches for the robots behind bridges, once and from then on."""

import asyncio
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from urllib.parse import urlsplit

from webmap import Bridge
from webmap.base.echo import echo
from webmap.base.errors import BridgeClosed, BridgeError
from webmap.base.text import escaped
from webmap.config.checks import same_name
from webmap.config.robot import RobotConfig
from webmap.console import Console
from webmap.discovery import Findings, FoundRobot, discover
from webmap.discovery.findings import free_name, unique_names
from webmap.discovery.frames import receive_frames
from webmap.discovery.robots import host_name
from webmap.discovery.rules import VELOCITY
from webmap.discovery.tables import OVERRULE, drawn_table, robot_table, summary_line
from webmap.fleet.overrides import SETTABLE_ROLES, Overrides
from webmap.fleet.periodic_search import LayerSearch, RobotSearch, on_page
from webmap.fleet.robot_options import (
    Candidate,
    drawable_topics,
    same_name_error,
)
from webmap.fleet.view_robots import ViewRobot, ViewRobots
from webmap.ros.names import (
    agent_named,
    is_foxglove_url,
    is_topic,
    is_type,
    normalise_topic,
)
from webmap.ros.temporary_bridge import ask_topics

LIST_ROBOTS = (
    "List each robot with --robot NAME:ODOM:CMD_VEL:SCAN, "
    "as in --robot Bob:/odom:/cmd_vel:/scan; "
    "or give webmap discover a list of the topics with --topics"
)


@dataclass(frozen=True, slots=True)
class SearchResult:
    """The robots behind one bridge, or why they are unknown."""

    url: str
    label: str
    """A short name for the bridge, unlike all others."""

    findings: Findings
    trouble: BridgeError | None = None
    topics: Mapping[str, str] = field(default_factory=dict)
    """Types by topic, as listed by the bridge or given by the user."""

    twin: str = ""
    """The address of another bridge, of another kind, that leads to the same robots."""

    @property
    def why(self) -> str:
        """Why no robot was found, and what to do, for people; empty if some were."""
        if self.findings.robots:
            return ""
        if self.twin:
            return (
                f"{self.url} leads to the same robots as {self.twin}: they are shown "
                f"once, through {self.twin}."
            )
        if isinstance(self.trouble, BridgeClosed):
            return f"{self.trouble}."
        if self.trouble is not None:
            reason = f"the bridge has no rosapi that lists its topics: {self.trouble}"
        else:
            reason = " ".join(self.findings.notes).rstrip(".")
        return f"{self.url}: {reason}. {LIST_ROBOTS}"


async def search_bridges(
    urls: Sequence[str], *, wait: float, topics: Mapping[str, str] | None = None
) -> list[SearchResult]:
    """Return the robots behind each bridge; all their names differ.

    Prints on standard error that it waits for a bridge.

    Args:
        urls: The bridges' addresses.
        wait: How long to wait for an unreachable bridge, in seconds.
        topics: Types by topic, if the bridge does not list them.

    """
    if topics is None:
        asked = await asyncio.gather(*(_ask(url, wait) for url in urls))
    else:
        asked = [(await _behind(url, topics), topics, None) for url in urls]
    names = bridge_labels(urls)
    found = [one for one, _, _ in asked]
    twins = _twins(urls, found)
    named = unique_names(
        [
            (name, Findings() if twin else one)
            for name, one, twin in zip(names, found, twins, strict=True)
        ]
    )
    return [
        SearchResult(url, label, findings, trouble, listed, twin)
        for url, label, findings, (_, listed, trouble), twin in zip(
            urls, names, named, asked, twins, strict=True
        )
    ]


def _twins(urls: Sequence[str], found: Sequence[Findings]) -> list[str]:
    """Return for each bridge an earlier one that leads to the same robots, or "".

    That is a rosbridge and a Foxglove bridge of one host, with the same topics of
    odometry.
    """
    known: dict[tuple[str | None, frozenset[str | None]], str] = {}
    twins = []
    for url, one in zip(urls, found, strict=True):
        odometry = frozenset(robot.topic("odometry") for robot in one.robots)
        first = known.setdefault((urlsplit(url).hostname, odometry), url)
        differ = is_foxglove_url(first) != is_foxglove_url(url)
        twins.append(first if odometry and differ else "")
    return twins


def bridge_labels(urls: Sequence[str]) -> list[str]:
    """Return a name for each bridge: its agent, or its host.

    The port is added if others have the same name.
    """
    parts = [urlsplit(url) for url in urls]
    hosts = [
        agent_named(url) or part.hostname or "robot"
        for url, part in zip(urls, parts, strict=True)
    ]
    names = [
        host if hosts.count(host) == 1 or part.port is None else f"{host}:{part.port}"
        for host, part in zip(hosts, parts, strict=True)
    ]
    taken: set[str] = set()
    return [free_name(name, taken) for name in names]


async def _ask(
    url: str, wait: float
) -> tuple[Findings, Mapping[str, str], BridgeError | None]:
    def waiting(why: str) -> None:
        echo(f"Waiting for the bridge at {url}: {why}", err=True)

    try:
        topics = await ask_topics(url, wait=wait, waiting=waiting)
    except BridgeError as error:
        return Findings(), {}, error
    return await _behind(url, topics), topics, None


async def _behind(url: str, topics: Mapping[str, str]) -> Findings:
    return discover(topics, host_name(url), await receive_frames(url, topics))


@dataclass(slots=True)
class FleetSearch:
    """The robots that were found, and the data for later searches."""

    given: list[Candidate]
    """Robots given with ``--robot``; the console has them already."""

    robots: list[Candidate] = field(default_factory=list)
    """Robots that were found."""

    behind: dict[Bridge, SearchResult] = field(default_factory=dict)
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
            there = drawable_topics(given, found.topics, found.findings)
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
        console: Console,
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
        shown = ViewRobots(console, self.overrides, given=self.given, grid=grid)
        self._add_all(shown)
        config = self.overrides.config
        given = [
            ViewRobot(bridge, found, made, config(bridge.url, found))
            for (bridge, found), made in zip(self.given, console.given, strict=True)
            if not only_given
        ]
        bridges = dict.fromkeys([*self.behind, *(robot.bridge for robot in given)])
        for bridge in bridges:
            looking = LayerSearch(bridge, shown, given=given, topics=topics)
            _services.append(looking)

    def make_robots(
        self,
        console: Console,
        part_of: Callable[[RobotConfig], RobotConfig],
    ) -> ViewRobots:
        """Make the robots found now and later, without a page.

        Args:
            console: Takes the maps under the robots.
            part_of: Returns the part of a configuration that a robot is made of here.

        """
        shown = ViewRobots(console, self.overrides, part_of=part_of)
        for robot in self.given:
            shown.add(robot)
        self._add_all(shown)
        for bridge in self.behind:
            _services.append(LayerSearch(bridge, shown))
        return shown

    def _add_all(self, shown: ViewRobots) -> None:
        for robot in self.robots:
            shown.add(robot)
        for bridge, one in self.behind.items():
            robots = one.findings.robots
            _services.append(RobotSearch(bridge, robots, shown.show_news))


_services: list[object] = []
"""Objects that live as long as the process; this list keeps them alive."""


def find_fleet(
    bridges: Sequence[Bridge],
    given: Sequence[Candidate],
    *,
    wait: float,
    topics: Mapping[str, str] | None = None,
    overrides: Overrides | None = None,
) -> FleetSearch:
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
        search_bridges([bridge.url for bridge in bridges], wait=wait, topics=topics)
    )
    names = [robot.name for one in found for robot in one.findings.robots]
    missing = any(isinstance(one.trouble, BridgeClosed) for one in found)
    names += [robot.found.name for robot in given]
    for sentence in overrides.check(names, all_known=not missing):
        echo(sentence, err=True)
    fleet = FleetSearch([], overrides=overrides)
    behind = {bridge: one.topics for bridge, one in zip(bridges, found, strict=True)}
    for bridge, robot in overrides.apply_to_options(given):
        fleet.given.append(Candidate(bridge, _typed(robot, behind[bridge])))
    taken = {same_name(other.found.name) for other in fleet.given}
    for bridge, one in zip(bridges, found, strict=True):
        if one.why:
            echo(one.why, err=True)
        if one.twin:
            continue
        for robot in overrides.findings(bridge.url, one.findings).robots:
            robot = _typed(robot, one.topics)
            if any(o.is_also(Candidate(bridge, robot)) for o in fleet.given):
                continue
            if same_name(robot.name) in taken and overrides.names(robot.name):
                raise same_name_error(robot.name)
            robot = replace(robot, name=free_name(robot.name, taken))
            echo(f"Found {summary_line(robot)}", err=True)
            fleet.robots.append(Candidate(bridge, robot))
        fleet.behind[bridge] = one
    return fleet


def fleet_of_options(
    bridges: Sequence[Bridge], given: Sequence[Candidate], *, wait: float
) -> FleetSearch:
    """Return robots given with ``--robot``, with the findings of their bridges.

    Prints on standard error if a bridge does not list its topics.

    Args:
        bridges: The bridges.
        given: The robots.
        wait: How long to wait for an unreachable bridge, in seconds.

    """
    found = asyncio.run(search_bridges([bridge.url for bridge in bridges], wait=wait))
    for one in found:
        if one.trouble is not None:
            echo(
                f"{one.url}: {one.trouble}. Only the topics of --robot can be drawn.",
                err=True,
            )
    return FleetSearch([*given], behind=dict(zip(bridges, found, strict=True)))


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
