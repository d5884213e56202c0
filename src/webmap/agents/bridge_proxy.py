"""The displays at an agent's rosbridge: one subscription for all of them. No I/O.

The agent subscribes once to each topic that a display shows, and sends each message
once to all displays that want it. It trusts no display: a display may read, and publish
and call only what the agent's own configuration has as a button. What a display wants
does not change what another one gets: the type and the encoding of a topic are chosen
here, and limits count for each user of the router.
"""

import logging
from collections import Counter
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import msgspec

from webmap.agents.address import Sender
from webmap.agents.data_messages import (
    MOST_OF_DISPLAY,
    Bye,
    Ping,
    Pong,
    SubscribeOp,
    read_json,
    read_op,
    unpack,
)
from webmap.agents.rate_limit import UserRateLimit
from webmap.base.errors import WireError
from webmap.ros.names import is_type, same_type, split_type
from webmap.ros.rosbridge import ops
from webmap.ros.rosbridge.checks import PARAMETER
from webmap.ros.rosbridge.graph import QUESTIONS
from webmap.ros.rosbridge.wire_subscription import BULK, REPLACED, THROTTLE
from webmap.ros.subscriptions import each_counts

log = logging.getLogger("webmap.agent")

GONE = 10.0
"""Seconds without a ping after which a connection of a display has ended."""

FRESH = 2.0
"""Seconds since its newest message up to which a topic will send another one soon."""

CHANGE = 1.0
"""The least seconds between two changes of the subscription to a topic."""

LEAST_THROTTLE = 50
"""The least milliseconds between two messages of types that replace each other."""

MOST_CLIENTS, MOST_SUBSCRIPTIONS, MOST_CALLS = 100, 2000, 32
"""Connections, subscriptions and unanswered calls of one user of the router at once;
of the calls, one display has half at most."""

READING = frozenset(
    f"/rosapi/{name}"
    for name in (
        "action_servers",
        "get_time",
        "publishers",
        "service_type",
        "subscribers",
        "topic_type",
        "topics",
    )
)
"""Services that change nothing and end quickly; a display may call them."""


class TopicOptions(NamedTuple):
    """What one display wants of a topic, or what the agent wants for all of them."""

    type: str | None
    throttle_rate: int
    queue_length: int
    compression: str | None


@dataclass
class SharedTopic:
    """A topic to which displays are subscribed."""

    name: str
    options: dict[tuple[Sender, str | None], TopicOptions] = field(default_factory=dict)
    """By connection and the id of its subscription."""
    sent: TopicOptions | None = None
    """The subscription at the rosbridge."""
    number: int = 0
    changed_at: float = 0.0
    count: int = 0
    """Messages since the subscription."""
    newest: bytes | bytearray = b""
    """The only message since then; empty if there were several."""
    at: float = float("-inf")
    json: bool | None = False
    """Whether it is requested in JSON, as no CBOR came; None if it is not too large."""

    def merged(self, known: str | None, least_throttle: int) -> TopicOptions:
        """Return one subscription that serves all displays.

        Args:
            known: The type of the topic, as the rosbridge reports it. Until then the
                type is the one that all displays expect, if they agree.
            least_throttle: The least milliseconds between two messages.

        """
        options = list(self.options.values())
        types = {each.type for each in options if each.type}
        type = known or (types.pop() if len(types) == 1 else None)
        least, compression = least_throttle, "none"
        if each_counts(self.name, type):
            least = 0
        queue = min(max(each.queue_length for each in options), ops.BURST)
        if type and is_type(type, *REPLACED, "sensor_msgs/LaserScan"):
            least, queue = max(least, LEAST_THROTTLE), 1
        in_text = any(each.compression == "none" for each in options)
        if self.json is False and in_text and not self.count:
            self.json = type is not None and is_type(type, *REPLACED)
        if self.json:
            least = max(least, THROTTLE)
        elif type and is_type(type, *BULK):
            compression = "cbor"
        throttle = max(min(each.throttle_rate for each in options), least)
        return TopicOptions(type, throttle, queue, compression)


class Call(NamedTuple):
    """A service call of a display, until the rosbridge answers it."""

    client: Sender
    id: str | None
    service: str
    type: str | None
    args: bytes


