"""How a lane speaks to a bridge of Foxglove.

A server begins a connection with ``serverInfo``, and only then is the lane up: it names
the encoding of what clients publish.

The server offers topics as channels, each with a number of this connection, at any
time; a topic is subscribed when its channel is offered. The numbers of what the gate
publishes and subscribes are its own, and are never used twice.
"""

import contextlib
import itertools
from collections.abc import Callable, Iterable, Mapping
from typing import Any, NamedTuple, Unpack

from webmap.base.errors import ProtocolError
from webmap.base.geometry import Twist
from webmap.gate.actions import SendGoal
from webmap.gate.clock import now
from webmap.gate.events import Scan
from webmap.gate.lanes import serialization
from webmap.gate.lanes.calls import Call
from webmap.gate.lanes.foxglove_calls import (
    ENCODINGS,
    ActionNumbers,
    FoxgloveCall,
    FoxgloveGoal,
    encoding_of,
)
from webmap.gate.lanes.foxglove_texts import Advertise, Service, Services, read_text
from webmap.gate.lanes.lane import Lane, LaneHandlers
from webmap.gate.lanes.navigation import GoalNews, of_message, readable
from webmap.gate.lanes.rosbridge import EVERY_GOAL, action_fields
from webmap.gate.lanes.scans import SCAN_THROTTLE, SCAN_TYPE
from webmap.gate.lanes.serialization import Encoding
from webmap.gate.lanes.sockets import MAX_FRAME
from webmap.gate.protocol import RobotSpec
from webmap.ros.foxglove import protocol
from webmap.ros.names import ros2_type, same_type, split_type

PROVING = "foxglove.sdk.v1"
"""The subprotocol of servers that answer a ping after all messages before it."""

MOST_CHANNELS = 20_000
"""The most channels of a server, and the most services of actions, that are kept."""

_ACTION = {
    "send_goal": "nav2_msgs/action/NavigateToPose_SendGoal",
    "get_result": "nav2_msgs/action/NavigateToPose_GetResult",
    "cancel_goal": "action_msgs/srv/CancelGoal",
}
"""The services of an action that goals are sent to, and their types."""

_FEEDBACK = "nav2_msgs/action/NavigateToPose_FeedbackMessage"
_SCHEMAS = {"cdr": "ros2msg", "ros1": "ros1msg"}
_ERROR = 2
"""The level of a status that is an error."""


class _Channel(NamedTuple):
    """A topic that the server offers."""

    topic: str
    type: str
    encoding: Encoding


