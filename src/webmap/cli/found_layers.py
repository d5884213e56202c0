"""What else is drawn of robots that were found or told: all their topics offer."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypeAlias

from webmap.cli.described import cameras_left_out
from webmap.cli.draw_layer import draw_layer, meant
from webmap.cli.following import follow
from webmap.cli.looking import Looking, say
from webmap.cli.overruling import Overruling
from webmap.cli.told import Offer, offer
from webmap.console import RobotDescription
from webmap.discovery import Findings, FoundRobot, discover
from webmap.discovery.late_frames import late_frames
from webmap.discovery.layers import FoundLayer
from webmap.discovery.newcomers import leads_further
from webmap.discovery.robots import host_name
from webmap.scope import no_scope

if TYPE_CHECKING:
    from webmap import Bridge, Robot
    from webmap.console import Console

SOON, LATER = 1.0, 15.0
"""Seconds between two looks: until something was found, and from then on."""

Told: TypeAlias = "Sequence[tuple[RobotDescription, Robot]]"
"""Robots that were told by hand, as they were told and as they are shown."""

_services: list[object] = []
"""What runs as long as the process does; nobody else holds it."""


def draw_layers(
    bridges: Sequence["Bridge"],
    robots: Sequence["Robot"],
    overruling: Overruling | None = None,
    *,
    console: "Console | None" = None,
    told: Told = (),
    topics: Mapping[str, str] | None = None,
) -> None:
    """Draw, as long as the process runs, what the robots of bridges offer.

    Args:
        bridges: The bridges.
        robots: The robots that are shown; more may come.
        overruling: What was said of robots better than it is guessed.
        console: Where maps are shown; none are without it.
        told: Those that were told by hand, of which more is drawn than was told.
        topics: Types by topic, where a bridge cannot be asked for them.

    """
    said = overruling or Overruling()
    _services.extend(
        DrawnLayers(bridge, robots, said, console, told=told, topics=topics)
        for bridge in bridges
    )


class DrawnLayers(Looking):
    """Looks again and again what can be drawn behind a bridge, and draws it.

    Args:
        bridge: The bridge.
        robots: The robots that are shown; more may come.
        overruling: What was said of robots better than it is guessed.
        console: Where maps are shown; none are without it.
        told: Those that were told by hand, of which more is drawn than was told.
        topics: Types by topic, where the bridge cannot be asked for them.

    """

    def __init__(
        self,
        bridge: "Bridge",
        robots: Sequence["Robot"],
        overruling: Overruling,
        console: "Console | None" = None,
        *,
        told: Told = (),
        topics: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(bridge, topics)
        self._console = console
        self._told = [pair for pair in told if pair[0].bridge is bridge]
        self._robots = robots
        self._overruling = overruling
        self._drawn: set[tuple[int, str]] = set()
        self._placed: dict[int, FoundRobot] = {}

    @property
    def period(self) -> float:
        """Seconds between two looks from now on."""
        return LATER if self._drawn else SOON

    async def take(self, topics: dict[str, str]) -> None:
        """Draw what is new among the topics behind the bridge."""
        frames = late_frames(self.bridge)
        if self._told:  # they hear them anyway, once they are drawn by them
            await frames.listen(topics)
        behind = discover(topics, host_name(self.bridge.url), frames.trees)
        self._take_told(topics, behind)
        said = self._overruling
        for guessed in behind.robots:
            one = said.apply(self.bridge.url, guessed, behind.dialect)
            robot = self._shown(one)
            if robot is None:
                continue
            fixed = said.fixed(self.bridge.url, guessed)
            space = guessed.namespace
            layers = meant(behind.layers[space], guessed, fixed)
            self._draw(robot, layers, space)
            others = [layer.topic for layer in behind.left_out[space]]
            self._say(robot, [*others, *cameras_left_out(robot, one)])

    def _take_told(self, topics: dict[str, str], behind: Findings) -> None:
        """Draw what is new of the robots that were told by hand."""
        taken: set[str] = set()
        for about, robot in self._told:
            offered = offer(about, topics, behind)
            if offered.namespace in taken:  # what is in it is drawn once
                self._draw(robot, (), offered.namespace)
                continue
            taken.add(offered.namespace)
            self._place(about, robot, offered)
            self._draw(robot, offered.layers, offered.namespace)
            self._say(robot, [layer.topic for layer in offered.left_out])

    def _place(self, about: RobotDescription, robot: "Robot", offered: Offer) -> None:
        """Draw a robot in the frame of the map, as one that was found is."""
        found = offered.found
        if found is None or found.tf_namespace is None or not about.odometry:
            return
        known = self._placed.get(id(robot))
        if known is None and robot.tf is not None:
            return  # somebody else said it
        if known is not None and not leads_further(found, known):
            return
        self._placed[id(robot)] = found
        options = {**found.tf_options, "quiet": True, "map_frame": found.map_frame}
        moved = follow(robot, self.bridge, found, options)
        if moved and known is not None:
            say(moved)

    def _draw(
        self, robot: "Robot", layers: Sequence[FoundLayer], namespace: str
    ) -> None:
        for layer in layers:
            if self._is_new(robot, layer.topic):
                draw_layer(robot, self.bridge, layer, namespace, self._console)
        if (id(robot), "") not in self._drawn:
            self._drawn.add((id(robot), ""))
            with no_scope():
                robot.add_module("Trail", length=10.0)

    def _shown(self, found: FoundRobot) -> "Robot | None":
        """Return the robot that is shown for one that was found."""
        topic = found.topic("odometry") or found.topic("pose")
        for robot in self._robots:
            feed = robot.feed
            if feed is None and self._has_base(robot, found):
                return robot
            if feed is None and robot.name == found.name:
                return robot
            if feed is not None and feed.bridge is self.bridge and feed.topic == topic:
                return robot
        return None

    def _has_base(self, robot: "Robot", found: FoundRobot) -> bool:
        """Return whether a robot is drawn by the base frame of one that was found."""
        frames = robot.tf
        if frames is None or frames["bridge"] is not self.bridge:
            return False
        space = found.tf_namespace or ""
        names = (found.base_frame, f"{space}/{found.base_frame}".strip("/"))
        mine = frames["namespace"] == space and frames["base_frame"] in names
        return found.base_frame != "" and mine

    def _is_new(self, robot: "Robot", topic: str) -> bool:
        key = (id(robot), topic)
        new = key not in self._drawn
        self._drawn.add(key)
        return new

    def _say(self, robot: "Robot", others: Sequence[str]) -> None:
        """Say once what is left out, since it costs the link more than it tells."""
        new = [topic for topic in others if self._is_new(robot, topic)]
        if new:
            say(
                f"{robot.name}: not drawn, since there are enough of their kind: "
                f"{', '.join(new)}"
            )
