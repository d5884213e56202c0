"""Queries a bridge periodically for new robots and for topics to draw."""

import asyncio
import logging
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence

import msgspec

from webmap import Bridge
from webmap.base.echo import notify
from webmap.base.errors import BridgeError
from webmap.base.lifecycle import lifecycle
from webmap.discovery import Findings, FoundRobot, discover
from webmap.discovery.findings import Layers
from webmap.discovery.frames import frame_collector
from webmap.discovery.layers import role_of
from webmap.discovery.newcomers import Newcomers, News, leads_further
from webmap.discovery.robots import host_name
from webmap.discovery.tf_robots import Trees
from webmap.fleet.overrides import MOST_CAMERAS
from webmap.fleet.robot_options import DrawableTopics, drawable_topics
from webmap.fleet.view_robots import ViewRobot, ViewRobots
from webmap.modules.declaration import declarations

log = logging.getLogger("webmap.cli")

PERIOD = 5.0
"""Seconds between two searches for robots."""

SOON, LATER = 1.0, 15.0
"""Seconds between two searches for topics to draw: until some are found, and after
that."""

LONGEST = 60.0
"""Seconds between two queries to a bridge that does not answer; each costs a call."""


class PeriodicSearch(ABC):
    """Queries the topics behind a bridge periodically; a service of the process.

    Args:
        bridge: The bridge.
        topics: Types by topic, if the bridge does not list them.

    """

    def __init__(self, bridge: Bridge, topics: Mapping[str, str] | None = None) -> None:
        self.bridge = bridge
        self._given_topics = topics
        self._task: asyncio.Task[None] | None = None
        self._known: tuple[object, ...] = ()
        self._found = Findings()
        lifecycle.add(self)

    @property
    @abstractmethod
    def period(self) -> float:
        """Seconds until the next query."""

    @abstractmethod
    async def take(self, topics: dict[str, str]) -> None:
        """Process the types by topic."""

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Start to query the bridge each time that :attr:`period` has passed."""
        self._task = loop.create_task(self._keep_searching())

    async def stop(self) -> None:
        """Stop the queries; a query that runs is cancelled."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])

    async def _keep_searching(self) -> None:
        pause = self.period
        while True:
            if self.bridge.state != "open":
                pause = self.period
            else:
                try:
                    await self.take(await self._topics())
                    pause = self.period
                except BridgeError as error:
                    log.debug("%s: %s", self.bridge.url, error)
                    pause = min(2 * pause, LONGEST)
                except Exception:
                    log.exception("%s: the search for topics failed", self.bridge.url)
                    pause = min(2 * pause, LONGEST)
            await asyncio.sleep(pause)

    async def _discover(self, topics: dict[str, str], trees: Trees) -> Findings:
        """Return what is behind the bridge, computed when topics or frames changed.

        A thread does that, because thousands of topics take half a second.
        """
        trees = trees.copy()
        known = topics, trees, declarations()
        if known != self._known:
            host = host_name(self.bridge.url)
            self._found = await asyncio.to_thread(discover, topics, host, trees)
            self._known = known
        return self._found

    async def _topics(self) -> dict[str, str]:
        if self._given_topics is not None:
            return dict(self._given_topics)
        return await self.bridge.topics()


class RobotSearch(PeriodicSearch):
    """Searches periodically for robots behind a bridge.

    It uses their topics and the frames received for a short time at each search.

    Args:
        bridge: The bridge.
        known: The robots that are shown already.
        on_news: Called with the news.

    """

    period = PERIOD

    def __init__(
        self,
        bridge: Bridge,
        known: Iterable[FoundRobot],
        on_news: Callable[[News, Bridge], object],
    ) -> None:
        super().__init__(bridge)
        self._newcomers = Newcomers(known)
        self._on_news = on_news

    async def take(self, topics: dict[str, str]) -> None:
        """Report new robots and new topics of robots."""
        trees = await frame_collector(self.bridge).listen(topics)
        found = await self._discover(topics, trees)
        for news in self._newcomers.look(found):
            try:
                self._on_news(news, self.bridge)
            except Exception:  # the other news is reported only once
                log.exception(
                    "%s: the new topics of %s are not shown",
                    self.bridge.url,
                    news.robot.name,
                )


