"""The robots of agents on the console: found, changed and removed with their agents."""

import asyncio
import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import msgspec

import webmap
from webmap.agents import address
from webmap.agents.description import (
    PROTOCOL,
    About,
    AgentRobot,
    Beacon,
    read_beacon,
)
from webmap.agents.peer import peer_of
from webmap.base.counted import counted
from webmap.base.echo import echo, notify
from webmap.base.errors import WebMapError
from webmap.base.lifecycle import lifecycle
from webmap.base.scope import no_scope
from webmap.base.tasks import spawn
from webmap.config.robot import PictureConfig, RobotConfig
from webmap.console import Console, make_robot
from webmap.console.fleet import draw_picture
from webmap.core.configure import apply
from webmap.core.motion import given_id, shown_name
from webmap.core.pictures import pictures
from webmap.core.runtime import runtime
from webmap.fleet.passed_on import accepted, received_picture
from webmap.poses.alignment import align_bridge

if TYPE_CHECKING:
    from webmap import Bridge, Robot

log = logging.getLogger("webmap.agent")

FIRST = 1.5
"""Seconds for which a display listens for agents before it opens its page."""

LOOK = 0.5
"""Seconds between two looks at the signs of the agents."""

PICTURE_PATIENCE = 15.0
"""Seconds for the picture of a robot, which a slow link carries late."""

PICTURE_AGAIN = 5.0
"""Seconds after which a picture that did not come is asked for again."""

AWAY = 3.0
"""Seconds without a sign of an agent after which it is shown as away."""


@dataclass(eq=False)
class _Shown:
    robot: "Robot"
    config: RobotConfig
    picture: PictureConfig | None = None
    """The picture that its agent has."""
    drawn: PictureConfig | None = None
    """The picture that is drawn."""


@dataclass(eq=False)
class KnownAgent:
    """An agent of which a display has heard."""

    name: str
    bridge: "Bridge"
    beacon: Beacon
    about: str = ""
    """The description that is shown."""
    robots: dict[str, _Shown] = field(default_factory=dict)
    """The robots on the console, by their ids."""
    alignment: tuple[float, float, float] = (0.0, 0.0, 0.0)
    complained: str = ""
    pictures: dict[str, str] = field(default_factory=dict)
    """The URLs of the pictures of its robots, by name; "" for what is no picture."""
    drawing: "asyncio.Task[None] | None" = None


