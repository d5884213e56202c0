"""The display's connection to the rosbridge of an agent, over a Zenoh router."""

import asyncio
import logging
import secrets
import time
from typing import Any

from webmap.agents import address, data
from webmap.agents.allowance import Allowance
from webmap.agents.heard import Heard
from webmap.agents.peer import Handler, Peer, peer_of
from webmap.base.errors import BridgeClosed, WireError
from webmap.ros.bridge import LINKS
from webmap.ros.rosbridge.connection import CLOSED_HERE, Lane, Liveness
from webmap.ros.rosbridge.link import RosbridgeLink

log = logging.getLogger("webmap.agent")

LOOK = 0.25
"""Seconds between two looks at the connection."""

PATIENCE = 3.0
"""Seconds for the first answer of an agent, after which the attempt has failed.

Less than a service call waits, so that it fails with the reason of the attempt.
"""


PIECES, BYTES = 4000, 32 << 20
"""Pieces and bytes per second, packed and unpacked, that a display takes from an
agent."""


class AgentLane(Lane):
    """A connection to the rosbridge of an agent.

    Args:
        url: The address of the agent, ``zenoh://host:7447/name``.
        options: The other arguments of ``Lane``.

    """

    def __init__(self, url: str, **options: Any) -> None:
        super().__init__(url, **options)
        self._agent = address.agent_in(url)
        self._id = secrets.token_hex(4)
        self._peer: Peer | None = None
        self._pings = 0
        self._session = ""
        self._trouble = ""
        self._listening: int | None = None
        self._topics: dict[str, Heard] = {}
        self._allowance = Allowance("messages", pieces=PIECES, size=BYTES)

    def send(self, frame: bytes) -> None:
        """Send an operation, now.

        Raises:
            BridgeClosed: If the connection is not open.

        """
        if self.state != "open":
            raise BridgeClosed(
                f"the connection to {self.url} is not open ({self.state})"
            )
        op = data.read_op(frame)
        if op.op == "subscribe":
            self._listen(op)
        elif op.op == "unsubscribe":
            heard = self._topics.get(op.topic)
            if heard is not None and heard.unsubscribe(op.id):
                self._unlisten(op.topic)
        self._put(data.pack_frame(frame))

    async def _run(self) -> None:
        self._loop = asyncio.get_running_loop()
        reason = CLOSED_HERE
        try:
            if self._agent is None:
                self._failed(_not_reached(self.url, "the address names no agent"))
                return
            self._peer = peer = peer_of(self.url)
            user = peer.user
            self._key_in = address.data_in(
                self._agent, user.name, user.instance, self._id
            )
            out = address.data_out(self._agent, user.name, user.instance, self._id)
            self._listening = peer.listen(out, self._admitted(self._arrived))
            while True:
                self.state = "connecting"
                if await self._reached():
                    reason = await self._keep_open()
                    self._end(reason)
                if not self._again:
                    break
                await asyncio.sleep(LOOK)
        except asyncio.CancelledError:
            if self.state == "open":
                self._end(CLOSED_HERE)
            raise
        finally:
            if self._peer is not None:
                self._put(data.pack_note(data.Bye()))
                if self._listening is not None:
                    self._peer.unlisten(self._listening)
            self.state = "closed"
            self._task = None

    async def _reached(self) -> bool:
        """Ask the agent until it answers; return whether its rosbridge is there."""
        assert self._peer is not None
        self._session, self._trouble = "", ""
        deadline = time.monotonic() + PATIENCE
        while not self._session:
            if time.monotonic() > deadline or self._trouble:
                why = (
                    self._peer.trouble
                    or self._why_no_bridge()
                    or f"no answer from the agent {self._agent}"
                    + self._peer.user.may_not
                )
                self._failed(_not_reached(self.url, why))
                return False
            self._pings += 1
            self._ask()
            await asyncio.sleep(LOOK)
        return True

    async def _keep_open(self) -> str:
        """Keep the connection until it ends; return the reason."""
        session = self._session
        self.state, self._heard = "open", time.monotonic()
        self._liveness = liveness = Liveness(time.monotonic())
        self._opened()
        heard = self._heard
        while not liveness.is_dead(time.monotonic(), heard, busy=self._busy):
            if self._session != session:
                return self._why_no_bridge() or "the agent has connected again"
            if self._peer is not None and self._peer.trouble is not None:
                return self._peer.trouble  # what was sent meanwhile is lost
            if liveness.is_ping_due(time.monotonic()):
                self._pings += 1
                liveness.pinged(time.monotonic())
            if liveness.is_waiting:  # a new agent did not receive the first one
                self._ask()
            await asyncio.sleep(LOOK)
            heard = self._heard
        return f"no answer to a ping for {Liveness.LIMIT:g} s"

    def _why_no_bridge(self) -> str:
        if not self._trouble:
            return ""
        return f"the agent {self._agent} does not reach its rosbridge: {self._trouble}"

    def _end(self, reason: str) -> None:
        for topic in list(self._topics):
            self._unlisten(topic)
        self._liveness = None
        self.state = "connecting" if self._again else "closed"
        self._closed(reason)

    def _ask(self) -> None:
        self._put(data.pack_note(data.Ping(self._pings)))

    def _put(self, piece: bytes) -> None:
        assert self._peer is not None
        self._peer.put_data(self._key_in, piece, all=True)

    def _listen(self, op: data.SubscribeOp) -> None:
        if self._peer is None:
            return
        heard = self._topics.get(op.topic)
        if heard is None:
            assert self._agent is not None
            heard = self._topics[op.topic] = Heard(self._take, self._loop)
            heard.subscribe(op.id, op.throttle_rate)
            key = address.topic_key(self._agent, op.topic)
            heard.number = self._peer.listen(key, self._admitted(heard.arrived))
        else:
            heard.subscribe(op.id, op.throttle_rate)

    def _unlisten(self, topic: str) -> None:
        heard = self._topics.pop(topic, None)
        if heard is None:
            return
        if heard.number is not None and self._peer is not None:
            self._peer.unlisten(heard.number)
        heard.forget()

    def _admitted(self, fn: Handler) -> Handler:
        """Return a handler that leaves out what the agent sends too much."""

        def call(key: str, piece: bytes) -> None:
            if self._admits(piece):
                fn(key, piece)

        return call

    def _admits(self, piece: bytes) -> bool:
        now = time.monotonic()
        return self._allowance.admits(self._agent or "", len(piece), now)

    def _arrived(self, _key: str, piece: bytes) -> None:
        """Pass data to the model's thread; called in a thread of Zenoh."""
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._take, piece)

    def _take(self, piece: bytes) -> None:
        try:
            received = data.unpack(piece)
        except WireError as error:
            log.warning("%s: %s", self.url, error)
            return
        self._heard = time.monotonic()
        if isinstance(received, bytes):
            if self.state == "open" and self._admits(received):
                self._deliver(received)
        elif isinstance(received, data.Pong):
            self._session, self._trouble = received.session, received.trouble
            if self._liveness is not None and received.number == self._pings:
                self._liveness.ponged(self._heard)

    def _deliver(self, frame: bytes | bytearray) -> None:
        try:
            self._received(frame)
        except Exception:
            log.exception("%s: a frame of %d bytes was lost", self.url, len(frame))


def _not_reached(url: str, why: str) -> BridgeClosed:
    closed = BridgeClosed(f"cannot reach the agent at {url}: {why}")
    closed.why = why
    return closed


class AgentLink(RosbridgeLink):
    """Topics and services of a robot's rosbridge, through its agent."""

    lane_type = AgentLane


for scheme in address.SCHEMES:
    LINKS[scheme] = AgentLink
