"""One connection to a Foxglove server: what the server offers, and what was asked."""

import asyncio
import itertools
import logging
import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, NamedTuple, TypeVar

from webmap.base.errors import BridgeClosed, BridgeError, ProtocolError, ServiceError
from webmap.base.text import one_line
from webmap.ros.foxglove import protocol
from webmap.ros.foxglove.messages import (
    FoxgloveMessage,
    RawMessage,
    format_of_channel,
    is_readable,
)
from webmap.ros.link import report_error, report_malformed
from webmap.ros.names import normalise_topic, same_type, web_socket_url
from webmap.ros.received_message import BridgeStats, ReceivedMessage
from webmap.ros.sockets.connection import BridgeConnection
from webmap.ros.sockets.frame_reader import SHORTENED, whole_of
from webmap.ros.subscriptions import Topic

log = logging.getLogger("webmap.ros")

MOST_OFFERED = 10_000
"""Most channels, and most services, of one server; others are left out."""

MOST_STATUSES = 20
"""Most different remarks of the server that are reported for one connection."""

ERROR = 2
"""The level of a remark that is an error."""

T = TypeVar("T")


class _Subscribed(NamedTuple):
    topic: Topic
    channel: protocol.Channel
    message: Callable[[str, bytes | bytearray], ReceivedMessage]
    """Makes a message of its topic and its frame."""