class LayerSearch(PeriodicSearch):
    """Searches periodically for topics to draw of the robots behind a bridge.

    Args:
        bridge: The bridge.
        shown: The robots that are found and shown; more may be added.
        given: Robots of ``--robot`` whose other topics are drawn too.
        topics: Types by topic, if the bridge does not list them.

    """

    def __init__(
        self,
        bridge: Bridge,
        shown: ViewRobots,
        *,
        given: Sequence[ViewRobot] = (),
        topics: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(bridge, topics)
        self._shown = shown
        self._given = [robot for robot in given if robot.bridge is bridge]
        self._placed: dict[ViewRobot, FoundRobot] = {}
        self._has_drawn = False

    @property
    def period(self) -> float:
        """Seconds until the next query."""
        return LATER if self._has_drawn else SOON

    async def take(self, topics: dict[str, str]) -> None:
        """Draw the new topics behind the bridge."""
        frames = frame_collector(self.bridge)
        if self._given:  # robots drawn by frames receive them anyway
            await frames.listen(topics)
        url, overrides = self.bridge.url, self._shown.overrides
        behind = await self._discover(topics, frames.trees)
        self._take_given(topics, behind)
        for guessed in behind.robots:
            space = guessed.namespace
            robot = self._shown.get(self.bridge, space)
            if robot is None:
                continue
            one = overrides.apply(url, guessed, behind.dialect)
            layers = overrides.layers(url, behind, guessed)
            self._draw(robot, layers, space, _cameras_left_out(robot, one))

    def _take_given(self, topics: dict[str, str], behind: Findings) -> None:
        """Draw the new topics of the robots given with ``--robot``."""
        taken: set[str] = set()
        for robot in self._given:
            offered = drawable_topics(robot.found, topics, behind)
            if offered.namespace in taken:  # the topics of a namespace are drawn once
                self._draw(robot, Layers(), offered.namespace)
                continue
            taken.add(offered.namespace)
            self._place(robot, offered)
            self._draw(robot, offered.layers, offered.namespace)

    def _place(self, robot: ViewRobot, offered: DrawableTopics) -> None:
        """Draw a robot in the frame of the map, like a found robot."""
        found, known = offered.found, self._placed.get(robot)
        if (
            found is None
            or found.tf is None
            or not robot.found.topic("odometry")
            or (known is not None and not leads_further(found, known))
        ):
            return
        self._placed[robot] = found
        frame = found.map_frame
        tf = msgspec.structs.replace(found.tf, quiet=True, map_frame=frame)
        moved = robot.move(tf, frame)
        if moved and known is not None:
            notify(moved)

    def _draw(
        self,
        robot: ViewRobot,
        layers: Layers,
        namespace: str,
        cameras: Sequence[str] = (),
    ) -> None:
        """Draw new topics, and report once those left out because of their data rate.

        Args:
            robot: The robot.
            layers: Its layers.
            namespace: The namespace of its own topics.
            cameras: Topics of cameras that are left out.

        """
        self._has_drawn = True
        drawn, others = on_page(layers, self._shown.grid)
        self._shown.draw(robot, drawn, namespace)
        new = robot.news_of_topics([*(layer.topic for layer in others), *cameras])
        if new:
            notify(
                f"{robot.robot.name}: not drawn, beyond the limit for their kind: "
                f"{', '.join(new)}"
            )


def on_page(layers: Layers, grid: bool) -> Layers:
    """Return the layers, without maps if a floor plan replaces them."""
    drawn = [layer for layer in layers.drawn if grid or role_of(layer) != "map"]
    return Layers(tuple(drawn), layers.left_out)


def _cameras_left_out(robot: ViewRobot, found: FoundRobot) -> list[str]:
    """Return the topics of cameras beyond the number that is shown."""
    shown = {camera.topic for camera in robot.config.cameras}
    if len(shown) < MOST_CAMERAS:
        return []
    cameras = found.guesses.get("camera", ())
    return [guess.topic for guess in cameras if guess.topic not in shown]
