"""The gates of this process: all that a display reaches, or the one of an agent.

Each robot belongs to one gate. A page of a display is connected to all gates over one
socket. The displays of an agent use its gate as pages of its own would.
"""

import logging
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import Future
from functools import partial
from typing import Any

from webmap.agents import address
from webmap.agents.displays import MOST_USERS, Displays, Effect, user_of
from webmap.agents.gate_messages import AllReports, StopAck, ToDisplays
from webmap.agents.peer import peer_of
from webmap.agents.remote_gate import RemoteGate
from webmap.base.errors import ConfigError, WireError
from webmap.base.geometry import Twist
from webmap.base.roles import Role
from webmap.base.scope import Removal
from webmap.gate import protocol
from webmap.gate.commands import Stop, robot_in, stop_in
from webmap.gate.display.client import DriveConnection, GateClient, TickTimes
from webmap.gate.protocol import FromGate, FromPage, FromProgram, Report, RobotSpec
from webmap.ros.names import is_agent_url

log = logging.getLogger("webmap.agent")

QUIET = 10.0
"""Seconds for which no other mistake of the same user of an agent is logged."""

BEAT = 0.05
"""Seconds between two signs of life for the agents."""


class PageConnection:
    """One page's socket at all gates."""

    def __init__(
        self,
        gates: "Gates",
        name: str,
        role: Role,
        send: Callable[[str], None],
        close: Callable[[str], None],
        identity: protocol.Identity | None = None,
        may_drive: Callable[[str], bool] | None = None,
    ) -> None:
        self._gates = gates
        self._name = name
        self._send = send
        self._who: dict[str, Any] = {"role": role, "close": close}
        self._who |= {"identity": identity, "may_drive": may_drive}
        self._speeds: tuple[float, float] | None = None
        self._remote: dict[str, DriveConnection] = {}
        self._greeted = False
        self._own = gates.own.connect(name, send=self._from_own, **self._who)

    def receive(self, text: str | bytes) -> None:
        """Pass a frame of the page to the gate of its robot, a STOP for all to all."""
        data = text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text
        client = self._gates.client_of(robot_in(data))
        if client is None and stop_in(data) is not None:
            for remote in list(self._remote.values()):
                remote.receive(text)
        for url, remote in list(self._remote.items()):
            if self._gates.remote.get(url) is client:
                remote.receive(text)
                return
        self._own.receive(text)

    def move(self, robot: str, x: float, y: float, yaw: float) -> None:
        """Send a goal in the name of the page; see :meth:`DriveConnection.move`."""
        client = self._gates.client_of(robot)
        urls = [url for url in self._remote if self._gates.remote.get(url) is client]
        connection = self._remote[urls[0]] if urls else self._own
        connection.move(robot, x, y, yaw)

    def set_speeds(self, v: float, w: float) -> None:
        """Set the page's own speed limits, in m/s and rad/s."""
        self._speeds = (v, w)
        for connection in (self._own, *self._remote.values()):
            connection.set_speeds(v, w)

    def rename(self, name: str) -> None:
        """Show the person at the page under another name; see ``DriveConnection``."""
        self._name = name
        for connection in (self._own, *list(self._remote.values())):
            connection.rename(name)

    def close(self) -> None:
        """Remove the page, which has closed; the robots that it drove stop."""
        self._gates.drop(self)
        for connection in (self._own, *self._remote.values()):
            connection.close()

    def join(self, url: str, client: GateClient) -> None:
        """Connect the page to one more gate."""
        connection = client.connect(
            self._name, send=self._from_remote, id=self._own.id, **self._who
        )
        self._remote[url] = connection
        if self._speeds is not None:
            connection.set_speeds(*self._speeds)

    def _from_own(self, text: str) -> None:
        self._send(text)
        if not text.startswith('{"op":"hello"'):
            return
        # The page has forgotten all robots and leases, and numbers its commands anew.
        again, self._greeted = self._greeted, True
        for url, connection in list(self._remote.items()):
            client = self._gates.remote[url]
            if again:
                connection.close()
                self.join(url, client)
            else:
                client.show_again(connection)

    def _from_remote(self, text: str) -> None:
        if self._own.greeted:  # its first message is that of the display's own gate
            self._send(text)


