"""The robots of agents on the console: found, changed and removed with their agents."""

import asyncio
import contextlib
import logging
import time
from collections import deque
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass, field
from functools import partial

import msgspec

import webmap
from webmap import Bridge, Robot
from webmap.agents import address
from webmap.agents.announcements import (
    MOST_GRIDS,
    MOST_OF_ABOUT,
    MOST_ROBOTS,
    PROTOCOL,
    Beacon,
    read_about,
    read_beacon,
)
from webmap.agents.peer import peer_of
from webmap.base.echo import echo, notify
from webmap.base.errors import ConfigError, WebMapError
from webmap.base.lifecycle import lifecycle
from webmap.base.scope import no_scope
from webmap.base.tasks import spawn
from webmap.base.text import counted
from webmap.config.checks import Mistakes
from webmap.config.fleet import MapConfig
from webmap.config.reading import read
from webmap.config.robot import PictureConfig, RobotConfig
from webmap.console import Console, make_robot
from webmap.console.robot_looks import draw_picture
from webmap.core.motion import agent_robot_id, id_at_agent, shown_name
from webmap.core.pictures import pictures
from webmap.core.robot import apply_config
from webmap.core.runtime import runtime
from webmap.fleet.robot_files import (
    LARGEST,
    config_from_agent,
    picture_from_agent,
)
from webmap.gate.lanes.budget import Budget
from webmap.poses.alignment import align_bridge

log = logging.getLogger("webmap.agent")

FIRST = 1.5
"""Seconds for which a display listens for agents before it opens its page."""

CHECK = 0.5
"""Seconds between two checks of the signs of the agents."""

PICTURE_PATIENCE = 15.0
"""Seconds for the picture of a robot, which a slow link carries late."""

PICTURE_AGAIN = 5.0
"""Seconds after which a picture that did not come is asked for again."""

AWAY = 3.0
"""Seconds without a sign of an agent after which it is shown as away."""

MOST_AGENTS = 100
"""The greatest number of agents of one router that a display shows."""

ASKED = 10
"""How often an agent is asked for its description within :data:`ASKED_WITHIN`."""

ASKED_WITHIN = 30.0
"""Seconds; an agent may change its description all the time."""

NEW_ROBOTS = 2.0
"""Robots per second that an agent may add after its first ``MOST_ROBOTS``: to add and
remove robots costs the display and its pages time, and the names may change always."""

MOST_PICTURES = 32
"""The greatest number of pictures of the robots of one agent."""

MOST_COMPLAINTS = 20
"""The greatest number of sentences about the description of one agent."""


@dataclass(eq=False)
class _RemoteRobot:
    robot: Robot
    config: RobotConfig
    picture: PictureConfig | None = None
    """The picture that its agent has."""
    drawn: PictureConfig | None = None
    """The picture that is drawn."""


@dataclass(eq=False)
class RemoteAgent:
    """An agent of which a display has heard."""

    name: str
    bridge: Bridge
    beacon: Beacon
    about: str = ""
    """The description that is shown."""
    robots: dict[str, _RemoteRobot] = field(default_factory=dict)
    """The robots on the console, by their ids."""
    alignment: tuple[float, float, float] = (0.0, 0.0, 0.0)
    asked: deque[float] = field(default_factory=lambda: deque(maxlen=ASKED))
    """When it was asked for its description, on the monotonic clock."""
    new_robots: Budget = field(
        default_factory=lambda: Budget(NEW_ROBOTS, burst=MOST_ROBOTS / NEW_ROBOTS)
    )
    """How many robots it may add."""
    describing: asyncio.Task[None] | None = None
    complaints: set[str] = field(default_factory=set)
    pictures: dict[str, str] = field(default_factory=dict)
    """The URLs of the pictures of its robots, by name; "" for what is no picture."""
    drawing: asyncio.Task[None] | None = None

    def may_be_asked(self, now: float) -> bool:
        """Return whether it may be asked for its description now; note that it is."""
        asked = self.asked
        if len(asked) == ASKED and now - asked[0] < ASKED_WITHIN:
            return False
        asked.append(now)
        return True


