"""The robots that ``webmap view`` shows, and how findings change them."""

import logging
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import msgspec

from webmap.base.echo import notify
from webmap.base.errors import WebMapError
from webmap.base.scope import no_scope
from webmap.config.checks import Mistakes, same_name
from webmap.config.robot import RobotConfig, TfConfig
from webmap.console import Console, make_robot
from webmap.core.alignment_store import store
from webmap.core.robot import apply_config
from webmap.discovery import FoundRobot
from webmap.discovery.findings import FoundLayer, TopicRole, free_name
from webmap.discovery.layers import TRAIL, drawing, topic_of, with_layers
from webmap.discovery.newcomers import News
from webmap.discovery.tables import summary_line
from webmap.fleet.overrides import Overrides, shared_map
from webmap.fleet.robot_options import Candidate

if TYPE_CHECKING:
    from webmap import Bridge, Robot

log = logging.getLogger("webmap.cli")

PARTS: Mapping[TopicRole, str] = {
    "odometry": "odometry",
    "pose": "odometry",
    "velocity": "twist",
    "goal": "move",
    "action": "move",
    "initialpose": "initial_pose",
    "scan": "scan",
    "battery": "battery",
    "plan": "modules",
    "camera": "cameras",
    "tf": "tf",
}
"""Roles that a shown robot can gain later, and their part of the configuration."""


def whole(config: RobotConfig) -> RobotConfig:
    """Return ``config``: a robot with a page is made of all its parts."""
    return config


@dataclass(slots=True, eq=False)
class ViewRobot:
    """A robot that is shown, found or given with ``--robot``."""

    bridge: "Bridge"
    found: FoundRobot
    robot: "Robot"
    config: RobotConfig
    """Its configuration now."""

    topics: set[str] = field(default_factory=set)
    """Topics that are drawn, or that were reported as not drawn."""

    part_of: Callable[[RobotConfig], RobotConfig] = whole
    """Returns the part of a configuration that the robot is made of here."""

    def change(self, config: RobotConfig) -> Mistakes:
        """Configure the parts of the robot that differ; return the mistakes."""
        old, self.config = self.part_of(self.config), config
        with no_scope():
            new = self.part_of(config)
            return apply_config(self.robot, old, new, {self.bridge.url: self.bridge})

    def use(self, config: RobotConfig) -> set[Any]:
        """Change the robot, and log and return the keys that cannot be used."""
        mistakes = self.change(config).found
        for path, message in mistakes:
            log.error("%s: its %s is not used: %s", self.robot.name, path[0], message)
        return {path[0] for path, _ in mistakes}

    def news_of_topics(self, topics: Iterable[str]) -> list[str]:
        """Return the topics that are new since the last call."""
        new = [topic for topic in topics if topic not in self.topics]
        self.topics.update(new)
        return new

    def move(self, tf: TfConfig | None, frame: str) -> str:
        """Draw the robot in its newest known frames.

        Args:
            tf: The frames that it is drawn by.
            frame: The frame of its map, used for its goals and its initial pose.

        Returns:
            What is new, in a sentence for people; empty if nothing changed.

        """
        config, before = self.config, self.robot.tf
        drawn = frames = []
        if tf is not None:
            config = config.with_part("tf", tf)
        for key in ("initial_pose", "move"):
            part = getattr(config, key)
            if part is not None and part.frame != frame:
                part = msgspec.structs.replace(part, frame=frame)
                config = config.with_part(key, part)
                frames = [f"takes goals and its initial pose in the frame {frame}"]
        self.use(config)
        now = self.robot.tf
        if before and now and {**before, "quiet": now["quiet"]} != now:
            drawn = [f"is drawn by {now['base_frame']} in {now['map_frame']}"]
        changes = " and ".join([*drawn, *frames])
        return f"{self.robot.name} now {changes}" if changes else ""


