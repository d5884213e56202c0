"""Robots that appear while the console runs."""

import logging
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from webmap.cli.draw_layer import shared_map
from webmap.cli.looking import Looking, say
from webmap.cli.overruling import Overruling
from webmap.console import Console, RobotDescription
from webmap.console.fleet import make_robot
from webmap.core.alignment_store import store
from webmap.discovery import FoundRobot, discover
from webmap.discovery.late_frames import late_frames
from webmap.discovery.naming import free_name, same_name
from webmap.discovery.newcomers import Newcomers, News
from webmap.discovery.robots import host_name
from webmap.discovery.words import in_one_line
from webmap.scope import no_scope

if TYPE_CHECKING:
    from webmap import Bridge, Robot

log = logging.getLogger("webmap.cli")

PERIOD = 5.0
"""Seconds between two looks."""


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
        """Show a map under the robots, if there is one, besides those shown before."""
        if topic:
            self._console.add_grid(bridge, topic)


class LookingForRobots(Looking):
    """Looks again and again which robots are behind a bridge.

    Their topics tell, and the frames that are heard for a moment at each look.

    Args:
        bridge: The bridge.
        known: The robots that are shown already.
        came: Called with what is new.

    """

    period = PERIOD

    def __init__(
        self,
        bridge: "Bridge",
        known: Iterable[FoundRobot],
        came: Callable[[News, "Bridge"], object],
    ) -> None:
        super().__init__(bridge)
        self._newcomers = Newcomers(known)
        self._came = came

    async def take(self, topics: dict[str, str]) -> None:
        """Tell what is new among the robots."""
        trees = await late_frames(self.bridge).listen(topics)
        found = discover(topics, host_name(self.bridge.url), trees)
        for news in self._newcomers.look(found):
            try:
                self._came(news, self.bridge)
            except Exception:  # the others are news now and never again
                log.exception(
                    "%s: what is new of %s is not shown",
                    self.bridge.url,
                    news.robot.name,
                )


def greet(
    late: LateRobots,
    taken: Iterable[str],
    stops_within: float | None,
    *,
    grid: bool = True,
    overruling: Overruling | None = None,
    told: Sequence[RobotDescription] = (),
) -> Callable[[News, "Bridge"], None]:
    """Return what shows news, and says so on standard error.

    A newcomer whose name is taken has its bridge behind the name. A robot that was
    told by hand is no news.

    Args:
        late: Where it is shown.
        taken: Names of the robots that are there.
        stops_within: Seconds within which every base stops by itself, if known.
        grid: Whether the robots' own map is shown under them.
        overruling: What was said of robots better than it is guessed.
        told: Robots that were told by hand; each takes the place of one found.

    """
    from webmap.cli.described import describe, overrules
    from webmap.cli.following import follow
    from webmap.cli.growing import grow

    names = {same_name(name) for name in taken}
    said_of = overruling or Overruling()

    def came(news: News, bridge: "Bridge") -> None:
        fixed = said_of.fixed(bridge.url, news.robot)
        robot = said_of.apply(bridge.url, news.robot)
        if grid:
            late.show_grid(bridge, shared_map(robot))
        if news.roles or news.moved:
            shown = late.at(bridge, robot.namespace)
            if shown is None:  # it was told by hand, with all that it has
                return
            roles = [role for role in news.roles if role not in fixed]
            used = grow(shown, bridge, robot, roles, stops_within=stops_within)
            if used:
                say(f"{shown.name} has more now: {', '.join(used)}")
            # Who says which frames are a robot's means those.
            if news.moved and "tf" not in fixed:
                moved = follow(shown, bridge, robot)
                if moved:
                    say(moved)
            return
        about = describe(robot, bridge, stops_within=stops_within)
        if any(overrules(other, about) for other in told):
            return
        wanted = robot.name
        if same_name(wanted) in names:
            wanted = f"{wanted} ({urlsplit(bridge.url).netloc})"
        robot = replace(robot, name=free_name(wanted, names))
        late.add(robot, replace(about, name=robot.name))
        say(f"A robot appeared behind {bridge.url}: {in_one_line(robot)}")

    return came