class FoxgloveWire:
    """How a lane speaks to a bridge of Foxglove.

    Args:
        url: The address of the bridge.
        actions: Called with the actions that goals can be sent to, after each change.
        handlers: The callbacks of the lane.

    """

    def __init__(
        self,
        url: str,
        actions: Callable[[frozenset[str]], None] = lambda _: None,
        **handlers: Unpack[LaneHandlers],
    ) -> None:
        self._on_actions = actions
        self._actions: frozenset[str] = frozenset()
        """The actions that were offered last, on this or an earlier connection."""
        self._up, self._down = handlers["up"], handlers["down"]
        self._text = handlers["text"]
        self._numbers = itertools.count(1)
        self._published: dict[str, tuple[str, str]] = {}
        """What the gate publishes, by the id of the announcement: topic and type."""
        self._wanted: dict[str, tuple[str, str | None]] = {}
        """What it wants to receive, likewise; ``None`` for any type."""
        self._begin()
        ours: LaneHandlers = {
            **handlers,
            "up": self._opened,
            "down": self._lost,
            "text": self._on_frame,
        }
        self.lane = Lane(url, **ours)

    def _begin(self) -> None:
        """Forget the earlier connection."""
        self._open = False
        self._early: list[bytes] = []
        """What came together with the handshake, before the lane was open."""
        self._encoding: Encoding | None = None
        self._offered: dict[tuple[str, str], int] = {}
        """The numbers of what the gate publishes, by topic and type."""
        self._channels: dict[int, _Channel] = {}
        self._subscribed: dict[int, tuple[int, _Channel]] = {}
        """By the number of the subscription: the server's channel."""
        self._services: dict[int, tuple[str, str]] = {}
        """The services of actions, by number: the action and the part of it."""
        self._scanned_at: dict[str, float] = {}

    @property
    def only_echoes(self) -> bool:
        """Whether an answered ping does not prove that messages were handled."""
        return self.lane.subprotocol != PROVING

    def advertise(self, id: str, topic: str, type: str) -> None:
        """Announce messages to a topic, now and on each new connection."""
        if self.lane.hold(id):
            self._published[id] = (topic, type)
            self._offer()

    def subscribe(self, id: str, topic: str, type: str | None, throttle: int) -> None:
        """Receive a topic as often as the server sends it."""
        if self.lane.hold(id):
            self._wanted[id] = (topic, type)
            self._match()

    def subscribe_scans(self, id: str, topic: str) -> None:
        """Receive the scans of a topic."""
        self.subscribe(id, topic, SCAN_TYPE, SCAN_THROTTLE)

    def release(self, id: str) -> None:
        """Undo what was announced or subscribed under ``id``."""
        if self.lane.release_hold(id):
            self._published.pop(id, None)
            self._wanted.pop(id, None)
            self._offer()
            self._match()

    def velocity(self, topic: str, type: str, twist: Twist, frame: str) -> bytes | None:
        """Return the frame with a velocity; None before the server's greeting."""
        number, encoding = self._offered.get((topic, type)), self._encoding
        if number is None or encoding is None:
            return None
        payload = serialization.velocity(type, twist, frame, encoding)
        return protocol.message(number, payload)

    def message(
        self, topic: str, type: str, message: Mapping[str, Any]
    ) -> bytes | None:
        """Return the frame with a message; None before the server's greeting."""
        number, encoding = self._offered.get((topic, type)), self._encoding
        if number is None or encoding is None:
            return None
        payload = serialization.serialized(message or EVERY_GOAL, encoding)
        return protocol.message(number, payload)

    def trigger_call(self, service: str, type: str) -> Call:
        """Return the call of a service of type Trigger."""
        return FoxgloveCall(service, {}, is_trigger=True)

    def cancel_call(self, action: str) -> Call:
        """Return the call that cancels every goal of a ROS 2 action.

        The service is hidden: bridges offer it only with ``include_hidden``.
        """
        info = {"goal_id": bytes(16), "sec": 0, "nanosec": 0}
        return FoxgloveCall(f"{action}/_action/cancel_goal", info)

    def action_goal(self, spec: RobotSpec, goal: SendGoal) -> FoxgloveGoal | None:
        """Return a goal for the robot's action; None if the bridge does not offer it.

        The services are hidden, too.
        """
        action = spec.navigation.action or ""  # never empty: the rules checked it
        numbers = {part: n for n, (of, part) in self._services.items() if of == action}
        if not _ACTION.keys() <= numbers.keys():
            return None
        feedback = (
            number
            for number, (topic, type, _) in self._channels.items()
            if topic == f"{action}/_action/feedback" and same_type(type, _FEEDBACK)
        )
        found = ActionNumbers(
            numbers["send_goal"], numbers["get_result"], next(feedback, None)
        )
        fields = action_fields(spec, goal)
        return FoxgloveGoal(goal, fields, found, next(self._numbers))

    def read_news(
        self, data: bytes, spec: RobotSpec, goal: SendGoal
    ) -> GoalNews | None:
        """Return the news of a goal in a message of one of the topics of move_base."""
        channel = self._channel_of(data)
        if channel is None:
            return None
        topic, type, encoding = channel
        fields = serialization.actionlib_in(data, protocol.PAYLOAD, type, encoding)
        return of_message(topic, fields, spec, goal)

    def read_velocity(self, data: bytes) -> tuple[str, Twist | None] | None:
        """Return the topic of a received message and the velocity in it."""
        channel = self._channel_of(data)
        if channel is None:
            return None
        topic, type, encoding = channel
        at = protocol.PAYLOAD
        return topic, serialization.velocity_in(data, at, type, encoding)

    def is_scan(self, data: bytes) -> bool:
        """Return whether a frame is a message of a topic of scans."""
        channel = self._channel_of(data)
        return channel is not None and same_type(channel.type, SCAN_TYPE)

    def read_scan(self, data: bytes, at: float) -> tuple[str, Scan] | None:
        """Return the topic and the scan in a frame; most of a fast scanner are left."""
        channel, time = self._channel_of(data), now()
        if channel is None or time < self._scanned_at.get(channel.topic, 0.0):
            return None
        self._scanned_at[channel.topic] = time + SCAN_THROTTLE / 2000
        scan = serialization.scan_in(data, protocol.PAYLOAD, channel.encoding, at)
        return channel.topic, scan

    def _channel_of(self, data: bytes) -> _Channel | None:
        event = protocol.receive(data)
        if not isinstance(event, protocol.MessageData):
            return None
        found = self._subscribed.get(event.subscription_id)
        return None if found is None else found[1]

    # What the server sends.

    def _opened(self) -> None:
        self._open = True
        with contextlib.suppress(ProtocolError):
            for data in self._early:
                self._on_frame(data)

    def _on_frame(self, data: bytes) -> None:
        if not self._open:
            self._early.append(data)
            return
        if data[:1] == b"\x01":
            if len(data) > MAX_FRAME:
                raise ProtocolError(f"a message of {len(data)} bytes")
            if self._encoding is not None:
                self._text(data)
            return
        if data[:1] < b" ":  # another binary message
            return
        match read_text(data):
            case protocol.ServerInfo() as server:
                self._greeted(server)
            case Advertise(channels):
                if len(self._channels) + len(channels) > MOST_CHANNELS:
                    self.lane.cut(f"the bridge offers more than {MOST_CHANNELS} topics")
                    return
                for each in channels:
                    if each.encoding in ENCODINGS:
                        kept = each.topic, each.schema_name, each.encoding
                        self._channels[each.id] = _Channel(*kept)
                self._match()
            case protocol.Unadvertise(ids):
                for id in ids:
                    self._channels.pop(id, None)
                self._match()
            case Services(services):
                self._keep_services(services)
            case protocol.UnadvertiseServices(ids):
                for id in ids:
                    self._services.pop(id, None)
                self._report_actions()
            case protocol.Status(text, level) if level >= _ERROR:
                raise ProtocolError(f"the bridge reports an error: {readable(text)}")

    def _keep_services(self, services: Iterable[Service]) -> None:
        for each in services:
            action, _, part = each.name.partition("/_action/")
            if part in _ACTION and same_type(each.type, _ACTION[part]):
                self._services[each.id] = (action, part)
        if len(self._services) > MOST_CHANNELS:
            self.lane.cut(
                f"the bridge offers more than {MOST_CHANNELS} services of actions"
            )
            return
        self._report_actions()

    def _report_actions(self) -> None:
        parts: dict[str, set[str]] = {}
        for action, part in self._services.values():
            parts.setdefault(action, set()).add(part)
        found = frozenset(
            name for name, has in parts.items() if len(has) == len(_ACTION)
        )
        if found != self._actions:
            self._actions = found
            self._on_actions(found)

    def _greeted(self, server: protocol.ServerInfo) -> None:
        encoding = encoding_of(server)
        if self._encoding is not None:  # the server asks to forget everything
            self.lane.cut("the bridge has begun a new session")
        elif "clientPublish" not in server.capabilities or encoding is None:
            self.lane.cut(
                "the bridge takes no messages of clients in CDR or in the form of "
                "ROS 1: it needs the capability clientPublish"
            )
        else:
            self._encoding = encoding
            self._offer()
            self._match()
            self._up()

    def _lost(self) -> None:
        self._begin()
        self._down()

    # Both are done again at each change.

    def _offer(self) -> None:
        """Make what the server knows of the gate's topics agree with what it needs."""
        if self._encoding is None:
            return
        needed = dict.fromkeys(self._published.values())
        gone = [key for key in self._offered if key not in needed]
        if gone:
            self._write(protocol.unadvertise(self._offered.pop(key) for key in gone))
        new = [key for key in needed if key not in self._offered]
        for key in new:
            self._offered[key] = next(self._numbers)
        if new:
            channels = (self._client_channel(*key) for key in new)
            self._write(protocol.advertise(channels))

    def _client_channel(self, topic: str, type: str) -> protocol.Channel:
        assert self._encoding is not None
        name = ros2_type(type) if self._encoding == "cdr" else str(split_type(type))
        number, schema = self._offered[topic, type], _SCHEMAS[self._encoding]
        return protocol.Channel(
            number, topic, self._encoding, name, schema_encoding=schema
        )

    def _match(self) -> None:
        """Subscribe to the channels of wanted topics, and to no others."""
        if self._encoding is None:
            return
        wanted: dict[str, list[str | None]] = {}
        for topic, type in self._wanted.values():
            wanted.setdefault(topic, []).append(type)
        fits = {
            id: channel
            for id, channel in self._channels.items()
            if any(
                type is None or same_type(type, channel.type)
                for type in wanted.get(channel.topic, ())
            )
        }
        gone = [n for n, (id, one) in self._subscribed.items() if fits.get(id) != one]
        for number in gone:
            del self._subscribed[number]
        if gone:
            self._write(protocol.unsubscribe(gone))
        have = {id for id, _ in self._subscribed.values()}
        new = {next(self._numbers): id for id in fits if id not in have}
        self._subscribed.update({n: (id, fits[id]) for n, id in new.items()})
        if new:
            self._write(protocol.subscribe(new))

    def _write(self, text: bytes) -> None:
        self.lane.write(text, only_if_clear=False)