class ViewRobots:
    """Makes and shows robots when they are found.

    Args:
        console: The console that shows them.
        overrides: Settings that replace guesses.
        given: Robots given with ``--robot``; each replaces the found robot.
        grid: Whether the robots' own maps are shown under them.
        part_of: Returns the part of a configuration that a robot is made of here.

    """

    def __init__(
        self,
        console: Console,
        overrides: Overrides | None = None,
        *,
        given: Sequence[Candidate] = (),
        grid: bool = True,
        part_of: Callable[[RobotConfig], RobotConfig] = whole,
    ) -> None:
        self._part_of = part_of
        self.overrides = overrides or Overrides()
        self.grid = grid
        self._console = console
        self._given = given
        self._names = {same_name(robot.found.name) for robot in given}
        self._places: dict[tuple[Bridge, str], ViewRobot] = {}

    @property
    def robots(self) -> "list[Robot]":
        """The robots on the console, in the order in which they were found."""
        return [shown.robot for shown in self._places.values()]

    @property
    def shown(self) -> list[ViewRobot]:
        """The robots that were made, with their configurations."""
        return list(self._places.values())

    def get(self, bridge: "Bridge", namespace: str) -> ViewRobot | None:
        """Return the robot that was found in a namespace behind a bridge."""
        return self._places.get((bridge, namespace))

    def add(self, robot: Candidate) -> None:
        """Make and show one more robot, with its findings."""
        bridge, found = robot
        self._show_map(robot)
        self._names.add(same_name(found.name))
        config = self.overrides.config(bridge.url, found)
        with no_scope():
            made = make_robot(self._part_of(config), [bridge])
            store.restore(made)
        shown = ViewRobot(bridge, found, made, config, part_of=self._part_of)
        self._places[bridge, found.namespace] = shown
        self._console.add(made)

    def show_news(self, news: News, bridge: "Bridge") -> None:
        """Show news, and report it on standard error.

        If the name of a new robot is taken, the name of its bridge is added. A robot
        given with ``--robot`` is no news.

        Args:
            news: The news.
            bridge: The bridge that the robot is behind.

        """
        robot = Candidate(bridge, self.overrides.apply(bridge.url, news.robot))
        self._show_map(robot)
        if news.roles or news.moved:
            shown = self.get(bridge, robot.found.namespace)
            if shown is not None:  # else it is a robot of ``--robot``
                for sentence in self._update(shown, robot.found, news):
                    notify(sentence)
            return
        if any(other.is_also(robot) for other in self._given):
            return
        wanted = robot.found.name
        if same_name(wanted) in self._names:
            wanted = f"{wanted} ({urlsplit(bridge.url).netloc})"
        named = replace(robot.found, name=free_name(wanted, self._names))
        self.add(Candidate(bridge, named))
        notify(f"A robot appeared behind {bridge.url}: {summary_line(named)}")

    def draw(
        self, shown: ViewRobot, layers: Iterable[FoundLayer], namespace: str
    ) -> None:
        """Draw the new topics of a robot, and its trail.

        A topic that robots share is drawn once. What cannot be drawn is logged.

        Args:
            shown: The robot.
            layers: Its layers.
            namespace: The namespace of its own topics.

        """
        found = {layer.topic: layer for layer in layers}
        fresh = [found[topic] for topic in shown.news_of_topics(found)]
        wrong: list[tuple[str, object]] = []
        for layer in fresh:
            try:
                self._show_shared(shown.bridge, layer, namespace)
            except WebMapError as error:
                wrong.append((layer.topic, error))
        config = with_layers(shown.config, fresh, namespace)
        if TRAIL not in config.modules:
            config = config.with_part("modules", [*config.modules, TRAIL])
        topics = {layer.path: topic_of(layer.module) for layer in config.layers()}
        mistakes = shown.change(config).found
        for topic, why in [
            *wrong,
            *((topics[path[:2]], why) for path, why in mistakes),
        ]:
            log.warning("%s: %s is not drawn: %s", shown.robot.name, topic, why)

    def _show_shared(self, bridge: "Bridge", layer: FoundLayer, namespace: str) -> None:
        drawn = drawing(layer, namespace, None)
        if not drawn.shared:
            return
        if drawn.module == "OccupancyGrid":
            self._console.add_grid(bridge, layer.topic, **drawn.options)
        else:
            made = (drawn.module, bridge, layer.topic)
            self._console.add_module_once(*made, **drawn.options)

    def _show_map(self, robot: Candidate) -> None:
        """Show a map that robots share under them, before anything else of a robot."""
        topic = shared_map(robot.found)
        if self.grid and topic:
            self._console.add_grid(robot.bridge, topic)

    def _update(self, shown: ViewRobot, found: FoundRobot, news: News) -> list[str]:
        """Change a robot by its newest findings, and return sentences about the news.

        A topic that is already drawn as a layer is not drawn again. Everything else
        stays as it is: a change of a topic that moves the robot would end its lease.
        """
        bridge = shown.bridge
        fixed = self.overrides.fixed(bridge.url, news.robot)
        wanted = self.overrides.config(bridge.url, found)
        drawn = {topic_of(layer.module) for layer in shown.config.layers()}
        new, used = shown.config, []
        for role in news.roles:
            if role in fixed or role not in PARTS:
                continue
            key = PARTS[role]
            old, part, topics = (
                getattr(new, key),
                getattr(wanted, key),
                [found.topic(role)],
            )
            if isinstance(part, list):
                own = [layer for layer in wanted.layers() if layer.path[0] == key]
                more = {
                    topic_of(layer.module): each
                    for layer, each in zip(own, part, strict=True)
                    if topic_of(layer.module) not in drawn
                }
                part, topics = [*old, *more.values()], list(more)
            if part != getattr(shown.config, key):
                used += [(key, f"{role} {topic}") for topic in topics]
            new = new.with_part(key, part)
        wrong = shown.use(new)
        listed = ", ".join(topic for key, topic in used if key not in wrong)
        sentences = [f"{shown.robot.name} has new topics: {listed}"] if listed else []
        if news.moved and "tf" not in fixed:
            sentences.append(shown.move(wanted.tf, found.map_frame))
        return [sentence for sentence in sentences if sentence]
