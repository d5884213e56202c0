"""A client: the frames that wait to be sent, and its operations about topics."""

import logging
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from webmap.ros.rosbridge.server.dialect import resolve
from webmap.ros.rosbridge.server.encode import Encoder, Publication
from webmap.ros.rosbridge.server.graph import Graph, GraphError

Operation = dict[str, Any]
Handlers = dict[str, Callable[[Operation], None]]


def text(operation: Operation, name: str) -> str:
    """Return a field that must be a string.

    Raises:
        GraphError: If the field is absent, empty or not a string.

    """
    value = operation.get(name)
    if not isinstance(value, str) or not value:
        raise GraphError(f"{name} must be a non-empty string, got {value!r}")
    return value


def whole_number(operation: Operation, name: str) -> int:
    """Return a field that must be a number of at least 0; 0 if absent.

    Raises:
        GraphError: If the field is not such a number.

    """
    value = operation.get(name, 0)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value) or value < 0:
        raise GraphError(f"{name} must be a number from 0 up, got {value!r}")
    return int(value)


DEFAULT_DEPTH = 100
"""Publications of a topic that may wait if the client stated no queue length."""

MOST_REPLIES = 10_000
"""Replies that may wait; a client with more is disconnected."""


class Outbox:
    """Frames to send, in order; each topic keeps only its newest ones."""

    def __init__(self) -> None:
        self._order: deque[str | list[str]] = deque()
        self._topics: dict[str, deque[Publication]] = {}
        self._replies = 0
        self.dropped = 0
        """Publications that were replaced by newer ones of their topic."""

    def __len__(self) -> int:
        return len(self._order)

    @property
    def overflowed(self) -> bool:
        """Whether more replies wait than a client that reads would have."""
        return self._replies > MOST_REPLIES

    def reply(self, frames: list[str]) -> None:
        """Append a reply, in one frame or in fragments; it is never dropped."""
        self._replies += 1
        self._order.append(frames)

    def publication(self, publication: Publication, depth: int) -> None:
        """Append a publication; above ``depth`` the oldest of the topic is dropped."""
        waiting = self._topics.setdefault(publication.topic, deque())
        waiting.append(publication)
        self._order.append(publication.topic)
        while len(waiting) > max(depth, 1):
            waiting.popleft()
            # The order has one entry for each waiting publication; keep the oldest
            # entry.
            self._order.pop()
            self.dropped += 1

    def pop(self) -> list[str] | Publication | None:
        """Return the next reply's frames or publication to send."""
        while self._order:
            entry = self._order.popleft()
            if not isinstance(entry, str):
                self._replies -= 1
                return entry
            waiting = self._topics.get(entry)
            if waiting:
                return waiting.popleft()
        return None

    def forget(self, topic: str) -> None:
        """Drop the waiting publications of a topic that the client unsubscribed."""
        if self._topics.pop(topic, None):
            self._order = deque(entry for entry in self._order if entry != topic)


@dataclass(eq=False, repr=False)
class Client:
    """One client of the server: its graph, and its outgoing frames."""

    graph: Graph
    """The ROS graph that the client sees."""

    encoder: Encoder
    """Builds the frames; its quirks are those of the client's server."""

    clock: Callable[[], float]
    """Returns monotonic seconds."""

    wake: Callable[[], None]
    """Called when the outbox or a throttled subscription has a frame to send."""

    outbox: Outbox = field(default_factory=Outbox, init=False)
    spinning: bool = field(default=False, init=False)
    """Whether the whole server hangs because of this client."""


log = logging.getLogger("webmap.sim")


@dataclass(frozen=True, slots=True)
class SubscribeOptions:
    """The options of one ``op: subscribe``."""

    throttle: float = 0.0
    """The least time between two messages, in seconds."""
    queue_length: int = 0
    fragment_size: int | None = None
    compression: str = "none"