class BridgeProxy:
    """All connections of displays to the rosbridge of an agent.

    Args:
        upstream: Sends an operation to the rosbridge.
        reply: Sends a frame to one connection.
        note: Sends a note to one connection.
        call: Calls a service for a display.
        publishes: Topics that a display may publish on: those of buttons, with their
            types; "" for an unknown type.
        calls: Services that a display may call, besides those that only read.
        details: Types whose definitions a display may ask for: those of buttons.
        throttles: The least milliseconds between two messages, by topic.

    """

    def __init__(
        self,
        *,
        upstream: Callable[[bytes], None],
        reply: Callable[[Sender, bytes], None],
        note: Callable[[Sender, Pong], None],
        call: Callable[[Call], None],
        publishes: Callable[[], Mapping[str, str]] = dict,
        calls: Callable[[], Collection[str]] = tuple,
        details: Callable[[], Collection[str]] = tuple,
        throttles: Mapping[str, int] | None = None,
    ) -> None:
        self._upstream = upstream
        self._reply = reply
        self._note = note
        self._call = call
        self._publishes = publishes
        self._calls = calls
        self._details = details
        self._throttles = dict(throttles or {})
        self._pinged_at: dict[Sender, float] = {}
        self._topics: dict[str, SharedTopic] = {}
        self._types: dict[str, str] = {}
        """The types of topics, as the rosbridge reports them."""
        self._subscriptions: Counter[str] = Counter()
        """The subscriptions of each user."""
        self._calling: Counter[str] = Counter()
        """The calls that are not answered, of each user and of each display."""
        self._catching_up = UserRateLimit("subscriptions", size=4 << 20)
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

    @property
    def asks_types(self) -> bool:
        """Whether a display needs a topic whose type is not known yet."""
        return bool(self.session and self._topics.keys() - self._types.keys())

    def typed(self, types: Mapping[str, str], now: float) -> None:
        """Note the types of topics that the rosbridge reports."""
        self._types = {
            name: type for name, type in types.items() if same_type(type, type)
        }
        for topic in list(self._topics.values()):
            self._update(topic, now)

    def opened(self, session: str, now: float) -> None:
        """Note that the rosbridge is connected, and subscribe to everything again."""
        self.session, self.trouble = session, ""
        self._types.clear()
        for topic in list(self._topics.values()):
            topic.sent, topic.number, topic.json = None, 0, False
            self._update(topic, now)

    def closed(self, why: str) -> None:
        """Note that the rosbridge is not connected."""
        self.session, self.trouble = "", why
        self._advertised.clear()

    def receive(self, client: Sender, piece: bytes, now: float) -> None:
        """Process data of a display.

        Raises:
            WireError: If it is not what a display may send.

        """
        received = unpack(piece, MOST_OF_DISPLAY)
        if isinstance(received, Bye):
            self._end(client, now)
            return
        if client not in self._pinged_at:
            mine = [each for each in self._pinged_at if each.user == client.user]
            if len(mine) >= MOST_CLIENTS:
                raise WireError(
                    f"got more than {MOST_CLIENTS} connections of the user "
                    f"{client.user}"
                )
        self._pinged_at[client] = now
        if isinstance(received, Ping):
            self._note(client, Pong(received.number, self.session, self.trouble))
        elif isinstance(received, bytes):
            self._do(client, read_op(received), received, now)

    def check(self, now: float) -> None:
        """End the connections of displays that are gone; change what has to change."""
        for client, at in list(self._pinged_at.items()):
            if now - at > GONE:
                self._end(client, now)
        for topic in list(self._topics.values()):
            self._update(topic, now)

    def message(
        self,
        name: str,
        frame: bytes | bytearray,
        now: float,
        *,
        in_parts: bool = False,
    ) -> bool:
        """Note a message of a topic; return whether a display wants it.

        Args:
            name: The topic.
            frame: The whole operation.
            now: The time.
            in_parts: Whether the rosbridge sent it in fragments.

        """
        topic = self._topics.get(name)
        if topic is None or not topic.options:
            return False
        if topic.json and not in_parts:  # it was published late, and is not too large
            topic.json = None
        topic.count += 1
        topic.newest = frame if topic.count == 1 else b""
        topic.at = now
        return True

    def type_of(self, name: str) -> str | None:
        """Return the type of a topic as it is subscribed; None if unknown."""
        topic = self._topics.get(name)
        return topic.sent.type if topic is not None and topic.sent is not None else None

    def _do(self, client: Sender, op: SubscribeOp, frame: bytes, now: float) -> None:
        match op.op:
            case "subscribe":
                self._subscribe(client, op, now)
            case "unsubscribe":
                self._unsubscribe(op.topic, client, op.id, now)
            case "call_service":
                call = Call(client, op.id, op.service, op.type, bytes(op.args))
                if not self._may_call(call):
                    self._refuse(client, op.id, f"call {op.service}")
                elif (
                    self._calling[client.user] < MOST_CALLS
                    and self._calling[client.display] < MOST_CALLS // 2
                ):
                    self._calling.update((client.user, client.display))
                    self._call(call)
                else:
                    text = "too many calls of this display or user are not answered yet"
                    self._reply(client, answered(call, text, well=False))
            case "advertise" | "publish" | "unadvertise":
                type = self._publishes().get(op.topic)
                if type is None or (op.type and type and not same_type(op.type, type)):
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

    def returned(self, call: Call) -> None:
        """Note that a call of a display has ended."""
        self._calling -= Counter((call.client.user, call.client.display))

    def _may_call(self, call: Call) -> bool:
        if call.service in READING or call.service in self._calls():
            return True
        if call.service == "/rosapi/get_param":
            return _asks_for(call, "name", [PARAMETER])
        # A rosapi of ROS 2 may end for ever after a question for definitions.
        slashes = {type.count("/") for type in self._types.values()}
        is_question = call.service in QUESTIONS.values() and slashes == {1}
        return is_question and _asks_for(call, "type", self._details())

    def _refuse(self, client: Sender, id: str | None, what: str) -> None:
        text = (
            f"the agent does not let a display {what}; only buttons of its own "
            "configuration do that"
        )
        log.warning("display %s: %s", client.display, text)
        self._reply(client, ops.status("error", text, id=id))

    def _subscribe(self, client: Sender, op: SubscribeOp, now: float) -> None:
        topic = self._topics.get(op.topic) or SharedTopic(op.topic)
        if (client, op.id) not in topic.options:
            if self._subscriptions[client.user] >= MOST_SUBSCRIPTIONS:
                raise WireError(
                    f"got more than {MOST_SUBSCRIPTIONS} subscriptions of the user "
                    f"{client.user}"
                )
            self._subscriptions[client.user] += 1
        self._topics[op.topic] = topic
        queue, throttle = max(1, op.queue_length), max(1, op.throttle_rate)
        options = TopicOptions(op.type, throttle, queue, op.compression)
        topic.options[client, op.id] = options
        served = topic.sent
        self._update(topic, now)
        if served is not None and served == topic.sent:
            self._catch_up(topic, client, now)

    def _catch_up(self, topic: SharedTopic, client: Sender, now: float) -> None:
        """Give a late display the message that a latched topic sent before."""
        if topic.newest:
            if self._catching_up.admits(client.user, len(topic.newest), now):
                self._reply(client, bytes(topic.newest))
        elif topic.count > 1 and now - topic.at > FRESH:
            topic.sent = None  # a new subscription gets the message again
            self._update(topic, now)

    def _update(self, topic: SharedTopic, now: float) -> None:
        """Subscribe as all displays need it, but change that once a second at most."""
        if topic.number and now - topic.changed_at < CHANGE and self.session:
            return
        if not topic.options:
            del self._topics[topic.name]
            if topic.number and self.session:
                self._upstream(ops.unsubscribe(topic.name, id=f"agent-{topic.number}"))
            return
        known = self._types.get(topic.name)
        options = topic.merged(
            str(split_type(known)) if known else None,
            self._throttles.get(topic.name, 0),
        )
        if options == topic.sent or not self.session:
            return
        if topic.number:
            self._upstream(ops.unsubscribe(topic.name, id=f"agent-{topic.number}"))
        self._numbers += 1
        topic.number, topic.sent, topic.changed_at = self._numbers, options, now
        topic.count, topic.newest = 0, b""
        id = f"agent-{topic.number}"
        self._upstream(ops.subscribe(topic.name, id=id, **options._asdict()))

    def _unsubscribe(
        self, name: str, client: Sender, id: str | None, now: float
    ) -> None:
        topic = self._topics.get(name)
        if topic is None or topic.options.pop((client, id), None) is None:
            return
        self._subscriptions -= Counter((client.user,))
        self._update(topic, now)

    def _end(self, client: Sender, now: float) -> None:
        self._pinged_at.pop(client, None)
        for topic in list(self._topics.values()):
            for other, id in list(topic.options):
                if other == client:
                    self._unsubscribe(topic.name, client, id, now)
        for name, users in list(self._advertised.items()):
            users.discard(client)
            if not users:
                del self._advertised[name]
                if self.session:
                    self._upstream(ops.unadvertise(name))


def _asks_for(call: Call, name: str, allowed: Collection[str]) -> bool:
    args = args_of(call)
    return isinstance(args, dict) and str(args.get(name)) in allowed


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
    arguments: object = read_json(msgspec.json.decode, call.args, "arguments")
    return arguments