class Session:
    """One connection to a Foxglove server, and what the server has offered on it.

    Args:
        url: The address, ``foxglove://host:port``.
        name: The bridge's name, as shown to people.
        stats: The counts of the bridge.
        opened: Called when the connection is open.
        informed: Called when the server has introduced itself on a connection.
        closed: Called with the reason when an open connection has ended.
        failed: Called with the error when the connection could not be opened.
        received: Called with each message of a topic.
        report: Called with each error that a person may need to know.
        carries: Returns whether messages of a type come over this connection.
        elsewhere: Called when a topic is offered whose messages come over another one.
        again: Whether to reopen the connection whenever it ends or fails.
        lane_type: The kind of its connection.

    """

    def __init__(
        self,
        url: str,
        name: str,
        stats: BridgeStats,
        *,
        opened: Callable[[], None] = lambda: None,
        informed: Callable[[], None] = lambda: None,
        closed: Callable[[str], None] = lambda _reason: None,
        failed: Callable[[BridgeClosed], None] = lambda _error: None,
        received: Callable[[Topic, ReceivedMessage], object] = lambda *_: None,
        report: Callable[[Exception], None] = lambda _error: None,
        carries: Callable[[str], bool] = lambda _type: True,
        elsewhere: Callable[[], None] = lambda: None,
        again: bool = True,
        lane_type: type[BridgeConnection] = BridgeConnection,
    ) -> None:
        self.info: protocol.ServerInfo | None = None
        self.services: dict[str, protocol.Service] = {}
        self.publishers: dict[str, list[str]] = {}
        self.subscribers: dict[str, list[str]] = {}
        self.failure: BridgeClosed | None = None
        """Why the connection is not open, after an attempt or a loss."""
        self.topics: dict[str, Topic] = {}
        """The topics to subscribe to, as soon as they are offered."""
        self.time: tuple[int, float] | None = None
        """The newest time of the server, in nanoseconds, and when it came."""
        self._name = name
        self._stats = stats
        self._on_open = opened
        self._informed = informed
        self._on_close = closed
        self._on_failure = failed
        self._on_message = received
        self._report = report
        self._carries = carries
        self._elsewhere = elsewhere
        self._changed = asyncio.Event()
        self._ids = itertools.count(1)
        self._forget()
        self.connection = lane_type(
            web_socket_url(url),
            opened=self._opened,
            received=self._received,
            closed=self._closed,
            failed=self._failed,
            again=again,
            subprotocols=protocol.SUBPROTOCOLS,
            named="Foxglove bridge",
        )

    def _forget(self) -> None:
        """Forget the server of an earlier connection."""
        self.info = None
        self.services = {}
        self.publishers, self.subscribers = {}, {}
        self.time = None
        self._channels: dict[int, protocol.Channel] = {}
        self._by_topic: dict[str, dict[int, protocol.Channel]] = {}
        self._subscribed: dict[int, _Subscribed] = {}
        """What the ids of subscriptions mean."""
        self._id_of: dict[str, int] = {}
        self._questions: dict[int | str, asyncio.Future[Any]] = {}
        """What waits for the answers to calls and questions, by their ids."""
        self._server_time = False
        self._statuses: set[str] = set()
        self._complained = False

    def send(self, frame: bytes) -> None:
        """Send a frame now; BridgeClosed if the connection is not open."""
        self.connection.send(frame)

    # What the server offers.

    def channels_of(self, topic: str) -> Iterable[protocol.Channel]:
        """Return the readable channels of a topic."""
        return self._by_topic.get(topic, {}).values()

    def offered(self) -> dict[str, str]:
        """Return the type of each readable topic."""
        return {
            topic: next(iter(channels.values())).schema_name
            for topic, channels in self._by_topic.items()
        }

    def channel_with(self, type: str) -> protocol.Channel | None:
        """Return a channel that has the schema of a type, if there is one."""
        for channel in self._channels.values():
            if channel.schema and same_type(channel.schema_name, type):
                return channel
        return None

    async def wait_for(self, look: Callable[[], T | None], patience: float) -> T | None:
        """Return what ``look`` finds in what the server offers, now or later.

        Args:
            look: Called after each change; None if the thing is not there.
            patience: Longest wait, in seconds; then the result is None.

        Raises:
            BridgeClosed: If the connection cannot be opened, or ends.

        """
        try:
            async with asyncio.timeout(patience):
                while (found := look()) is None:
                    if self.failure is not None:
                        why = self.failure.why
                        raise BridgeClosed(str(self.failure), why) from self.failure
                    await self._changed.wait()
        except TimeoutError:
            return None
        return found

    # Subscriptions.

    def subscribe(self, topic: Topic) -> None:
        """Subscribe as the listeners need it, now or when the server offers the topic.

        A call for a topic that is subscribed applies changes of its listeners.
        """
        self.topics[topic.name] = topic
        self._match([topic.name])

    def unsubscribe(self, topic: Topic) -> None:
        """End the subscription to a topic."""
        self.topics.pop(topic.name, None)
        self._match([topic.name])

    def _match(self, names: Iterable[str]) -> None:
        """Make the subscriptions to topics agree with what is wanted and offered."""
        gone: list[int] = []
        new: dict[int, int] = {}
        for name in dict.fromkeys(names):
            topic, id = self.topics.get(name), self._id_of.get(name)
            before = None if id is None else self._subscribed[id].channel
            fits = [each for each in self.channels_of(name) if _fits(topic, each)]
            channel = min(fits, key=partial(_rank, before), default=None)
            if channel is not None and not self._carries(channel.schema_name):
                self._elsewhere()
                channel = None
            if id is not None and before is not None and before != channel:
                if before.id in self._channels:  # else the server has ended it
                    gone.append(id)
                del self._subscribed[id], self._id_of[name]
                id = None
            if topic is None or channel is None:
                continue
            if id is None:
                id = self._id_of[name] = next(self._ids)
                new[id] = channel.id
            self._subscribed[id] = _subscribed(topic, channel)
        if gone:
            self._send(protocol.unsubscribe(gone))
        if new:
            self._send(protocol.subscribe(new))

    # Questions.

    async def call(
        self, service: protocol.Service, encoding: str, request: bytes
    ) -> bytes:
        """Call a service and return the bytes of its response.

        Raises:
            ServiceError: If the call fails.
            BridgeClosed: If the connection ends before the response.

        """
        id = next(self._ids)
        call = protocol.call_service(service.id, id, encoding, request)
        answer: bytes = await self._ask(id, call)
        return answer

    async def set_parameters(
        self, parameters: Iterable[protocol.Parameter]
    ) -> protocol.ParameterValues:
        """Set parameters and return their new values.

        Raises:
            BridgeClosed: If the connection ends before the answer.

        """
        id = f"webmap-{next(self._ids)}"
        answer: protocol.ParameterValues = await self._ask(
            id, protocol.set_parameters(parameters, id)
        )
        return answer

    async def _ask(self, id: int | str, question: bytes) -> Any:
        answer = self._questions[id] = asyncio.Future()
        try:
            self.send(question)
            return await answer
        finally:
            self._questions.pop(id, None)

    def _unanswered(self, id: int | str | None) -> list[asyncio.Future[Any]]:
        """Return what waits for the answer to a call or a question; of all for None."""
        found = self._questions.values() if id is None else [self._questions.get(id)]
        return [each for each in found if each is not None and not each.done()]

    @property
    def waits(self) -> bool:
        """Whether a call or a question is not answered yet."""
        return bool(self._questions)

    # The connection.

    def _send(self, frame: bytes) -> None:
        """Send a frame if connected; a new connection repeats it anyway."""
        if self.connection.state == "open":
            try:
                self.send(frame)
            except BridgeError as error:
                self._report(error)

    def _opened(self) -> None:
        self._forget()
        self.failure = None
        self._on_open()
        self._has_changed()

    def _closed(self, reason: str) -> None:
        self._end(BridgeClosed(f"{self.connection.url}: {reason}", reason))
        self._on_close(reason)

    def _failed(self, error: BridgeClosed) -> None:
        self._end(error)
        self._on_failure(error)

    def _end(self, error: BridgeClosed) -> None:
        self.failure = error
        for answer in self._unanswered(None):
            answer.set_exception(error)
        self._forget()
        self._has_changed()

    def _has_changed(self) -> None:
        """Let those who wait for something of the server look again."""
        self._changed.set()
        self._changed = asyncio.Event()

    def _received(self, frame: bytes | bytearray) -> None:
        self._stats.frames += 1
        self._stats.bytes += len(frame)
        size = len(frame)
        if frame.startswith(SHORTENED):
            try:
                size, frame = whole_of(frame)
            except ProtocolError as error:
                self._other(protocol.Malformed(str(error), size))
                return
        event = protocol.receive(frame)
        if isinstance(event, protocol.MessageData):
            self._message(event, frame, size)
        else:
            self._other(event)

    def _message(
        self, event: protocol.MessageData, frame: bytes | bytearray, size: int
    ) -> None:
        subscribed = self._subscribed.get(event.subscription_id)
        if subscribed is None:
            return  # it was on its way when the subscription ended
        if not self._server_time:
            self.time = (event.time, time.monotonic())
        message = subscribed.message(subscribed.topic.name, frame)
        message.size = size
        self._on_message(subscribed.topic, message)

    def _other(self, event: protocol.Event) -> None:
        handle = _HANDLERS.get(type(event))
        if handle is not None:
            handle(self, event)

    def _take_info(self, event: protocol.ServerInfo) -> None:
        first, self.info = self.info is None, event
        if not first:  # only its session is new
            return
        if "connectionGraph" in event.capabilities:
            self._send(protocol.subscribe_connection_graph())
        self._informed()
        self._has_changed()

    def _take_channels(self, event: protocol.Advertise) -> None:
        faults, names, left_out = list(event.faults), [], 0
        for channel in filter(is_readable, event.channels):
            names += self._remove([channel.id])  # it may have another schema now
            if len(self._channels) >= MOST_OFFERED:
                left_out += 1
                continue
            name = normalise_topic(channel.topic)
            self._channels[channel.id] = channel
            self._by_topic.setdefault(name, {})[channel.id] = channel
            names.append(name)
        if left_out:
            faults.append(
                f"{left_out} more channels than {MOST_OFFERED}, which are left out"
            )
        self._complain_about(faults, "channels")
        self._match(names)
        self._has_changed()

    def _drop_channels(self, event: protocol.Unadvertise) -> None:
        self._match(self._remove(event.channel_ids))
        self._has_changed()

    def _remove(self, ids: Iterable[int]) -> list[str]:
        """Forget channels; return their topics."""
        names = []
        for channel in filter(None, [self._channels.pop(id, None) for id in ids]):
            name = normalise_topic(channel.topic)
            names.append(name)
            del self._by_topic[name][channel.id]
            if not self._by_topic[name]:
                del self._by_topic[name]
        return names

    def _take_services(self, event: protocol.AdvertiseServices) -> None:
        faults = list(event.faults)
        room = MOST_OFFERED - len(self.services)
        if len(event.services) > room:
            faults.append(f"more than {MOST_OFFERED} services; the rest is left out")
        for service in event.services[: max(0, room)]:
            self.services[service.name] = service
        self._complain_about(faults, "services")
        self._has_changed()

    def _drop_services(self, event: protocol.UnadvertiseServices) -> None:
        gone = set(event.service_ids)
        self.services = {
            name: each for name, each in self.services.items() if each.id not in gone
        }

    def _complain_about(self, faults: list[str], things: str) -> None:
        if faults:
            text = (
                f"{self._name} offers {len(faults)} {things} that cannot be used: "
                f"{one_line(faults[-1])}"
            )
            log.warning("%s", text)
            self._report(ProtocolError(text))

    def _take_graph(self, event: protocol.ConnectionGraphUpdate) -> None:
        for published in event.published_topics:
            self.publishers[published.name] = published.publisher_ids
        for subscribed in event.subscribed_topics:
            self.subscribers[subscribed.name] = subscribed.subscriber_ids
        for name in event.removed_topics:
            self.publishers.pop(name, None)
            self.subscribers.pop(name, None)
        if max(len(self.publishers), len(self.subscribers)) > MOST_OFFERED:
            self.publishers, self.subscribers = {}, {}  # nothing is known, then
        self._has_changed()

    def _take_parameters(self, event: protocol.ParameterValues) -> None:
        for answer in self._unanswered(event.id or ""):
            answer.set_result(event)

    def _take_response(self, event: protocol.ServiceCallResponse) -> None:
        for answer in self._unanswered(event.call_id):
            answer.set_result(event.payload)

    def _take_failure(self, event: protocol.ServiceCallFailure) -> None:
        for answer in self._unanswered(event.call_id):
            answer.set_exception(ServiceError(one_line(event.message)))

    def _take_time(self, event: protocol.Time) -> None:
        self._server_time = True
        self.time = (event.time, time.monotonic())

    def _take_status(self, event: protocol.Status) -> None:
        text = one_line(event.message)
        if text in self._statuses or len(self._statuses) >= MOST_STATUSES:
            return
        self._statuses.add(text)
        if event.level >= ERROR:
            report_error(self._name, text, self._report)
        else:
            log.info("%s: the bridge reports: %s", self._name, text)

    def _count(self, _event: protocol.Unknown) -> None:
        self._stats.unknown += 1

    def _complain(self, event: protocol.Malformed) -> None:
        """Report a frame that is not Foxglove's protocol, also to one subscriber."""
        self._stats.malformed += 1
        if self._complained:
            return
        self._complained = True
        reason = one_line(event.reason)
        found = f"{event.size} bytes that are not Foxglove's protocol: {reason}"
        report_malformed(self._name, found, self.topics.values(), self._report)


