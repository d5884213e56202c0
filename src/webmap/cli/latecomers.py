"""Robots that appear while the console runs."""

import asyncio
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from webmap.console import Console, RobotDescription
from webmap.console.fleet import make_robot
from webmap.core.alignment_store import store
from webmap.discovery import FoundRobot, discover
from webmap.discovery.naming import same_name
from webmap.discovery.newcomers import Newcomers, News
from webmap.discovery.robots import host_name
from webmap.discovery.words import in_one_line
from webmap.errors import BridgeError
from webmap.lifecycle import lifecycle
from webmap.scope import no_scope

if TYPE_CHECKING:
    from webmap import Bridge, Robot

PERIOD = 5.0
"""Seconds between two looks."""

LONGEST = 60.0
"""Seconds between two looks at a rosapi that does not answer: each costs a call."""


class LateRobots:
    """Robots that were found, made and shown as they come.

    Args:
        console: Where they are shown.

    """

    def __init__(self, console: Console) -> None:
        self._console = console
        self._places: dict[tuple[Bridge, str], Robot] = {}

    @property
    def robots(self) -> "list[Robot]":
        """The robots that were made."""
        return list(self._places.values())

    def add(self, found: FoundRobot, about: RobotDescription) -> None:
        """Make one more robot, with what was found of it, and show it.

        Args:
            found: The robot as it was found.
            about: The same as the console takes it.

        """
        with no_scope():
            robot = make_robot(about)
            if found.tf_namespace is not None:
                robot.set_tf(about.bridge, **found.tf_options)
            if found.topic("plan"):
                robot.add_module("Path", about.bridge, found.topic("plan"))
            store.restore(robot)
        self._places[about.bridge, found.namespace] = robot
        self._console.add(robot)

    def at(self, bridge: "Bridge", namespace: str) -> "Robot | None":
        """Return the robot that was found in a namespace, None if none was."""
        return self._places.get((bridge, namespace))

    def show_grid(self, bridge: "Bridge", topic: str) -> None:
        """Show a map under the robots, if there is one; the first one stays."""
        if topic:
            self._console.add_grid(bridge, topic)


class Looking:
    """Looks again and again what is behind a bridge; a service of the process.

    Args:
        bridge: The bridge.
        known: The robots that are shown already.
        came: Called with what is new.

    """

    def __init__(
        self,
        bridge: "Bridge",
        known: Iterable[FoundRobot],
        came: Callable[[News, "Bridge"], object],
    ) -> None:
        self.bridge = bridge
        self._newcomers = Newcomers(known)
        self._came = came
        self._task: asyncio.Task[None] | None = None
        lifecycle.add(self)

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to look."""
        self._task = loop.create_task(self._look_on())

    async def stop(self) -> None:
        """Look no more."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])

    async def _look_on(self) -> None:
        pause = PERIOD
        while True:
            await asyncio.sleep(pause)
            if self.bridge.state != "open":
                pause = PERIOD
                continue
            try:
                topics = await self.bridge.topics()
            except BridgeError:
                pause = min(2 * pause, LONGEST)
                continue
            pause = PERIOD
            found = discover(topics, host_name(self.bridge.url))
            for news in self._newcomers.look(found):
                self._came(news, self.bridge)


def greet(
    late: LateRobots,
    taken: Iterable[str],
    stops_within: float | None,
    *,
    grid: bool = True,
) -> Callable[[News, "Bridge"], None]:
    """Return what shows news, and says so on standard error.

    A newcomer gets a name that nobody has.

    Args:
        late: Where it is shown.
        taken: Names of the robots that are there.
        stops_within: Seconds within which every base stops by itself, if known.
        grid: Whether the robots' own map is shown under them.

    """
    from webmap.cli.described import describe
    from webmap.cli.growing import grow

    names = {same_name(name) for name in taken}

    def came(news: News, bridge: "Bridge") -> None:
        robot = news.robot
        if grid:
            late.show_grid(bridge, robot.topic("map"))
        if news.roles:
            shown = late.at(bridge, robot.namespace)
            if shown is None:  # it was told by hand, with all that it has
                return
            used = grow(shown, bridge, robot, news.roles, stops_within=stops_within)
            if used:
                click.echo(f"{shown.name} has more now: {', '.join(used)}", err=True)
            return
        robot = replace(robot, name=_free(robot.name, names))
        said = in_one_line(robot)
        click.echo(f"A robot appeared behind {bridge.url}: {said}", err=True)
        late.add(robot, describe(robot, bridge, stops_within=stops_within))

    return came


def _free(wanted: str, names: set[str]) -> str:
    """Return a name that nobody has, and take it."""
    name, number = wanted, 1
    while same_name(name) in names:
        number += 1
        name = f"{wanted} {number}"
    names.add(same_name(name))
    return name
