"""``webmap agent``: the gate beside a robot, and the robot's data for displays."""

import asyncio
import hashlib
import logging
import math
import secrets
import shlex
import signal
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple
from urllib.parse import urlsplit

import msgspec

import webmap
from webmap.agents import address, clients, data
from webmap.agents.address import Sender, sender_of
from webmap.agents.agent_gate import AgentGate
from webmap.agents.clients import Call, Clients
from webmap.agents.peer import Peer, peer_of
from webmap.base.children import python_command
from webmap.base.errors import BridgeError, ConfigError, WireError
from webmap.base.lifecycle import lifecycle
from webmap.base.tasks import spawn
from webmap.config.checks import Mistakes
from webmap.config.fleet import read_fleet
from webmap.config.robot import RobotConfig
from webmap.config.toml_text import read_text
from webmap.console import Console, make_robot
from webmap.core.runtime import runtime
from webmap.fleet.found import find_fleet
from webmap.fleet.given import given_robots
from webmap.fleet.made import make_bridges
from webmap.fleet.overrides import Overrides
from webmap.gate.protocol import Role
from webmap.poses.alignment import alignments
from webmap.ros.names import normalise_topic
from webmap.ros.rosbridge.calls import Calls
from webmap.ros.rosbridge.connection import Lane
from webmap.ros.rosbridge.events import Publish
from webmap.ros.rosbridge.protocol import Protocol

if TYPE_CHECKING:
    from webmap import Bridge

log = logging.getLogger("webmap.agent")

PROTOCOL = 1
"""The version of what agents and displays exchange."""

BEACON = 0.5
"""Seconds between two signs that the agent is there."""

LISTEN = 2.0
"""Seconds for which an agent listens for another one of its name before it begins."""

LOOPBACK = ("localhost", "127.0.0.1", "::1")


class Beacon(msgspec.Struct, frozen=True):
    """The sign that an agent is there."""

    protocol: int
    session: str
    about: str
    """Changes whenever the description of the robots changes."""


class AgentRobot(msgspec.Struct, frozen=True):
    """A robot of an agent."""

    id: str
    config: dict[str, Any]


class About(msgspec.Struct, frozen=True):
    """The description of the robots of an agent."""

    bridges: list[str]
    """The names of the agent's bridge in the configurations."""
    robots: list[AgentRobot]
    grids: list[tuple[str, dict[str, Any]]]
    """The topics of maps under the robots, with their options."""
    alignment: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """The pose of the maps of all robots on the common one: metres and degrees."""


class HeldRobot(NamedTuple):
    """A robot that the agent holds."""

    id: str
    config: RobotConfig


class Held(NamedTuple):
    """The robots of an agent and the maps under them, behind one rosbridge."""

    bridge: "Bridge"
    robots: Callable[[], list[HeldRobot]]
    """Returns the robots that the agent holds now."""
    grids: Callable[[], Mapping[str, dict[str, Any]]]
    """Returns the options of the maps under the robots, by topic."""


def held_behind(
    url: str, robots: Sequence[str], overrides: Overrides, wait: float
) -> Held:
    """Return the robots behind a rosbridge, found by their topics or given.

    Args:
        url: The address of the rosbridge.
        robots: The values of ``--robot``.
        overrides: Settings that replace guesses.
        wait: How long to wait for an unreachable rosbridge, in seconds.

    Raises:
        ConfigError: If an argument is invalid.

    """
    bridge, console = webmap.Bridge(url), Console()
    given = given_robots(robots, [bridge])
    fleet = find_fleet([bridge], given, wait=wait, overrides=overrides)
    shown = fleet.hold(console, moving_parts)
    return Held(
        bridge,
        lambda: [HeldRobot(each.robot.motion.id, each.config) for each in shown.shown],
        lambda: {topic: options for (_, topic), options in console.grids.items()},
    )


def held_in_file(file: Path) -> Held:
    """Return the robots of a fleet file with one bridge.

    Raises:
        ConfigError: If the file has mistakes, or several bridges.
        OSError: If it cannot be read.

    """
    text, mistakes = read_text(file), Mistakes()
    fleet = read_fleet(text.data, mistakes)
    if not mistakes.found and len(fleet.bridges) != 1:
        mistakes.add(("bridges",), "an agent is beside the robots of one bridge")
    for index, each in enumerate(fleet.robots):
        if each.picture is not None:
            message = "an agent has no pictures; give the robot a model instead"
            mistakes.add(("robots", index, "picture"), message)
    text.refuse(mistakes)
    bridges = make_bridges(fleet)
    (bridge,) = bridges.values()
    made = [make_robot(moving_parts(config), bridges) for config in fleet.robots]
    _kept.extend(made)
    robots = [
        HeldRobot(robot.motion.id, config)
        for robot, config in zip(made, fleet.robots, strict=True)
    ]
    grids: dict[str, dict[str, Any]] = {}
    for grid in fleet.map:
        options = {"palette": grid.palette, "order": grid.order}
        grids[grid.topic] = {
            key: value for key, value in options.items() if value is not None
        }
    return Held(bridge, lambda: robots, lambda: grids)