class Gates:
    """The gates of one display, with the methods of one :class:`GateClient`."""

    def __init__(self) -> None:
        self.own = GateClient()
        """The gate of this computer."""
        self.remote: dict[str, GateClient] = {}
        """The gates of agents, by the address of the agent."""
        self._links: dict[str, RemoteGate] = {}
        self._homes: dict[str, GateClient] = {}
        self._pages: list[PageConnection] = []
        self._listeners: list[Callable[[Report], None]] = []
        self._lock = threading.RLock()
        self._ended = threading.Event()
        self._heartbeat: threading.Thread | None = None

    def start(self) -> None:
        """Start the gate of this computer; a second call does nothing."""
        self.own.start()

    def stop(self) -> None:
        """Stop every driven robot and end the gate of this computer."""
        self._ended.set()
        if self._heartbeat is not None:
            self._heartbeat.join()
        for client in self.remote.values():
            client.stop()
        self.own.stop()

    @property
    def pid(self) -> int | None:
        """The process id of the gate of this computer, if it runs."""
        return self.own.pid

    @property
    def ticks(self) -> TickTimes:
        """When the ticks of the gate of this computer came."""
        return self.own.ticks

    @property
    def ready(self) -> bool:
        """Whether the gate of this computer runs and receives messages."""
        return self.own.ready

    def client_of(self, robot: str | None) -> GateClient | None:
        """Return the client of the gate of a robot; None if no gate has the robot."""
        return None if robot is None else self._homes.get(robot)

    def connect(
        self,
        name: str,
        role: Role,
        send: Callable[[str], None],
        close: Callable[[str], None],
        identity: protocol.Identity | None = None,
        may_drive: Callable[[str], bool] | None = None,
    ) -> PageConnection:
        """Register a page's socket; see :meth:`GateClient.connect`."""
        page = PageConnection(self, name, role, send, close, identity, may_drive)
        with self._lock:
            self._pages.append(page)
            for url, client in self.remote.items():
                page.join(url, client)
        return page

    def drop(self, page: PageConnection) -> None:
        """Forget a page; a second call does nothing."""
        with self._lock:
            if page in self._pages:
                self._pages.remove(page)

    def on_report(self, fn: Callable[[Report], None]) -> Removal:
        """Call ``fn`` with every report, in a thread of a client."""
        with self._lock:
            self._listeners.append(fn)
        return self.own.on_report(fn)

    # Robots.

    def declare(self, spec: RobotSpec) -> None:
        """Declare a robot to its gate; see :meth:`GateClient.declare`.

        An agent declares its robots itself: here its gate only learns their names.

        Raises:
            ConfigError: If ``spec`` has an invalid value, or the identifier of a robot
                of another gate.

        """
        if spec.id.rpartition("/")[0] != _agent_at(spec.bridge_url):
            raise ConfigError(
                f"robot {spec.name!r} has the identifier of a robot of another gate"
            )
        client = self._client(spec.bridge_url)
        with self._lock:
            self._homes[spec.id] = client
        client.declare(spec)

    def forget(self, robot_id: str) -> None:
        """Remove a robot; it is stopped if it is driven by this display."""
        with self._lock:
            client = self._homes.pop(robot_id, None)
        if client is not None:
            client.forget(robot_id)

    def take(self, robot_id: str) -> "Future[int]":
        """Take the lease of a robot for this program; see :meth:`GateClient.take`."""
        return self._home(robot_id).take(robot_id)

    def release(self, robot_id: str) -> None:
        """Release the program's lease; the robot is stopped if it is driven."""
        self._home(robot_id).release(robot_id)

    def twist(self, robot_id: str, twist: Twist) -> None:
        """Send one velocity; see :meth:`GateClient.twist`."""
        self._home(robot_id).twist(robot_id, twist)

    def move(self, robot_id: str, x: float, y: float, yaw: float) -> None:
        """Send a goal; see :meth:`GateClient.move`."""
        self._home(robot_id).move(robot_id, x, y, yaw)

    def locate(self, robot_id: str, x: float, y: float, yaw: float) -> None:
        """State where a robot is; see :meth:`GateClient.locate`."""
        self._home(robot_id).locate(robot_id, x, y, yaw)

    def cancel(self, robot_id: str) -> None:
        """Cancel the robot's goals; needs no lease."""
        self._home(robot_id).cancel(robot_id)

    def stop_robot(self, robot_id: str | None) -> None:
        """Send STOP to a robot or, with ``None``, to all robots of all gates."""
        client = self.client_of(robot_id)
        clients = [client] if client is not None else [self.own, *self.remote.values()]
        for each in clients:
            each.stop_robot(robot_id)

    def reset(self, robot_id: str, stop: str) -> None:
        """End the STOP with this identity; see :meth:`GateClient.reset`."""
        self._home(robot_id).reset(robot_id, stop)

    def name_writers(self, robot_id: str, nodes: tuple[str, ...]) -> None:
        """Name the other nodes that publish a robot's velocity."""
        self._home(robot_id).name_writers(robot_id, nodes)

    # Agents.

    def _home(self, robot_id: str) -> GateClient:
        return self._homes.get(robot_id, self.own)

    def _client(self, url: str) -> GateClient:
        if not is_agent_url(url):
            return self.own
        with self._lock:
            if url not in self.remote:
                self._add(url)
            return self.remote[url]

    def _add(self, url: str) -> None:
        agent = _agent_at(url)
        for other in self.remote:
            if address.agent_in(other) == agent:
                raise ConfigError(f"{other} has an agent {agent} already")
        peer = peer_of(url)
        user = peer.user
        display = address.Sender(user.name, user.instance).display
        key = address.gate_in(agent, user.name, user.instance)
        put = partial(peer.put_gate, key)

        def link(owner: object, lock: "threading.RLock") -> RemoteGate:
            assert isinstance(owner, GateClient)
            made = RemoteGate(agent, display, owner, lock, put, lambda: peer.trouble)
            self._links[url] = made
            return made

        client = self.remote[url] = GateClient(link, agent, f"{display}/")
        client.on_report(self._pass_on)
        remote = self._links[url]
        peer.listen(
            address.gate_out(agent),
            lambda key, sample: remote.take(sample, time.monotonic()),
            gate=True,
        )
        for page in self._pages:
            page.join(url, client)
        if self._heartbeat is None:
            self._heartbeat = threading.Thread(
                target=self._beat, name="webmap-agents-heartbeat", daemon=True
            )
            self._heartbeat.start()

    def _pass_on(self, report: Report) -> None:
        # The loss of one agent does not concern the robots of the others: their
        # own reports have their states.
        if not isinstance(report, protocol.GateUp | protocol.GateDown):
            for fn in list(self._listeners):
                try:
                    fn(report)
                except Exception:
                    log.exception("a listener to an agent's gate failed")

    def _beat(self) -> None:
        while not self._ended.wait(BEAT):
            for link in list(self._links.values()):
                try:
                    link.beat(time.monotonic())
                except Exception:
                    log.exception("the agent %s got no sign of life", link.agent)