class ClientSubscription:
    """All requests of a client for a topic, merged into one copy of each message."""

    def __init__(self, send: Callable[[Publication, int], None]) -> None:
        self._send = send
        self._requests: dict[str | None, SubscribeOptions] = {}
        self._waiting: deque[Publication] = deque()
        self._sent_at = float("-inf")
        self.merged = SubscribeOptions()
        self._got_any = False

    def ask(self, identifier: str | None, request: SubscribeOptions) -> bool:
        """Add a request; return whether its id is new."""
        is_new = identifier not in self._requests
        self._requests[identifier] = request
        self._merge()
        return is_new

    def drop(self, identifier: str | None) -> bool:
        """Remove a request, or all for None; return whether none is left."""
        if identifier is None:
            self._requests.clear()
        else:
            self._requests.pop(identifier, None)
        if self._requests:
            self._merge()
        return not self._requests

    def _merge(self) -> None:
        # As rosbridge does: the lowest of each, and the densest compression.
        requests = self._requests.values()
        sizes = [r.fragment_size for r in requests if r.fragment_size is not None]
        asked = {r.compression for r in requests}
        dense = [c for c in ("cbor-raw", "cbor", "png") if c in asked]
        self.merged = SubscribeOptions(
            min(r.throttle for r in requests),
            min(r.queue_length for r in requests),
            min(sizes, default=None),
            dense[0] if dense else "none",
        )

    def offer(self, publication: Publication, now: float) -> None:
        """Send a message, keep it until it is due, or drop it."""
        self._got_any = True
        depth = self.merged.queue_length
        if now >= self.due and not self._waiting:
            self._pass_on(publication, now)
        elif depth > 0:
            self._waiting.append(publication)
            while len(self._waiting) > depth:
                self._waiting.popleft()

    @property
    def spins(self) -> bool:
        """Whether a rosbridge 2.1.0 may hang when this subscription ends."""
        return (
            self._got_any and self.merged.throttle == 0 and self.merged.queue_length > 0
        )

    @property
    def due(self) -> float:
        """When the next message may be sent, on the clock of ``offer``."""
        return self._sent_at + self.merged.throttle

    @property
    def next_due(self) -> float | None:
        """When a waiting message may be sent; None if none waits."""
        return self.due if self._waiting else None

    def poll(self, now: float) -> None:
        """Send the messages that are due."""
        while self._waiting and now >= self.due:
            self._pass_on(self._waiting.popleft(), now)

    def _pass_on(self, publication: Publication, now: float) -> None:
        self._sent_at = now
        self._send(publication, self.merged.queue_length)


_COMPRESSIONS = ("none", "png", "cbor", "cbor-raw")


