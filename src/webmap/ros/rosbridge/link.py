"""The connections of a bridge to a rosbridge v2 server.

This module keeps the sockets and their subscriptions; :class:`webmap.Bridge` keeps the
listeners and decides what may be published.
"""

import logging
import time
from collections.abc import Mapping
from typing import Any, NamedTuple, Unpack

from webmap.base.errors import BridgeError
from webmap.base.identifiers import generate_id
from webmap.ros.link import (
    LinkCallbacks,
    ReconnectingLink,
    report_error,
    report_malformed,
)
from webmap.ros.names import split_type
from webmap.ros.rosbridge import ops
from webmap.ros.rosbridge.calls import Calls
from webmap.ros.rosbridge.events import (
    CallService,
    Event,
    Malformed,
    Publish,
    Status,
    Unknown,
)
from webmap.ros.rosbridge.graph import BridgeGraph
from webmap.ros.rosbridge.protocol import Protocol
from webmap.ros.rosbridge.wire_subscription import (
    IN_CBOR,
    THROTTLE,
    Renewals,
    WireSubscription,
)
from webmap.ros.sockets.connection import BridgeConnection
from webmap.ros.subscriptions import Topic

log = logging.getLogger("webmap.ros")


class _Advertised(NamedTuple):
    id: str
    type: str


class RosbridgeLink(ReconnectingLink):
    """Topics and services over a rosbridge; reconnects after each loss.

    Args:
        url: The bridge's address.
        name: The bridge's name, as shown to people.
        callbacks: Those of the bridge.

    """

    lane_type: type[BridgeConnection] = BridgeConnection
    """The kind of its connections."""

    def __init__(self, url: str, name: str, **callbacks: Unpack[LinkCallbacks]) -> None:
        super().__init__(name, **callbacks)
        self.graph = BridgeGraph(self.call_service)
        self._url = url
        self._protocol = Protocol()
        self._calls = Calls(url, self.lane_type)
        self._subscriptions: dict[str, WireSubscription] = {}
        self._advertised: dict[str, _Advertised] = {}
        self._renewals = Renewals(self.graph.published, self._subscriptions.values)
        self.lane = self.lane_type(  # the socket for everything but calls
            url,
            opened=self._opened,
            received=self._received,
            closed=self._lost,
            failed=self._not_opened,
            busy=lambda: any(s.awaits_large for s in self._subscriptions.values()),
        )

    async def stop(self) -> None:
        """Close every socket; keep the subscriptions for another start."""
        await self.lane.stop()
        await self._calls.stop()
        await self._renewals.stop()

    def subscribe(self, topic: Topic) -> None:
        """Subscribe to a topic as its listeners need it now, if not already done."""
        subscription = self._subscriptions.get(topic.name)
        if subscription is None:
            subscription = WireSubscription(
                topic, send=self._send, too_large=self._too_large
            )
            self._subscriptions[topic.name] = subscription
        subscription.update()

    def unsubscribe(self, topic: Topic) -> None:
        """End the subscription to a topic."""
        subscription = self._subscriptions.pop(topic.name, None)
        if subscription is not None:
            subscription.end()

    def published_type(self, topic: str) -> str | None:
        """Return the type with which ``topic`` is published here, None if it is not."""
        advertised = self._advertised.get(topic)
        return None if advertised is None else advertised.type

    def publish(self, topic: str, type: str, message: Mapping[str, Any]) -> None:
        """Publish a message now, or raise an error; the topic is advertised first.

        Raises:
            BridgeClosed: If the connection is not open.
            ValueError: If a number in the message is NaN or infinite.
            TypeError: If a value in the message has no form in JSON.

        """
        text = ops.publish(topic, message)
        self.refuse_if_over()
        if topic not in self._advertised:
            now = _Advertised(generate_id(), str(split_type(type)))
            self.lane.send(ops.advertise(topic, now.type, id=now.id))
            self._advertised[topic] = now
        self.lane.send(text)

    def unadvertise(self, topic: str) -> None:
        """Stop publishing on ``topic``; no effect if it was not advertised."""
        before = self._advertised.pop(topic, None)
        if before is not None:
            self._send(ops.unadvertise(topic, id=before.id))

    def _send(self, frame: bytes) -> None:
        """Send a frame if connected; a new connection repeats it anyway."""
        if self.lane.state == "open":
            try:
                self.lane.send(frame)
            except BridgeError as error:
                self._report(error)

    def _opened(self) -> None:
        super()._opened()
        self._protocol = Protocol()
        self.graph.forget()
        for topic, each in self._advertised.items():
            self._send(ops.advertise(topic, each.type, id=each.id))
        for subscription in list(self._subscriptions.values()):
            subscription.topic.begin_anew()
            subscription.again()
        self._renewals.begin()
        self._on_open()

    def _lost(self, reason: str) -> None:
        super()._lost(reason)
        self._renewals.forget()
        for subscription in self._subscriptions.values():
            subscription.link_lost()
        self._on_close(reason)

    def _received(self, frame: bytes | bytearray) -> None:
        event = self._protocol.receive(frame, time.monotonic())
        stats = self.stats
        stats.frames += 1
        stats.bytes += len(frame)
        if isinstance(event, Publish):
            subscription = self._subscriptions.get(event.topic)
            if subscription is not None:
                usable = self._on_message(subscription.topic, event)
                if usable and subscription.checks_json:
                    subscription.received(event)
        elif event is not None:
            self._other(event)

    def _other(self, event: Event) -> None:
        if isinstance(event, Malformed):
            self.stats.malformed += 1
            if not self._complained:
                self._complained = True
                topics = [each.topic for each in self._subscriptions.values()]
                found = f"{event.size} bytes that are not rosbridge: {event.reason}"
                report_malformed(self._name, found, topics, self._report)
        elif isinstance(event, Unknown):
            self.stats.unknown += 1
        elif isinstance(event, Status) and event.level == "error":
            report_error(self._name, event.msg, self._report)
        elif isinstance(event, CallService):
            answer = "this client offers no services"
            id = None if event.id is None else str(event.id)
            self._send(ops.service_response(event.service, answer, id=id, result=False))

    def _too_large(self, topic: Topic, size: int | None) -> None:
        """Report a topic whose messages are too large for the bridge's CBOR.

        Args:
            topic: The topic.
            size: Bytes of a message in JSON; None if connections ended before one came.

        """
        # A page shows three lines: the advice comes before the details.
        if size is None:
            text = (
                f"{topic.name}: no message came in CBOR for {IN_CBOR:g} s although "
                f"the topic is published, and the connection ended before one came in "
                f"JSON. If messages are too large, increase max_message_size of "
                f"rosbridge_websocket"
            )
        else:
            text = (
                f"{topic.name} is larger than the bridge sends in CBOR: set "
                f"max_message_size of rosbridge_websocket to {size} or more. Until "
                f"then it comes in JSON, once in {THROTTLE // 60_000} minutes"
            )
        fault = BridgeError(text)
        log.warning("%s: %s", self._name, fault)
        self._report(fault)
        topic.over(fault)
