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
from functools import partial
from typing import Any

import msgspec

from webmap.agents import address, bridge_proxy, data_messages
from webmap.agents.address import Sender, sender_of
from webmap.agents.agent_cameras import AgentCameras
from webmap.agents.announcements import PROTOCOL, About, Beacon, read_beacon
from webmap.agents.bridge_proxy import BridgeProxy, Call
from webmap.agents.data_messages import lean_scan
from webmap.agents.displays import MOST_USERS
from webmap.agents.gate_messages import MAX_BYTES, MOST_SAMPLE
from webmap.agents.gates import AgentGate
from webmap.agents.peer import MOST_CHANGES_BYTES, Peer, peer_of
from webmap.agents.rate_limit import Receiver
from webmap.base.errors import BridgeError, ConfigError, WireError
from webmap.base.lifecycle import lifecycle
from webmap.base.processes import load_soon, python_command
from webmap.base.roles import Role
from webmap.base.tasks import spawn
from webmap.core.runtime import runtime
from webmap.fleet.agent_robots import (
    AgentRobots,
    open_addresses,
    warn_of_open_bridge,
)
from webmap.fleet.robot_files import (
    button_actions,
    check_parameters,
    config_for_displays,
)
from webmap.poses.alignment import alignments
from webmap.ros.foxglove.as_rosbridge import RosbridgeOfFoxglove
from webmap.ros.names import has_gate, is_foxglove_url, is_type, normalise_topic
from webmap.ros.rosbridge.calls import Calls
from webmap.ros.rosbridge.events import Publish
from webmap.ros.rosbridge.graph import BridgeGraph
from webmap.ros.rosbridge.protocol import Protocol
from webmap.ros.sockets.connection import BridgeConnection
from webmap.ros.subscriptions import each_counts

log = logging.getLogger("webmap.agent")

BEACON = 0.5
"""Seconds between two signs that the agent is there."""

TYPES = 5.0
"""Seconds between two questions for the types of topics, and for their answer."""

UNHEARD = 5.0
"""Seconds after which a router that has sent no sign of an agent back hides it."""

LISTEN = 2.0
"""Seconds for which an agent listens for another one of its name before it begins."""