def _fits(topic: Topic | None, channel: protocol.Channel) -> bool:
    if topic is None:
        return False
    stated = topic.message_type
    return stated is None or same_type(stated, channel.schema_name)


def _rank(before: protocol.Channel | None, channel: protocol.Channel) -> Any:
    """Return 0 first for a schema that can be read, then 0 for the channel before."""
    return not format_of_channel(channel).has_schema, channel != before


def _subscribed(topic: Topic, channel: protocol.Channel) -> _Subscribed:
    raw = topic.options().encoding == "raw"
    kind, format = RawMessage if raw else FoxgloveMessage, format_of_channel(channel)
    return _Subscribed(topic, channel, partial(kind, format=format))


_HANDLERS: dict[type[Any], Callable[[Session, Any], None]] = {
    protocol.ServerInfo: Session._take_info,
    protocol.Status: Session._take_status,
    protocol.Advertise: Session._take_channels,
    protocol.Unadvertise: Session._drop_channels,
    protocol.AdvertiseServices: Session._take_services,
    protocol.UnadvertiseServices: Session._drop_services,
    protocol.ParameterValues: Session._take_parameters,
    protocol.ConnectionGraphUpdate: Session._take_graph,
    protocol.ServiceCallFailure: Session._take_failure,
    protocol.ServiceCallResponse: Session._take_response,
    protocol.Time: Session._take_time,
    protocol.Unknown: Session._count,
    protocol.Malformed: Session._complain,
}