class Topics:
    """One client's publishers and subscriptions."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self._graph = client.graph
        self._advertised: set[str] = set()
        self._subscriptions: dict[str, ClientSubscription] = {}

    @property
    def handlers(self) -> Handlers:
        """The handler of each operation."""
        return {
            "advertise": self._advertise,
            "unadvertise": self._unadvertise,
            "publish": self._publish,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
        }

    def poll(self) -> float | None:
        """Release throttled messages; return seconds to the next one, if any."""
        now = self._client.clock()
        for subscription in self._subscriptions.values():
            subscription.poll(now)
        dues = [s.next_due for s in self._subscriptions.values()]
        soonest = min((due for due in dues if due is not None), default=None)
        return None if soonest is None else max(soonest - now, 0.0)

    def frames(self, publication: Publication) -> list[str | bytes]:
        """Return a publication in the requested encoding; empty if impossible."""
        subscription = self._subscriptions.get(publication.topic)
        if subscription is None:
            return []
        request, encoder = subscription.merged, self._client.encoder
        size = request.fragment_size
        if size is None and encoder.quirks.no_large_cbor:
            size = encoder.max_message_size
        is_binary = request.compression in ("cbor", "cbor-raw")
        if is_binary and request.fragment_size and encoder.quirks.no_cbor_fragments:
            return []
        frame = publication.form(request.compression, encoder)
        if frame is None:
            return []
        if isinstance(frame, bytes):
            return self._whole(frame, publication.topic)
        if size is None:
            return [frame]
        return list(encoder.fragments(frame, size))

    def _whole(self, frame: bytes, topic: str) -> list[str | bytes]:
        encoder = self._client.encoder
        if encoder.quirks.no_large_cbor and len(frame) > encoder.max_message_size:
            log.error(
                "%s: CBOR of %d bytes is above max_message_size (%d) and is not sent, "
                "as rosbridge 2.1.0 does (quirk no_large_cbor)",
                topic,
                len(frame),
                encoder.max_message_size,
            )
            return []
        return [frame]

    def close(self) -> None:
        """Remove the publishers and subscriptions from the graph."""
        for topic, subscription in self._subscriptions.items():
            self._graph.unsubscribe(self, topic)
            self._spin_if_queued(topic, subscription)
        for topic in self._advertised:
            self._graph.unadvertise(self, topic)
        self._subscriptions.clear()
        self._advertised.clear()

    def _advertise(self, operation: Operation) -> None:
        topic = resolve(text(operation, "topic"))
        latch = bool(operation.get("latch", False))
        self._graph.advertise(self, topic, text(operation, "type"), latch=latch)
        self._advertised.add(topic)

    def _unadvertise(self, operation: Operation) -> None:
        topic = resolve(text(operation, "topic"))
        if topic not in self._advertised:
            raise GraphError(f"{topic} is not advertised")
        self._advertised.discard(topic)
        self._graph.unadvertise(self, topic)

    def _publish(self, operation: Operation) -> None:
        topic = resolve(text(operation, "topic"))
        known, quirks = self._graph.topics.get(topic), self._client.encoder.quirks
        if known is not None:
            type_name = known.type
        elif quirks.typed_publish and operation.get("type"):
            type_name = text(operation, "type")
        else:
            raise GraphError(
                f"Cannot infer the type of {topic}: the topic does not exist"
            )
        message = self._graph.conform(
            type_name, operation.get("msg", {}), finite=not quirks.lenient_numbers
        )
        if topic not in self._advertised:
            self._graph.advertise(self, topic, type_name)
            self._advertised.add(topic)
        self._graph.publish(self, topic, message)

    def _subscribe(self, operation: Operation) -> None:
        topic = resolve(text(operation, "topic"))
        request, identifier = _request(operation), operation.get("id")
        subscription = self._subscriptions.get(topic)
        if subscription is None:
            subscription = ClientSubscription(self._enqueue)
            subscription.ask(identifier, request)
            self._subscriptions[topic] = subscription
            try:
                deliver = partial(self._deliver, subscription)
                type_name = operation.get("type") or None
                self._graph.subscribe(self, topic, deliver, type_name)
            except GraphError:
                del self._subscriptions[topic]
                raise
        elif subscription.ask(identifier, request):
            # As in rosbridge, each new id gets the latched messages again.
            self._graph.repeat_latched(topic, partial(self._enqueue, depth=0))

    def _unsubscribe(self, operation: Operation) -> None:
        topic = resolve(text(operation, "topic"))
        subscription = self._subscriptions.get(topic)
        if subscription is None:
            raise GraphError(f"{topic} is not subscribed")
        if subscription.drop(operation.get("id")):
            self._spin_if_queued(topic, subscription)
            del self._subscriptions[topic]
            self._client.outbox.forget(topic)
            self._graph.unsubscribe(self, topic)

    def _spin_if_queued(self, topic: str, subscription: ClientSubscription) -> None:
        if self._client.encoder.quirks.spinning_queue and subscription.spins:
            log.error(
                "%s: a client with throttle_rate 0 and a queue left: this bridge hangs "
                "from now on, as rosbridge 2.1.0 does (quirk spinning_queue)",
                topic,
            )
            self._client.spinning = True

    def _deliver(
        self, subscription: ClientSubscription, publication: Publication
    ) -> None:
        subscription.offer(publication, self._client.clock())
        if subscription.next_due is not None:
            self._client.wake()

    def _enqueue(self, publication: Publication, depth: int) -> None:
        self._client.outbox.publication(publication, depth or DEFAULT_DEPTH)
        self._client.wake()


def _request(operation: Operation) -> SubscribeOptions:
    compression = operation.get("compression") or "none"
    if compression not in _COMPRESSIONS:
        raise GraphError(f"compression must be of {_COMPRESSIONS}, got {compression!r}")
    size = operation.get("fragment_size")
    return SubscribeOptions(
        whole_number(operation, "throttle_rate") / 1000,
        whole_number(operation, "queue_length"),
        None if size is None else max(whole_number(operation, "fragment_size"), 1),
        compression,
    )
