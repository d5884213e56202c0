"""The display's connection to the rosbridge of an agent, over a Zenoh router."""

import asyncio
import logging
import math
import secrets
import threading
import time
from collections.abc import Callable
from typing import Any

from webmap.agents import address, data_messages
from webmap.agents.peer import Handler, Peer, peer_of
from webmap.agents.rate_limit import UserRateLimit
from webmap.base.errors import BridgeClosed, WireError
from webmap.ros.bridge import LINKS
from webmap.ros.rosbridge.link import RosbridgeLink
from webmap.ros.sockets.connection import CLOSED_HERE, BridgeConnection, Liveness

log = logging.getLogger("webmap.agent")

CHECK = 0.25
"""Seconds between two checks of the connection."""

PATIENCE = 3.0
"""Seconds for the first answer of an agent, after which the attempt has failed.

Less than a service call waits, so that it fails with the reason of the attempt.
"""

RARE = 1.0
"""Seconds between two messages of a topic from which data waits without being read."""

PIECES, BYTES = 4000, 32 << 20
"""Pieces and bytes per second, packed and unpacked, that a display takes from an
agent."""


class ThrottledTopic:
    """A topic to which a connection listens, for all its subscriptions.

    An agent sends each message once to all displays, as often as that display needs it
    that needs it most. What this one needs rarely waits packed here, the newest only.

    Args:
        take: Takes a piece of data; called in the model's thread.
        loop: The model's loop.

    """

    def __init__(
        self, take: Callable[[bytes], None], loop: asyncio.AbstractEventLoop
    ) -> None:
        self.number: int | None = None
        """The number of the listener at the peer."""
        self._take = take
        self._loop = loop
        self._throttles: dict[str | None, float] = {}
        self._waits = 0.0
        self._due = -math.inf
        self._lock = threading.Lock()
        self._newest: bytes | None = None
        self._timer: asyncio.TimerHandle | None = None

    def subscribe(self, id: str | None, throttle: int) -> None:
        """Add a subscription that needs a message each ``throttle`` milliseconds."""
        self._throttles[id] = throttle / 1000
        self._pace()

    def unsubscribe(self, id: str | None) -> bool:
        """Remove a subscription; return whether none is left."""
        self._throttles.pop(id, None)
        if self._throttles:
            self._pace()
        return not self._throttles

    def arrived(self, _key: str, piece: bytes) -> None:
        """Pass data on, or keep it until it is due; called in a thread of Zenoh."""
        if self._loop.is_closed():
            return
        if self._waits < RARE:
            self._loop.call_soon_threadsafe(self._take, piece)
            return
        with self._lock:
            is_first, self._newest = self._newest is None, piece
        if is_first:
            self._loop.call_soon_threadsafe(self._wait)

    def _wait(self) -> None:
        if self._timer is None:
            after = max(0.0, self._due - time.monotonic())
            self._timer = self._loop.call_later(after, self.release)

    def release(self) -> None:
        """Pass on what waits."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        with self._lock:
            piece, self._newest = self._newest, None
        if piece is not None:
            self._due = time.monotonic() + self._waits
            self._take(piece)

    def forget(self) -> None:
        """Drop what waits: the connection or the subscription has ended."""
        with self._lock:
            self._newest = None
        self.release()

    def _pace(self) -> None:
        before, self._waits = self._waits, min(self._throttles.values())
        if self._waits < before:
            self._due = -math.inf
            self.release()


class AgentConnection(BridgeConnection):
    """A connection to the rosbridge of an agent.

    Args:
        url: The address of the agent, ``zenoh://host:7447/name``.
        options: The other arguments of ``BridgeConnection``.

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
        self._topics: dict[str, ThrottledTopic] = {}
        self._allowance = UserRateLimit("messages", pieces=PIECES, size=BYTES)

    def _send(self, frame: bytes) -> None:
        op = data_messages.read_op(frame)
        if op.op == "subscribe":
            self._listen(op)
        elif op.op == "unsubscribe":
            topic = self._topics.get(op.topic)
            if topic is not None and topic.unsubscribe(op.id):
                self._unlisten(op.topic)
        self._put(data_messages.pack_frame(frame))

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
                if await self._connect():
                    reason = await self._keep_open()
                    self._end(reason)
                if not self._again:
                    break
                await asyncio.sleep(CHECK)
        except asyncio.CancelledError:
            if self.state == "open":
                self._end(CLOSED_HERE)
            raise
        finally:
            if self._peer is not None:
                self._put(data_messages.pack_note(data_messages.Bye()))
                if self._listening is not None:
                    self._peer.unlisten(self._listening)
            self.state = "closed"
            self._task = None

    async def _connect(self) -> bool:
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
            await asyncio.sleep(CHECK)
        return True

    async def _keep_open(self) -> str:
        """Keep the connection until it ends; return the reason."""
        session = self._session
        self.state, self._heard = "open", time.monotonic()
        self._liveness = liveness = Liveness(time.monotonic())
        self._opened()
        heard_at = self._heard
        while not liveness.is_dead(time.monotonic(), heard_at, busy=self._busy):
            if self._session != session:
                return self._why_no_bridge() or "the agent has connected again"
            if self._peer is not None and self._peer.trouble is not None:
                return self._peer.trouble  # what was sent meanwhile is lost
            if liveness.is_ping_due(time.monotonic()):
                self._pings += 1
                liveness.pinged(time.monotonic())
            if liveness.is_waiting:  # a new agent did not receive the first one
                self._ask()
            await asyncio.sleep(CHECK)
            heard_at = self._heard
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
        self._put(data_messages.pack_note(data_messages.Ping(self._pings)))

    def _put(self, piece: bytes) -> None:
        assert self._peer is not None
        self._peer.put_data(self._key_in, piece, all=True)

    def _listen(self, op: data_messages.SubscribeOp) -> None:
        if self._peer is None:
            return
        topic = self._topics.get(op.topic)
        if topic is None:
            assert self._agent is not None
            topic = self._topics[op.topic] = ThrottledTopic(self._take, self._loop)
            topic.subscribe(op.id, op.throttle_rate)
            key = address.topic_key(self._agent, op.topic)
            topic.number = self._peer.listen(key, self._admitted(topic.arrived))
        else:
            topic.subscribe(op.id, op.throttle_rate)

    def _unlisten(self, name: str) -> None:
        topic = self._topics.pop(name, None)
        if topic is None:
            return
        if topic.number is not None and self._peer is not None:
            self._peer.unlisten(topic.number)
        topic.forget()

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
            received = data_messages.unpack(piece)
        except WireError as error:
            log.warning("%s: %s", self.url, error)
            return
        self._heard = time.monotonic()
        if isinstance(received, bytes):
            if self.state == "open" and self._admits(received):
                self._deliver(received)
        elif isinstance(received, data_messages.Pong):
            self._session, self._trouble = received.session, received.trouble
            if self._liveness is not None and received.number == self._pings:
                self._liveness.ponged(self._heard)


def _not_reached(url: str, why: str) -> BridgeClosed:
    return BridgeClosed(f"cannot reach the agent at {url}: {why}", why)


class AgentLink(RosbridgeLink):
    """Topics and services of a robot's rosbridge, through its agent."""

    lane_type = AgentConnection


for scheme in address.SCHEMES:
    LINKS[scheme] = AgentLink