class RemoteAgents:
    """Shows the robots of the agents of one router.

    Args:
        router: The address of the router; it may name one agent.

    """

    def __init__(self, router: str) -> None:
        self._turn = asyncio.Lock()
        """Held while a robot is built or destroyed."""
        self.url = router.rstrip("/")
        self.only = address.agent_in(router)
        self._place = self.url if self.only is None else self.url.rpartition("/")[0]
        self._console: Console | None = None
        self._bridges: list[Bridge] = []
        self._known: dict[str, RemoteAgent] = {}
        self._news: dict[str, Beacon] = {}
        self._news_at: dict[str, float] = {}
        """When the last sign of each agent came, on the monotonic clock."""
        self._task: asyncio.Task[None] | None = None
        self._peer = peer_of(router)
        self._peer.listen(address.beacon(self.only or address.EVERY), self._note_beacon)
        if self.only is not None:
            self._get(self.only, Beacon(PROTOCOL, "", ""))
        lifecycle.add(self)

    @property
    def has_agents(self) -> bool:
        """Whether any agent of the router was there since the start."""
        return bool(self._news)

    @property
    def trouble(self) -> str | None:
        """Why no agent can be found now."""
        return self._peer.trouble

    def join(self, bridges: list[Bridge]) -> None:
        """Add the bridges of the agents that are there, and of later ones."""
        for name, beacon in list(self._news.items()):
            self._get(name, beacon)
        bridges += [agent.bridge for agent in self._known.values()]
        self._bridges = bridges

    def show_on(self, console: Console) -> None:
        """Show the robots, and the state of the router, on a console from now on."""
        self._console = console
        if self.only is None or self._place not in console.routers:
            console.routers[self._place] = self.describe

    def describe(self) -> tuple[str, str]:
        """Return the state of the router, as for a bridge, and a sentence about it."""
        if self.trouble is not None:
            return "lost", f"{self.trouble}; reconnecting"
        now = time.monotonic()
        heard = {name: now - at < AWAY for name, at in list(self._news_at.items())}
        if not heard:
            may_not = self._peer.user.may_not
            return "connecting", f"no agent is at {self.url} yet{may_not}"
        away = sorted(name for name, is_there in heard.items() if not is_there)
        text = f"{counted(len(heard) - len(away), 'agent')} connected"
        if len(heard) == MOST_AGENTS:
            text += f"; no more than {MOST_AGENTS} are shown"
        return "open", f"{text}; away: {', '.join(away)}" if away else text

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to show robots."""
        self._task = loop.create_task(self._keep_checking())

    async def stop(self) -> None:
        """Stop to follow the agents; their robots stay on the console."""
        tasks = [self._task]
        for agent in self._known.values():
            tasks += [agent.describing, agent.drawing]
        running = [task for task in tasks if task is not None]
        for task in running:
            task.cancel()
        if running:
            await asyncio.wait(running)
        self._turn = asyncio.Lock()  # the next loop needs its own

    def _note_beacon(self, key: str, piece: bytes) -> None:
        beacon, name = read_beacon(piece), key.split("/")[1]
        if beacon is None or not address.NAME.fullmatch(name):
            return
        if name in self._news or len(self._news) < MOST_AGENTS:
            self._news[name] = beacon
            self._news_at[name] = time.monotonic()

    def _get(self, name: str, beacon: Beacon) -> RemoteAgent:
        agent = self._known.get(name)
        if agent is None:
            with no_scope():
                bridge = webmap.Bridge(f"{self._place}/{name}", name=name)
            agent = self._known[name] = RemoteAgent(name, bridge, beacon)
            self._bridges.append(bridge)
        agent.beacon = beacon
        return agent

    async def _keep_checking(self) -> None:
        while True:
            for name, beacon in list(self._news.items()):
                agent = self._get(name, beacon)
                if (
                    self._console is not None
                    and agent.about != beacon.about
                    and agent.describing is None
                    and agent.may_be_asked(time.monotonic())
                ):
                    agent.describing = spawn(self._describe(agent, self._console))
                if agent.drawing is None and _undrawn(agent):
                    agent.drawing = spawn(self._draw(agent))
            await asyncio.sleep(CHECK)

    async def _describe(self, agent: RemoteAgent, console: Console) -> None:
        """Ask an agent for its description, and show its robots."""
        beacon = agent.beacon
        try:
            if beacon.protocol != PROTOCOL:
                raise ConfigError(
                    f"the agent speaks version {beacon.protocol} of the protocol, this "
                    f"display version {PROTOCOL}: install the same WebMap on both"
                )
            ask = partial(self._peer.ask, address.about(agent.name), most=MOST_OF_ABOUT)
            answer = await asyncio.to_thread(ask)
            if answer is None:
                return
            await self._apply(agent, answer, console)
        except WebMapError as error:
            self._complain(
                agent, f"the robots of the agent {agent.name} are not shown: {error}"
            )
        except Exception:
            log.exception("the robots of the agent %s are not shown", agent.name)
        finally:
            agent.describing = None
        agent.about = beacon.about

    def _complain(self, agent: RemoteAgent, text: str) -> None:
        if text not in agent.complaints and len(agent.complaints) < MOST_COMPLAINTS:
            agent.complaints.add(text)
            log.error("%s", text)
            runtime.notice(f"{text[0].upper()}{text[1:]}.")

    async def _apply(self, agent: RemoteAgent, answer: bytes, console: Console) -> None:
        """Show the described robots, one after the other."""
        about, robots, mistakes = await asyncio.to_thread(read_about, answer)
        for text in mistakes:
            self._complain(agent, f"agent {agent.name}: {text}")
        if agent.alignment != about.alignment:
            agent.alignment = about.alignment
            align_bridge(agent.bridge, *about.alignment)
        for topic, given in about.grids[:MOST_GRIDS]:
            wrong = Mistakes()
            grid = read(MapConfig, {**given, "topic": topic}, ("map",), wrong)
            wrong.refuse(agent.name)
            assert grid is not None, "a table without a mistake is a map"
            console.add_grid(agent.bridge, grid.topic, **grid.options)
        there = {id_at_agent(agent.name, name): each for name, each in robots.items()}
        for id in agent.robots.keys() - there.keys():
            async with self._piece_of_work():
                shown = agent.robots.pop(id)
                console.forget(shown.robot)
                shown.robot.destroy()
                name = shown.robot.name
                notify(f"{name} is no longer a robot of the agent {agent.name}")
        bridges = dict.fromkeys([*about.bridges, agent.bridge.url], agent.bridge)
        for id, config in there.items():
            try:
                if id not in agent.robots:
                    await asyncio.sleep(agent.new_robots.wait(time.monotonic()))
                    agent.new_robots.spend(1, 0, 0.0, time.monotonic())
                async with self._piece_of_work():
                    self._show(agent, id, config, bridges, console)
            except WebMapError as error:
                text = f"{config.name} of the agent {agent.name} is not shown: {error}"
                self._complain(agent, text)

    @contextlib.asynccontextmanager
    async def _piece_of_work(self) -> AsyncIterator[None]:
        """Let all other work have as much time as the work within took."""
        async with self._turn:
            began = time.monotonic()
            try:
                yield
            finally:
                await asyncio.sleep(time.monotonic() - began)

    def _show(
        self,
        agent: RemoteAgent,
        id: str,
        given: RobotConfig,
        bridges: dict[str, Bridge],
        console: Console,
    ) -> None:
        config, picture = config_from_agent(given, agent.bridge.url, id, bridges)
        shown = agent.robots.get(id)
        if shown is not None:
            shown.picture = picture
            config = msgspec.structs.replace(config, name=shown.config.name)
            if shown.config != config:
                old, shown.config = shown.config, config
                with no_scope():
                    mistakes = apply_config(shown.robot, old, config, bridges)
                for path, message in mistakes.found:
                    log.error("%s: %s: %s", shown.robot.name, path[0], message)
            return
        name = shown_name(config.name, agent.name)
        config = msgspec.structs.replace(config, name=name)
        token = agent_robot_id.set(id)
        try:
            with no_scope():
                robot = make_robot(config, bridges)
        finally:
            agent_robot_id.reset(token)
        agent.robots[id] = _RemoteRobot(robot, config, picture)
        console.add(robot)
        notify(f"{robot.name} is a robot of the agent {agent.name}")

    async def _draw(self, agent: RemoteAgent) -> None:
        """Draw the robots of an agent as their pictures, which the agent has."""
        try:
            for shown in _undrawn(agent):
                picture = shown.picture
                if picture is None:
                    draw_picture(shown.robot, None, "")
                elif not await self._get_picture(agent, picture.file):
                    continue
                elif shown.picture == picture and shown in agent.robots.values():
                    draw_picture(shown.robot, picture, agent.pictures[picture.file])
                shown.drawn = picture
            used = {each.picture.file for each in agent.robots.values() if each.picture}
            for name in agent.pictures.keys() - used:
                pictures.retire(agent.pictures.pop(name))
        finally:
            agent.drawing = None

    async def _get_picture(self, agent: RemoteAgent, name: str) -> bool:
        """Publish a picture of an agent; return whether it is one."""
        if name not in agent.pictures:
            key = address.about_picture(agent.name, name)
            ask = self._peer.ask
            try:
                if len(agent.pictures) >= MOST_PICTURES:
                    raise ConfigError(f"it has more than {MOST_PICTURES} pictures")
                answer = await asyncio.to_thread(ask, key, PICTURE_PATIENCE, LARGEST)
                if answer is None:
                    await asyncio.sleep(PICTURE_AGAIN)
                    return False
                found = await asyncio.to_thread(picture_from_agent, name, answer)
                agent.pictures[name] = pictures.publish(*found)
            except WebMapError as error:
                agent.pictures[name] = ""
                self._complain(
                    agent, f"a picture of the agent {agent.name} is not shown: {error}"
                )
        return agent.pictures[name] != ""


def _undrawn(agent: RemoteAgent) -> list[_RemoteRobot]:
    """Return the robots that are drawn otherwise than their agent has them."""
    return [
        each
        for each in agent.robots.values()
        if each.drawn != each.picture
        and (each.picture is None or agent.pictures.get(each.picture.file) != "")
    ]


def find_agents(routers: Sequence[str], bridges: list[Bridge]) -> list[RemoteAgents]:
    """Return the agents of routers, after a moment in which those there are heard.

    Args:
        routers: The addresses of the routers.
        bridges: Gets the bridges of the agents, also of those that come later.

    """
    found = [RemoteAgents(router) for router in routers]
    until = time.monotonic() + FIRST
    while found and time.monotonic() < until:
        time.sleep(0.05)
    for each in found:
        each.join(bridges)
        if each.trouble is not None:
            echo(f"{each.trouble}. Its robots appear when it is there.", err=True)
        elif not each.has_agents:
            text = each.describe()[1]
            text = f"{text[0].upper()}{text[1:]}. Robots appear when one is there."
            echo(text, err=True)
    return found