class AgentGate(GateClient):
    """The gate of an agent: its own client, and the displays.

    Args:
        publish: Sends a sample to all displays, without waiting.
        roles: What the pages of each user may do at most; see :class:`Displays`.

    """

    def __init__(
        self,
        publish: Callable[[bytes], None],
        roles: Mapping[str, Role] | None = None,
    ) -> None:
        super().__init__()
        self.displays = Displays(roles)
        self._publish = publish
        self._complained_at: dict[str, float] = {}
        """When a mistake of each user was logged."""

    def introduction(self) -> list[protocol.ToGate]:
        """Return the first messages for a new gate."""
        return [*super().introduction(), *self.displays.introduction()]

    def take_sample(self, display: str, sample: bytes) -> None:
        """Process a sample of a display, in any thread."""
        now = time.monotonic()
        with self._lock:
            try:
                messages = self.displays.receive(display, sample, now)
            except WireError as error:
                user = user_of(display)
                if now - self._complained_at.get(user, float("-inf")) > QUIET:
                    if len(self._complained_at) > MOST_USERS:
                        self._complained_at.clear()
                    self._complained_at[user] = now
                    log.warning("%s", error)
                return
            self._pass_on(messages)
            if self.displays.wants_reports(now):
                reports, robots = tuple(self._pages.latest), tuple(self._specs)
                self._send_out(AllReports(reports, robots))

    def _pass_on(self, messages: Iterable[Effect]) -> None:
        for message in messages:
            match message:
                case StopAck() | protocol.Hello():
                    self._send_out(message)
                    continue
                case FromPage():
                    self._keep_stop_of_page(message)
                case FromProgram(command=Stop(robot)):
                    self._keep_stop(None, robot)
            self.send(message)

    def hear(self, message: FromGate) -> None:
        """Process a message from the gate, and pass it on to the displays."""
        super().hear(message)
        with self._lock:
            if isinstance(message, protocol.Tick):
                self._pass_on(self.displays.waiting_stops())
                self._pass_on(self.displays.check(time.monotonic()))
            self._send_out(message)

    def _send_out(self, message: ToDisplays) -> None:
        self._publish(self.displays.send(message, time.monotonic()))


def _agent_at(url: str) -> str:
    """Return the agent of a bridge; "" for a bridge of the gate of this computer."""
    return (address.agent_in(url) or "") if is_agent_url(url) else ""