_kept: list[object] = []
"""Robots that live as long as the process."""


def moving_parts(config: RobotConfig) -> RobotConfig:
    """Return what an agent itself needs of a robot: that which moves it."""
    return RobotConfig(
        name=config.name,
        bridge=config.bridge,
        base_link=config.base_link,
        odometry=config.odometry,
        alignment=config.alignment,
        motion=config.motion,
    )


def warn_of_open_bridge(url: str) -> None:
    """Log a warning if other computers may reach the rosbridge too."""
    if (urlsplit(url).hostname or "") not in LOOPBACK:
        log.warning(
            "%s is not an address of this computer: whoever reaches that rosbridge can "
            "drive the robot without the agent; let rosbridge listen on 127.0.0.1 and "
            "run the agent beside it",
            url,
        )


class Agent:
    """Holds the gate of the robots behind one rosbridge, and serves displays.

    Args:
        name: The name of the agent.
        router: The address of the Zenoh router.
        held: Its robots.
        roles: What the pages of each user may do at most.
        throttles: The least milliseconds between two messages, by topic.

    """

    def __init__(
        self,
        name: str,
        router: str,
        held: Held,
        *,
        roles: Mapping[str, Role] | None = None,
        throttles: Mapping[str, int] | None = None,
    ) -> None:
        self.name = address.checked_name(name)
        self.url = url = held.bridge.url
        self._held = held
        self._session = secrets.token_hex(8)
        self._about = b""
        self._peer: Peer = peer_of(router)
        self.address = f"{address.url(self._peer.locator)}/{self.name}"
        """The address of the agent for displays."""
        self._serving = False
        self._rival: str | None = None
        self._out = address.gate_out(self.name)
        self._protocol = Protocol()
        self._calls = Calls(url)
        self._allowed: tuple[frozenset[str], frozenset[str]] = (
            frozenset(),
            frozenset(),
        )
        self._clients = Clients(
            upstream=self._upstream,
            reply=self._reply,
            note=self._note,
            call=self._call,
            publishes=lambda: self._allowed[0],
            calls=lambda: self._allowed[1],
            throttles=throttles,
        )
        self._lane = Lane(
            url,
            opened=self._bridge_opened,
            received=self._received,
            closed=self._clients.closed,
            failed=lambda error: self._clients.closed(error.why or str(error)),
        )
        self._task: asyncio.Task[None] | None = None
        self._loop: asyncio.AbstractEventLoop | None = None
        self._roles = roles
        self.gate: AgentGate | None = None
        lifecycle.add(self)

    def make_gate(self) -> AgentGate:
        """Return the client of the agent's gate."""
        self.gate = AgentGate(self._publish, self._roles)
        return self.gate

    def _publish(self, sample: bytes) -> None:
        if self._serving:  # else nothing of the displays is heard
            self._peer.put_gate(self._out, sample)

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Connect to the rosbridge and serve displays."""
        self._loop = loop
        self._task = loop.create_task(self._run())
        self._lane.start(loop)

    async def stop(self) -> None:
        """Close the connections."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])
        await self._lane.stop()
        await self._calls.stop()

    # The agent and the router.

    async def _run(self) -> None:
        peer, name = self._peer, self.name
        peer.listen(address.here(name), self._heard_of)
        await self._wait_for_own_name()
        everybody = address.EVERY
        peer.answer(address.about(name), lambda: self._about)
        peer.listen(
            address.gate_in(name, everybody, everybody), self._sample, gate=True
        )
        peer.listen(address.data_in(name, everybody, everybody, everybody), self._piece)
        self._serving = True
        while True:
            self._describe()
            beacon = Beacon(
                PROTOCOL, self._session, hashlib.sha256(self._about).hexdigest()[:16]
            )
            peer.put_data(address.here(name), msgspec.json.encode(beacon))
            self._clients.look(time.monotonic())
            await asyncio.sleep(BEACON)

    async def _wait_for_own_name(self) -> None:
        """Wait until no other agent uses the name."""
        complained = False
        heard_for = 0.0
        while heard_for < LISTEN:
            self._rival = None
            await asyncio.sleep(BEACON)
            heard_for = heard_for + BEACON if self._peer.connected else 0.0
            if self._rival is not None:
                heard_for = 0.0
                if not complained:
                    log.error(
                        "another agent is called %s: give each its own --name; this "
                        "one waits, and nothing moves through it",
                        self.name,
                    )
                complained = True

    def _heard_of(self, _key: str, piece: bytes) -> None:
        beacon = read_beacon(piece)
        if beacon is not None and beacon.session != self._session:
            self._rival = beacon.session

    def _describe(self) -> None:
        held = self._held.robots()
        robots = [AgentRobot(each.id, each.config.to_dict()) for each in held]
        names = sorted({self.url, self._held.bridge.name})
        grids = list(self._held.grids().items())
        pose = alignments.of(self._held.bridge)
        placed = (pose.x, pose.y, math.degrees(pose.yaw))
        about = About(names, robots, grids, placed)
        self._about = msgspec.json.encode(about)
        buttons = [button for each in held for button in each.config.buttons]
        self._allowed = (
            frozenset(button["topic"] for button in buttons if "topic" in button),
            frozenset(button["service"] for button in buttons if "service" in button),
        )

    def _sample(self, key: str, sample: bytes) -> None:
        if self.gate is not None:
            self.gate.take_sample(sender_of(key).display, sample)

    # Data.

    def _piece(self, key: str, piece: bytes) -> None:
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._take, sender_of(key), piece)

    def _take(self, client: Sender, piece: bytes) -> None:
        try:
            self._clients.receive(client, piece, time.monotonic())
        except (WireError, BridgeError) as error:
            log.warning("display %s: %s", client.display, error)

    def _bridge_opened(self) -> None:
        log.info("%s: the connection is open", self.url)
        self._protocol = Protocol()
        self._clients.opened(secrets.token_hex(8))

    def _upstream(self, frame: bytes) -> None:
        if self._lane.state == "open":
            self._lane.send(frame)

    def _received(self, frame: bytes | bytearray) -> None:
        now = time.monotonic()
        event = self._protocol.receive(frame, now)
        if isinstance(event, Publish) and self._clients.message(
            event.topic, event.frame, now
        ):
            key = address.topic_key(self.name, event.topic)
            self._peer.put_data(key, data.pack_frame(event.frame))

    def _reply(self, client: Sender, frame: bytes) -> None:
        self._put(client, data.pack_frame(frame))

    def _note(self, client: Sender, pong: data.Pong) -> None:
        self._put(client, data.pack_note(pong))

    def _put(self, client: Sender, piece: bytes) -> None:
        key = address.data_out(self.name, *client)
        self._peer.put_data(key, piece, all=True)

    def _call(self, call: Call) -> None:
        spawn(self._answer(call))

    async def _answer(self, call: Call) -> None:
        try:
            args: Any = clients.args_of(call)
            values = await self._calls.call(call.service, args, call.type, 30.0)
            frame = clients.answered(call, values)
        except (BridgeError, WireError, ValueError, TypeError) as error:
            frame = clients.answered(call, str(error), well=False)
        self._reply(call.client, frame)


