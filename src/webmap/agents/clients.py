"""The displays at an agent's rosbridge: one subscription for all of them. No I/O.

The agent subscribes once to each topic that a display shows, and sends each message
once to all displays that want it. It trusts no display: a display may read, and publish
and call only what the agent's own configuration has as a button.
"""

import logging
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import msgspec

from webmap.agents.address import Sender
from webmap.agents.data import Bye, Ping, Pong, SubscribeOp, read_op, unpack
from webmap.base.errors import WireError
from webmap.ros.names import same_type
from webmap.ros.rosbridge import ops

log = logging.getLogger("webmap.agent")

GONE = 10.0
"""Seconds without a ping after which a connection of a display has ended."""

FRESH = 2.0
"""Seconds since its newest message up to which a topic will send another one soon."""

MOST_CLIENTS = 500
"""Connections of displays at once."""

READING = frozenset(
    f"/rosapi/{name}"
    for name in (
        "action_servers",
        "get_param",
        "get_time",
        "message_details",
        "node_details",
        "nodes",
        "publishers",
        "service_request_details",
        "service_type",
        "services",
        "subscribers",
        "topic_type",
        "topics",
    )
)
"""Services that change nothing; a display may call them."""


class Wish(NamedTuple):
    """What one display wants of a topic."""

    type: str | None
    throttle: int
    queue: int
    compression: str | None


@dataclass
class AgentTopic:
    """A topic to which displays are subscribed."""

    name: str
    wishes: dict[tuple[Sender, str | None], Wish] = field(default_factory=dict)
    """By connection and the id of its subscription."""
    sent: Wish | None = None
    """The subscription at the rosbridge."""
    number: int = 0
    count: int = 0
    """Messages since the subscription."""
    newest: bytes | bytearray = b""
    """The only message since then; empty if there were several."""
    at: float = float("-inf")

    def merged(self, least_throttle: int) -> Wish:
        """Return one subscription that serves all displays."""
        wishes = list(self.wishes.values())
        compressions = [wish.compression for wish in wishes]
        compression = next(
            (kind for kind in ("cbor-raw", "cbor", "png") if kind in compressions),
            None,
        )
        return Wish(
            next((wish.type for wish in wishes if wish.type), None),
            max(min(wish.throttle for wish in wishes), least_throttle),
            max(wish.queue for wish in wishes),
            compression,
        )


class Call(NamedTuple):
    """A service that a display calls."""

    client: Sender
    id: str | None
    service: str
    type: str | None
    args: bytes