class Agent:
    """Runs the gate of the robots behind one rosbridge, and serves displays.

    Args:
        name: The name of the agent.
        router: The address of the Zenoh router.
        robots: Its robots.
        roles: What the pages of each user may do at most.
        throttles: The least milliseconds between two messages, by topic.
        beams: The greatest number of beams of a scan, by topic.

    """

    def __init__(
        self,
        name: str,
        router: str,
        robots: AgentRobots,
        *,
        roles: Mapping[str, Role] | None = None,
        throttles: Mapping[str, int] | None = None,
        beams: Mapping[str, int] | None = None,
    ) -> None:
        self.name = address.checked_name(name)
        self.url = url = robots.bridge.url
        if not has_gate(url):
            raise ConfigError(
                f"got {url}, expected the address of a rosbridge or a Foxglove bridge: "
                "an agent drives its robots through one of them"
            )
        self._robots = robots
        self._session = secrets.token_hex(8)
        self._buttons: list[dict[str, str]] = []
        self._about = b""
        self._open_at: list[str] | None = None
        self._peer: Peer = peer_of(router, most=2 * MAX_BYTES)
        self.address = f"{address.url(self._peer.locator)}/{self.name}"
        """The address of the agent for displays."""
        self._cameras = AgentCameras(self.name, self._peer)
        self._serving = False
        self._rival: str | None = None
        self._unheard: float | None = 0.0
        """Seconds for which the router has not sent a sign back; None after the first,
        and after the complaint."""
        self._out = address.gate_out(self.name)
        self._protocol = Protocol()
        self._calls: dict[str, Calls] = {}
        """The calls of each user: one that hangs delays no other user's."""
        self._graph = BridgeGraph(
            lambda service, args=None, timeout=TYPES: self._calls_of("").call(
                service, args, None, timeout
            )
        )
        self._proxy = BridgeProxy(
            upstream=self._upstream,
            reply=self._reply,
            note=self._note,
            call=self._call,
            publishes=lambda: {
                each["topic"]: each.get("type", "")
                for each in self._buttons
                if "topic" in each
            },
            calls=lambda: _each("service", self._buttons),
            details=lambda: _each("type", self._buttons) - {""},
            throttles=throttles,
        )
        self._receiver = Receiver("messages", self._proxy.receive)
        self._beams = dict(beams or {})
        self._whole: set[str] = set()
        """The topics whose messages could not be read as scans."""
        self._lane_type = BridgeConnection
        if is_foxglove_url(url):
            self._lane_type = RosbridgeOfFoxglove
        self._lane = self._lane_type(
            url,
            opened=self._bridge_opened,
            received=self._received,
            closed=self._proxy.closed,
            failed=lambda error: self._proxy.closed(error.why or str(error)),
        )
        self._task: asyncio.Task[None] | None = None
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
        self._receiver.start(loop)
        self._task = loop.create_task(self._run())
        self._lane.start(loop)

    async def stop(self) -> None:
        """Close the rosbridge's connections; the gate ends with the runtime."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.wait([self._task])
        await self._cameras.stop()
        await self._lane.stop()
        for calls in self._calls.values():
            await calls.stop()

    # The agent and the router.

    async def _run(self) -> None:
        peer, name = self._peer, self.name
        load_soon("numpy")  # for scans
        peer.listen(address.beacon(name), self._note_beacon, back=True)
        await self._wait_for_own_name()
        everybody = address.EVERY
        peer.answer(address.about(name), lambda: self._about)
        pictures = self._robots.pictures
        for picture in pictures:
            key = address.about_picture(name, picture)
            peer.answer(key, partial(pictures.__getitem__, picture))
        gate_in = address.gate_in(name, everybody, everybody)
        peer.listen(gate_in, self._sample, gate=True, most=MOST_SAMPLE)
        data_in = address.data_in(name, everybody, everybody, everybody)
        peer.listen(
            data_in, self._receiver.receive, most=data_messages.MOST_OF_DISPLAY + 1
        )
        typing = spawn(self._learn_types())
        self._cameras.start(asyncio.get_running_loop())
        self._serving = True
        try:
            await self._serve()
        finally:
            typing.cancel()

    async def _serve(self) -> None:
        peer, name = self._peer, self.name
        while True:
            self._describe()
            beacon = Beacon(
                PROTOCOL, self._session, hashlib.sha256(self._about).hexdigest()[:16]
            )
            peer.put_data(address.beacon(name), msgspec.json.encode(beacon))
            self._note_unheard()
            self._proxy.check(time.monotonic())
            self._cameras.check(time.monotonic())
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

    def _note_beacon(self, _key: str, piece: bytes) -> None:
        beacon = read_beacon(piece)
        if beacon is None:
            return
        if beacon.session == self._session:
            self._unheard = None
        else:
            self._rival = beacon.session

    def _note_unheard(self) -> None:
        """Log once if the router passes on nothing of this agent."""
        if self._unheard is None:
            return
        self._unheard = self._unheard + BEACON if self._peer.connected else 0.0
        if self._unheard > UNHEARD:
            self._unheard = None
            log.error(
                "the router passes on nothing of this agent, so no display sees it: "
                "the router's user %s may not act as the agent %s; use the user of "
                'the router\'s file with agent = "%s"',
                self._peer.user.name,
                self.name,
                self.name,
            )

    def _describe(self) -> None:
        robots = self._robots.robots()
        configs = [
            msgspec.Raw(msgspec.json.encode(config_for_displays(each.config).to_dict()))
            for each in robots
        ]
        self._cameras.set_cameras(robots)
        names = sorted({self.url, self._robots.bridge.name})
        grids = list(self._robots.grids().items())
        pose = alignments.of(self._robots.bridge)
        placed = (pose.x, pose.y, math.degrees(pose.yaw))
        about = About(names, configs, grids, placed, self._open_at)
        self._about = msgspec.json.encode(about)
        self._buttons = [each for one in robots for each in button_actions(one.config)]

    def _sample(self, key: str, sample: bytes) -> None:
        if self.gate is not None:
            self.gate.take_sample(sender_of(key).display, sample)

    # Data.

    def _bridge_opened(self) -> None:
        log.info("%s: the connection is open", self.url)
        places, self._open_at = self._open_at, open_addresses(self.url)
        if self._open_at and self._open_at != places:
            warn_of_open_bridge(self.url, self._open_at)
        self._protocol = Protocol()
        self._proxy.opened(secrets.token_hex(8), time.monotonic())

    def _upstream(self, frame: bytes) -> None:
        if self._lane.state == "open":
            self._lane.send(frame)

    def _received(self, frame: bytes | bytearray) -> None:
        now = time.monotonic()
        event = self._protocol.receive(frame, now)
        if isinstance(event, Publish) and self._proxy.message(
            event.topic, event.frame, now, in_parts=event.in_parts
        ):
            key = address.topic_key(self.name, event.topic)
            type = self._proxy.type_of(event.topic)
            frame = self._lean(event.topic, type, event.frame)
            piece = data_messages.pack_frame(frame)
            if each_counts(event.topic, type):
                self._peer.put_data(key, piece, all=True, size=MOST_CHANGES_BYTES)
            else:
                self._peer.put_data(key, piece)

    def _lean(
        self, topic: str, type: str | None, frame: bytes | bytearray
    ) -> bytes | bytearray:
        beams = self._beams.get(topic)
        is_scan = beams is not None or (type and is_type(type, "sensor_msgs/LaserScan"))
        if not is_scan or topic in self._whole:
            return frame
        try:
            return lean_scan(frame, beams)
        except WireError as error:
            self._whole.add(topic)
            log.warning("%s is sent with all of its data: %s", topic, error)
            return frame

    def _reply(self, client: Sender, frame: bytes) -> None:
        self._put(client, data_messages.pack_frame(frame))

    def _note(self, client: Sender, pong: data_messages.Pong) -> None:
        self._put(client, data_messages.pack_note(pong))

    def _put(self, client: Sender, piece: bytes) -> None:
        key = address.data_out(self.name, *client)
        self._peer.put_data(key, piece, all=True)

    async def _learn_types(self) -> None:
        """Ask the rosbridge for the types of topics that displays subscribe to."""
        while True:
            await asyncio.sleep(BEACON)
            if self._proxy.asks_types:
                try:
                    types = await self._graph.topics()
                except BridgeError:
                    types = {}
                self._proxy.typed(types, time.monotonic())
                await asyncio.sleep(TYPES)

    def _calls_of(self, user: str) -> Calls:
        if len(self._calls) > MOST_USERS and user not in self._calls:
            user = ""  # a router without users has any number of names
        if user not in self._calls:
            self._calls[user] = Calls(self.url, self._lane_type)
        return self._calls[user]

    def _call(self, call: Call) -> None:
        spawn(self._answer(call))

    async def _answer(self, call: Call) -> None:
        try:
            args: Any = bridge_proxy.args_of(call)
            check_parameters(call.service, args, self._buttons)
            calls = self._calls_of(call.client.user)
            values = await calls.call(call.service, args, call.type, 30.0)
            frame = bridge_proxy.answered(call, values)
        except (BridgeError, WireError, ValueError, TypeError) as error:
            frame = bridge_proxy.answered(call, str(error), well=False)
        finally:
            self._proxy.returned(call)
        self._reply(call.client, frame)


def _each(key: str, buttons: Sequence[Mapping[str, Any]]) -> frozenset[str]:
    return frozenset(button[key] for button in buttons if key in button)


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


def parse_beams(texts: Sequence[str]) -> dict[str, int]:
    """Return the greatest number of beams of a scan, by topic.

    Args:
        texts: The values of ``--beams``: ``/scan=180``.

    Raises:
        ConfigError: If one has another form.

    """
    beams = {}
    for text in texts:
        topic, _, number = text.partition("=")
        if not number.isdecimal() or int(number) < 1:
            raise ConfigError(
                f"beams {text!r}: expected a topic and a number, as in /scan=180"
            )
        beams[normalise_topic(topic)] = int(number)
    return beams


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
    """Run an agent until the process is requested to end.

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