def read_beacon(piece: bytes) -> Beacon | None:
    """Return the beacon in a message; None if it is none."""
    try:
        return msgspec.json.decode(piece, type=Beacon)
    except msgspec.DecodeError:
        return None


def parse_operators(text: str) -> dict[str, Role]:
    """Return what the pages of each user may do at most.

    Args:
        text: The users that may drive, separated by commas.

    Raises:
        ConfigError: If one cannot be a user.

    """
    roles: dict[str, Role] = {"": "viewer"}
    for user in text.split(","):
        roles[address.checked_name(user.strip(), "user")] = "operator"
    return roles


def parse_rates(texts: Sequence[str]) -> dict[str, int]:
    """Return the least milliseconds between two messages, by topic.

    Args:
        texts: The values of ``--rate``: ``/scan=5``.

    Raises:
        ConfigError: If one has another form.

    """
    throttles = {}
    for text in texts:
        topic, _, rate = text.partition("=")
        try:
            hertz = float(rate)
        except ValueError:
            hertz = 0.0
        if not hertz > 0.0:
            raise ConfigError(f"rate {text!r}: expected a topic and Hz, as in /scan=5")
        throttles[normalise_topic(topic)] = round(1000 / hertz)
    return throttles


def systemd_unit(name: str, arguments: Sequence[str]) -> str:
    """Return a unit that runs an agent.

    Args:
        name: The name of the agent.
        arguments: The command line after ``webmap``, with ``--systemd``.

    """
    given = [text for text in arguments if text != "--systemd"]
    command = python_command("webmap", *given)
    return "\n".join(
        (
            "[Unit]",
            f"Description=WebMap agent {address.checked_name(name)}",
            "After=network-online.target",
            "Wants=network-online.target",
            "",
            "[Service]",
            f"ExecStart={shlex.join(command)}",
            "# WEBMAP_ROUTER_USER, WEBMAP_ROUTER_PASSWORD and WEBMAP_ROUTER_CA",
            f"EnvironmentFile=-/etc/webmap/{name}.env",
            "DynamicUser=yes",
            f"StateDirectory=webmap-{name}",
            f"Environment=WEBMAP_STATE_DIR=/var/lib/webmap-{name}",
            "Restart=always",
            "RestartSec=1",
            "",
            "[Install]",
            "WantedBy=multi-user.target",
        )
    )


def run_agent(
    agent: Agent, ready: Callable[[], object], ended: threading.Event
) -> None:
    """Run an agent until the process is told to end.

    Args:
        agent: The agent.
        ready: Called when it runs.
        ended: Set when it should end.

    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: ended.set())
    runtime.make_gate = agent.make_gate
    runtime.start()
    try:
        ready()
        ended.wait()
    finally:
        runtime.stop()