class Clients:
    """All connections of displays to the rosbridge of an agent.

    Args:
        upstream: Sends an operation to the rosbridge.
        reply: Sends a frame to one connection.
        note: Sends a note to one connection.
        call: Calls a service for a display.
        publishes: Topics that a display may publish on: those of buttons.
        calls: Services that a display may call, besides those that only read.
        throttles: The least milliseconds between two messages, by topic.

    """

    def __init__(
        self,
        *,
        upstream: Callable[[bytes], None],
        reply: Callable[[Sender, bytes], None],
        note: Callable[[Sender, Pong], None],
        call: Callable[[Call], None],
        publishes: Callable[[], Collection[str]] = tuple,
        calls: Callable[[], Collection[str]] = tuple,
        throttles: Mapping[str, int] | None = None,
    ) -> None:
        self._upstream = upstream
        self._reply = reply
        self._note = note
        self._call = call
        self._publishes = publishes
        self._calls = calls
        self._throttles = dict(throttles or {})
        self._heard: dict[Sender, float] = {}
        self._topics: dict[str, AgentTopic] = {}
        self._advertised: dict[str, set[Sender]] = {}
        self._numbers = 0
        self.session = ""
        """The identity of the connection to the rosbridge; "" without one."""
        self.trouble = "connecting"
        """Why the rosbridge is not connected."""

    @property
    def topics(self) -> list[str]:
        """The topics to which displays are subscribed."""
        return list(self._topics)

    def opened(self, session: str) -> None:
        """Note that the rosbridge is connected, and subscribe to everything again."""
        self.session, self.trouble = session, ""
        for topic in self._topics.values():
            topic.sent, topic.number = None, 0
            self._update(topic)

    def closed(self, why: str) -> None:
        """Note that the rosbridge is not connected."""
        self.session, self.trouble = "", why
        self._advertised.clear()

    def receive(self, client: Sender, piece: bytes, now: float) -> None:
        """Process data of a display.

        Raises:
            WireError: If it is not what a display may send.

        """
        received = unpack(piece)
        if isinstance(received, Bye):
            self._end(client)
            return
        if client not in self._heard and len(self._heard) >= MOST_CLIENTS:
            raise WireError(f"got more than {MOST_CLIENTS} connections of displays")
        self._heard[client] = now
        if isinstance(received, Ping):
            self._note(client, Pong(received.number, self.session, self.trouble))
        elif isinstance(received, bytes):
            self._do(client, read_op(received), received, now)

    def look(self, now: float) -> None:
        """End the connections of displays that are gone."""
        for client, at in list(self._heard.items()):
            if now - at > GONE:
                self._end(client)

    def message(self, name: str, frame: bytes | bytearray, now: float) -> bool:
        """Note a message of a topic; return whether a display wants it."""
        topic = self._topics.get(name)
        if topic is None:
            return False
        topic.count += 1
        topic.newest = frame if topic.count == 1 else b""
        topic.at = now
        return True

    def has_scans(self, name: str) -> bool:
        """Return whether displays expect laser scans on a topic."""
        topic = self._topics.get(name)
        type = topic.sent.type if topic is not None and topic.sent is not None else None
        return type is not None and same_type(type, "sensor_msgs/LaserScan")

    def _do(self, client: Sender, op: SubscribeOp, frame: bytes, now: float) -> None:
        match op.op:
            case "subscribe":
                self._subscribe(client, op, now)
            case "unsubscribe":
                self._unsubscribe(op.topic, client, op.id)
            case "call_service":
                if op.service not in READING and op.service not in self._calls():
                    self._refuse(client, op.id, f"call {op.service}")
                else:
                    args = bytes(op.args)
                    self._call(Call(client, op.id, op.service, op.type, args))
            case "advertise" | "publish" | "unadvertise":
                if op.topic not in self._publishes():
                    self._refuse(client, op.id, f"publish on {op.topic}")
                    return
                users = self._advertised.setdefault(op.topic, set())
                if op.op == "unadvertise":
                    users.discard(client)
                    if users:
                        return
                elif op.op == "advertise":
                    users.add(client)
                self._upstream(frame)
            case _:
                self._refuse(client, op.id, f"use the operation {op.op!r}")

    def _refuse(self, client: Sender, id: str | None, what: str) -> None:
        text = (
            f"the agent does not let a display {what}; only buttons of its own "
            "configuration do that"
        )
        log.warning("display %s: %s", client.display, text)
        self._reply(client, ops.status("error", text, id=id))

    def _subscribe(self, client: Sender, op: SubscribeOp, now: float) -> None:
        topic = self._topics.get(op.topic)
        if topic is None:
            topic = self._topics[op.topic] = AgentTopic(op.topic)
        queue, throttle = max(1, op.queue_length), max(1, op.throttle_rate)
        wish = Wish(op.type, throttle, queue, op.compression)
        topic.wishes[client, op.id] = wish
        served = topic.sent
        self._update(topic)
        if served is not None and served == topic.sent:
            self._catch_up(topic, client, now)

    def _catch_up(self, topic: AgentTopic, client: Sender, now: float) -> None:
        """Give a late display the message that a latched topic sent before."""
        if topic.newest:
            self._reply(client, bytes(topic.newest))
        elif topic.count > 1 and now - topic.at > FRESH:
            topic.sent = None  # a new subscription gets the message again
            self._update(topic)

    def _update(self, topic: AgentTopic) -> None:
        wish = topic.merged(self._throttles.get(topic.name, 0))
        if wish == topic.sent or not self.session:
            return
        if topic.number:
            self._upstream(ops.unsubscribe(topic.name, id=f"agent-{topic.number}"))
        self._numbers += 1
        topic.number, topic.sent = self._numbers, wish
        topic.count, topic.newest = 0, b""
        self._upstream(
            ops.subscribe(
                topic.name,
                id=f"agent-{topic.number}",
                type=wish.type,
                throttle_rate=wish.throttle,
                queue_length=wish.queue,
                compression=wish.compression,
            )
        )

    def _unsubscribe(self, name: str, client: Sender, id: str | None) -> None:
        topic = self._topics.get(name)
        if topic is None or topic.wishes.pop((client, id), None) is None:
            return
        if topic.wishes:
            self._update(topic)
            return
        del self._topics[name]
        if self.session:
            self._upstream(ops.unsubscribe(name, id=f"agent-{topic.number}"))

    def _end(self, client: Sender) -> None:
        self._heard.pop(client, None)
        for topic in list(self._topics.values()):
            for other, id in list(topic.wishes):
                if other == client:
                    self._unsubscribe(topic.name, client, id)
        for name, users in list(self._advertised.items()):
            users.discard(client)
            if not users:
                del self._advertised[name]
                if self.session:
                    self._upstream(ops.unadvertise(name))


def answered(call: Call, values: Any, *, well: bool = True) -> bytes:
    """Return the frame that answers a call of a display.

    Args:
        call: The call.
        values: The fields of the response, or why there is none.
        well: Whether the service has answered.

    """
    return ops.service_response(call.service, values, id=call.id, result=well)


def args_of(call: Call) -> object:
    """Return the arguments of a call as plain data.

    Raises:
        WireError: If they are not JSON.

    """
    try:
        return msgspec.json.decode(call.args)
    except msgspec.DecodeError as error:
        raise WireError(f"got arguments that cannot be read: {error}") from error