class Agents:
    """Shows the robots of the agents of one router.

    Args:
        router: The address of the router; it may name one agent.

    """

    def __init__(self, router: str) -> None:
        self.url = router.rstrip("/")
        self.only = address.agent_in(router)
        self._place = self.url if self.only is None else self.url.rpartition("/")[0]
        self._console: Console | None = None
        self._bridges: list[Bridge] = []
        self._known: dict[str, KnownAgent] = {}
        self._news: dict[str, Beacon] = {}
        self._news_at: dict[str, float] = {}
        """When the last sign of each agent came, on the monotonic clock."""
        self._task: asyncio.Task[None] | None = None
        self._peer = peer_of(router)
        self._peer.listen(address.here(self.only or address.EVERY), self._heard)
        if self.only is not None:
            self._get(self.only, Beacon(PROTOCOL, "", ""))
        lifecycle.add(self)

    @property
    def heard(self) -> bool:
        """Whether a sign of an agent came."""
        return bool(self._news)

    @property
    def trouble(self) -> str | None:
        """Why no agent can be found now."""
        return self._peer.trouble

    def join(self, bridges: "list[Bridge]") -> None:
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
            return "connecting", f"no agent is at {self.url} yet"
        away = sorted(name for name, is_there in heard.items() if not is_there)
        text = f"{counted(len(heard) - len(away), 'agent')} connected"
        return "open", f"{text}; away: {', '.join(away)}" if away else text

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begin to show robots."""
        self._task = loop.create_task(self._look_on())

    async def stop(self) -> None:
        """Stop to show changes."""
        tasks = [self._task, *(agent.drawing for agent in self._known.values())]
        running = [task for task in tasks if task is not None]
        for task in running:
            task.cancel()
        if running:
            await asyncio.wait(running)

    def _heard(self, key: str, piece: bytes) -> None:
        beacon = read_beacon(piece)
        if beacon is not None:
            name = key.split("/")[1]
            self._news[name] = beacon
            self._news_at[name] = time.monotonic()

    def _get(self, name: str, beacon: Beacon) -> KnownAgent:
        agent = self._known.get(name)
        if agent is None:
            with no_scope():
                bridge = webmap.Bridge(f"{self._place}/{name}", name=name)
            agent = self._known[name] = KnownAgent(name, bridge, beacon)
            self._bridges.append(bridge)
        agent.beacon = beacon
        return agent

    async def _look_on(self) -> None:
        while True:
            for name, beacon in list(self._news.items()):
                agent = self._get(name, beacon)
                if self._console is not None and agent.about != beacon.about:
                    try:
                        await self._describe(agent, self._console)
                    except Exception:
                        log.exception("the robots of the agent %s are not shown", name)
                if agent.drawing is None and _undrawn(agent):
                    agent.drawing = spawn(self._draw(agent))
            await asyncio.sleep(LOOK)

    async def _describe(self, agent: KnownAgent, console: Console) -> None:
        beacon = agent.beacon
        if beacon.protocol != PROTOCOL:
            self._complain(
                agent,
                f"the agent {agent.name} speaks version {beacon.protocol} of the "
                f"protocol, this display version {PROTOCOL}: install the same WebMap "
                "on both",
            )
            return
        answer = await asyncio.to_thread(self._peer.ask, address.about(agent.name))
        if answer is None:
            return
        try:
            about = msgspec.json.decode(answer, type=About)
            self._apply(agent, about, console)
        except (msgspec.DecodeError, WebMapError) as error:
            self._complain(
                agent, f"the robots of the agent {agent.name} cannot be read: {error}"
            )
        agent.about = beacon.about

    def _complain(self, agent: KnownAgent, text: str) -> None:
        agent.about = agent.beacon.about
        if agent.complained != text:
            agent.complained = text
            log.error("%s", text)
            runtime.notice(f"{text[0].upper()}{text[1:]}.")

    def _apply(self, agent: KnownAgent, about: About, console: Console) -> None:
        if agent.alignment != about.alignment:
            agent.alignment = about.alignment
            align_bridge(agent.bridge, *about.alignment)
        for topic, options in about.grids:
            console.add_grid(agent.bridge, topic, **options)
        there = {each.id: each for each in about.robots}
        for id in [id for id in agent.robots if id not in there]:
            shown = agent.robots.pop(id)
            console.forget(shown.robot)
            shown.robot.destroy()
            notify(f"{shown.robot.name} is no longer a robot of the agent {agent.name}")
        bridges = dict.fromkeys([*about.bridges, agent.bridge.url], agent.bridge)
        for each in there.values():
            try:
                self._show(agent, each, bridges, console)
            except WebMapError as error:
                name = each.config.get("name", each.id)
                self._complain(
                    agent, f"{name} of the agent {agent.name} is not shown: {error}"
                )

    def _show(
        self,
        agent: KnownAgent,
        each: AgentRobot,
        bridges: "dict[str, Bridge]",
        console: Console,
    ) -> None:
        given = RobotConfig.from_dict(each.config)
        config, picture = accepted(given, agent.bridge.url, each.id, bridges)
        shown = agent.robots.get(each.id)
        if shown is not None:
            shown.picture = picture
            config = msgspec.structs.replace(config, name=shown.config.name)
            if shown.config != config:
                old, shown.config = shown.config, config
                with no_scope():
                    mistakes = apply(shown.robot, old, config, bridges)
                for path, message in mistakes.found:
                    log.error("%s: %s: %s", shown.robot.name, path[0], message)
            return
        name = shown_name(config.name, agent.name)
        config = msgspec.structs.replace(config, name=name)
        token = given_id.set(each.id)
        try:
            with no_scope():
                robot = make_robot(config, bridges)
        finally:
            given_id.reset(token)
        agent.robots[each.id] = _Shown(robot, config, picture)
        console.add(robot)
        notify(f"{robot.name} is a robot of the agent {agent.name}")

    async def _draw(self, agent: KnownAgent) -> None:
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

    async def _get_picture(self, agent: KnownAgent, name: str) -> bool:
        """Publish a picture of an agent; return whether it is one."""
        if name not in agent.pictures:
            key = address.about_picture(agent.name, name)
            answer = await asyncio.to_thread(self._peer.ask, key, PICTURE_PATIENCE)
            if answer is None:
                await asyncio.sleep(PICTURE_AGAIN)
                return False
            try:
                found = await asyncio.to_thread(received_picture, name, answer)
                agent.pictures[name] = pictures.publish(*found)
            except WebMapError as error:
                agent.pictures[name] = ""
                self._complain(
                    agent, f"a picture of the agent {agent.name} is not shown: {error}"
                )
        return agent.pictures[name] != ""


def _undrawn(agent: KnownAgent) -> list[_Shown]:
    """Return the robots that are drawn otherwise than their agent has them."""
    return [
        each
        for each in agent.robots.values()
        if each.drawn != each.picture
        and (each.picture is None or agent.pictures.get(each.picture.file) != "")
    ]


def find_agents(routers: Sequence[str], bridges: "list[Bridge]") -> list[Agents]:
    """Return the agents of routers, after a moment in which those there are heard.

    Args:
        routers: The addresses of the routers.
        bridges: Gets the bridges of the agents, also of those that come later.

    """
    found = [Agents(router) for router in routers]
    until = time.monotonic() + FIRST
    while found and time.monotonic() < until:
        time.sleep(0.05)
    for each in found:
        each.join(bridges)
        if each.trouble is not None:
            echo(f"{each.trouble}. Its robots appear when it is there.", err=True)
        elif not each.heard:
            echo(
                f"No agent is at {each.url} yet. Robots appear when one is there.",
                err=True,
            )
    return found
