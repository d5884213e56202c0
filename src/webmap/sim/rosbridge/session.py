"""One client's side of the protocol, without its socket."""

import logging
import math
from collections import deque
from collections.abc import Callable
from functools import partial
from itertools import count
from typing import Any

from webmap.sim.rosbridge.dialect import canonical, resolve
from webmap.sim.rosbridge.encode import Encoder, Publication
from webmap.sim.rosbridge.graph import GoalHandle, Graph, GraphError, Respond
from webmap.sim.rosbridge.incoming import IncomingText
from webmap.sim.rosbridge.outbox import DEFAULT_DEPTH, Outbox
from webmap.sim.rosbridge.subscription import Request, Subscription

log = logging.getLogger(__name__)

_COMPRESSIONS = ("none", "png", "cbor", "cbor-raw")
_MOST_INPUT = 10_000


class Session:
    """Takes a client's frames, and has the frames that go to it.

    Args:
        graph: The ROS graph that the client sees.
        encoder: Makes the frames; its quirks are the session's.
        clock: Monotonic seconds.
        wake: Called when :meth:`next_frames` may have something.

    """

    def __init__(
        self,
        graph: Graph,
        encoder: Encoder,
        *,
        clock: Callable[[], float],
        wake: Callable[[], None],
    ) -> None:
        self.graph = graph
        self.encoder = encoder
        self.quirks = encoder.quirks
        self.outbox = Outbox()
        self._clock = clock
        self._wake = wake
        self._incoming = IncomingText()
        self._subscriptions: dict[str, Subscription] = {}
        self._advertised: set[str] = set()
        self._services: set[str] = set()
        self._asked: dict[str, Respond] = {}
        self._goals: dict[tuple[str, str | None], GoalHandle] = {}
        self._numbers = count(1)
        self._queued: deque[dict[str, Any]] = deque()
        self._blocked_by: object | None = None
        self._closed = False

    # What the socket's shell calls.

    def receive(self, data: str | bytes) -> None:
        """Take a frame of the client; it never raises, whatever came."""
        operations = self._incoming.feed(data)
        if not operations and not self._incoming.waits:
            self._complain(None, "no JSON object in the frame")
        self._queued.extend(operations)
        self._run_queued()

    @property
    def overflowed(self) -> bool:
        """Whether so much waits that the client should be let go."""
        return self.outbox.overflowed or len(self._queued) > _MOST_INPUT

    def next_frames(self) -> list[str | bytes]:
        """Return the frames of what goes out next; empty when nothing waits."""
        entry = self.outbox.pop()
        while entry is not None:
            if isinstance(entry, list):
                return list(entry)
            frames = self._publication_frames(entry)
            if frames:
                return frames
            entry = self.outbox.pop()
        return []

    def poll(self) -> float | None:
        """Release what throttling held back; return seconds to the next, if any."""
        now = self._clock()
        for subscription in self._subscriptions.values():
            subscription.poll(now)
        dues = [s.next_due for s in self._subscriptions.values()]
        soonest = min((due for due in dues if due is not None), default=None)
        return None if soonest is None else max(soonest - now, 0.0)

    def close(self) -> None:
        """Take everything of this client out of the graph; its goals go on."""
        self._closed = True
        for topic in tuple(self._subscriptions):
            self.graph.unsubscribe(self, topic)
        for topic in tuple(self._advertised):
            self.graph.unadvertise(self, topic)
        for service in tuple(self._services):
            self.graph.unserve(self, service)
        for respond in tuple(self._asked.values()):
            respond("the service's client has gone", ok=False)
        self._asked.clear()
        self._subscriptions.clear()

    # Operations.

    def _run_queued(self) -> None:
        while self._queued and self._blocked_by is None and not self._closed:
            operation = self._queued.popleft()
            identifier = operation.get("id")
            try:
                self._run(operation)
            except GraphError as error:
                self._complain(identifier, str(error))
            except Exception:
                log.exception("operation failed: %.200r", operation)
                self._complain(identifier, "internal error")

    def _run(self, operation: dict[str, Any]) -> None:
        name = operation.get("op")
        handle = _OPERATIONS.get(name) if isinstance(name, str) else None
        if handle is None:
            raise GraphError(f"Unknown operation: {name}")
        handle(self, operation)

    def _advertise(self, operation: dict[str, Any]) -> None:
        topic = resolve(_text(operation, "topic"))
        self.graph.advertise(
            self,
            topic,
            _text(operation, "type"),
            latch=bool(operation.get("latch", False)),
        )
        self._advertised.add(topic)

    def _unadvertise(self, operation: dict[str, Any]) -> None:
        topic = resolve(_text(operation, "topic"))
        if topic not in self._advertised:
            raise GraphError(f"{topic} is not advertised")
        self._advertised.discard(topic)
        self.graph.unadvertise(self, topic)

    def _publish(self, operation: dict[str, Any]) -> None:
        topic = resolve(_text(operation, "topic"))
        known = self.graph.topics.get(topic)
        if known is None:
            raise GraphError(f"Cannot infer the type of {topic}: nobody has it")
        message = self.graph.conform(
            known.type,
            operation.get("msg", {}),
            finite=not self.quirks.lenient_numbers,
        )
        if topic not in self._advertised:
            self.graph.advertise(self, topic, known.type)
            self._advertised.add(topic)
        self.graph.publish(self, topic, message)

    def _subscribe(self, operation: dict[str, Any]) -> None:
        topic = resolve(_text(operation, "topic"))
        type_name = operation.get("type") or None
        request = _request(operation)
        subscription = self._subscriptions.get(topic)
        if subscription is None:
            subscription = Subscription(self._enqueue)
            subscription.ask(operation.get("id"), request)
            deliver = partial(self._deliver, subscription)
            self.graph.subscribe(self, topic, deliver, type_name)
            self._subscriptions[topic] = subscription
            return
        if subscription.ask(operation.get("id"), request):
            self.graph.repeat_latched(self.graph.topics[topic], self._enqueue_newest)

    def _unsubscribe(self, operation: dict[str, Any]) -> None:
        topic = resolve(_text(operation, "topic"))
        subscription = self._subscriptions.get(topic)
        if subscription is None:
            raise GraphError(f"{topic} is not subscribed")
        if subscription.drop(operation.get("id")):
            del self._subscriptions[topic]
            self.outbox.forget(topic)
            self.graph.unsubscribe(self, topic)

    def _call_service(self, operation: dict[str, Any]) -> None:
        service = _text(operation, "service")
        identifier = operation.get("id")
        size = operation.get("fragment_size")
        blocks = object()
        if self.quirks.blocking_services:
            self._blocked_by = blocks

        def respond(values: Any, *, ok: bool = True) -> None:
            response = {
                "op": "service_response",
                "service": service,
                "values": values,
                "result": ok,
            }
            self._reply(response, identifier, size)
            self._unblock(blocks)

        self.graph.call(service, operation.get("args", {}), respond)

    def _advertise_service(self, operation: dict[str, Any]) -> None:
        service = resolve(_text(operation, "service"))
        type_name = _text(operation, "type")
        self.graph.serve(self, service, type_name, partial(self._ask_client, service))
        self._services.add(service)

    def _unadvertise_service(self, operation: dict[str, Any]) -> None:
        service = resolve(_text(operation, "service"))
        self._services.discard(service)
        self.graph.unserve(self, service)

    def _ask_client(
        self, service: str, request: dict[str, Any], respond: Respond
    ) -> None:
        identifier = f"service_request:{service}:{next(self._numbers)}"
        self._asked[identifier] = respond
        call = {"op": "call_service", "id": identifier, "service": service}
        self._reply({**call, "args": request})

    def _service_response(self, operation: dict[str, Any]) -> None:
        respond = self._asked.pop(_text(operation, "id"), None)
        if respond is None:
            raise GraphError("response to a service call that nobody waits for")
        respond(operation.get("values", {}), ok=bool(operation.get("result", True)))

    def _send_action_goal(self, operation: dict[str, Any]) -> None:
        action = _text(operation, "action")
        identifier = operation.get("id")
        server = self.graph.actions.get(resolve(action))
        wanted = canonical(_text(operation, "action_type"))
        if server is None or server.type != wanted:
            message = f"Action server {action} of type {wanted} not available"
            self._action_result(action, identifier, 0, message, ok=False)
            return
        goal = self.graph.conform(
            f"{server.type}_Goal", operation.get("args", {}), finite=True
        )
        key = (resolve(action), identifier)
        blocks = object()
        if self.quirks.blocking_goals:
            self._blocked_by = blocks
        wants_feedback = bool(operation.get("feedback", False))

        def on_feedback(values: dict[str, Any]) -> None:
            if wants_feedback:
                feedback = {"op": "action_feedback", "action": action}
                self._reply({**feedback, "values": values}, identifier)

        def on_result(status: int, values: dict[str, Any]) -> None:
            self._goals.pop(key, None)
            self._action_result(action, identifier, status, values, ok=True)
            self._unblock(blocks)

        handle = server.send_goal(goal, on_feedback, on_result)
        self._goals[key] = handle

    def _cancel_action_goal(self, operation: dict[str, Any]) -> None:
        # Handles belong to the socket that sent the goal: another finds nothing.
        key = (resolve(_text(operation, "action")), operation.get("id"))
        handle = self._goals.get(key)
        if handle is None:
            raise GraphError(f"no goal {key[1]!r} of {key[0]} was sent here")
        handle.cancel()

    def _status(self, operation: dict[str, Any]) -> None:
        log.info("status of a client: %.500s", operation.get("msg"))

    # What goes to the client.

    def _action_result(
        self, action: str, identifier: Any, status: int, values: Any, *, ok: bool
    ) -> None:
        result = {"op": "action_result", "action": action, "values": values}
        self._reply({**result, "status": status, "result": ok}, identifier)

    def _deliver(self, subscription: Subscription, publication: Publication) -> None:
        subscription.offer(publication, self._clock())
        if subscription.next_due is not None:
            self._wake()

    def _enqueue(self, publication: Publication, depth: int) -> None:
        self.outbox.publication(publication, depth or DEFAULT_DEPTH)
        self._wake()

    def _enqueue_newest(self, publication: Publication) -> None:
        self._enqueue(publication, 0)

    def _publication_frames(self, publication: Publication) -> list[str | bytes]:
        subscription = self._subscriptions.get(publication.topic)
        if subscription is None:
            return []
        request = subscription.merged
        size = request.fragment_size
        is_binary = request.compression in ("cbor", "cbor-raw")
        if is_binary and size and self.quirks.no_cbor_fragments:
            return []
        frame = publication.form(request.compression, self.encoder)
        if frame is None:
            return []
        if size is None or isinstance(frame, bytes):
            return [frame]
        return list(self.encoder.fragments(frame, size))

    def _reply(
        self, operation: dict[str, Any], identifier: Any = None, size: Any = None
    ) -> None:
        if self._closed:
            return
        if identifier is not None:
            operation["id"] = identifier
        text = self.encoder.json(operation)
        fragmented = isinstance(size, int) and size > 0
        frames = (
            self.encoder.fragments(text, size, identifier) if fragmented else [text]
        )
        self.outbox.reply(frames)
        self._wake()

    def _complain(self, identifier: Any, message: str) -> None:
        log.debug("bad request: %s", message)
        if not self.quirks.silent:
            status = {"op": "status", "level": "error", "msg": message}
            self._reply(status, identifier)

    def _unblock(self, blocks: object) -> None:
        if self._blocked_by is blocks:
            self._blocked_by = None
            self._run_queued()


_OPERATIONS: dict[str, Callable[[Session, dict[str, Any]], None]] = {
    "advertise": Session._advertise,
    "unadvertise": Session._unadvertise,
    "publish": Session._publish,
    "subscribe": Session._subscribe,
    "unsubscribe": Session._unsubscribe,
    "call_service": Session._call_service,
    "advertise_service": Session._advertise_service,
    "unadvertise_service": Session._unadvertise_service,
    "service_response": Session._service_response,
    "send_action_goal": Session._send_action_goal,
    "cancel_action_goal": Session._cancel_action_goal,
    "status": Session._status,
}


def _text(operation: dict[str, Any], name: str) -> str:
    value = operation.get(name)
    if not isinstance(value, str) or not value:
        raise GraphError(f"{name} must be a non-empty string, got {value!r}")
    return value


def _number(operation: dict[str, Any], name: str) -> int:
    value = operation.get(name, 0)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not math.isfinite(value) or value < 0:
        raise GraphError(f"{name} must be a number from 0 up, got {value!r}")
    return int(value)


def _request(operation: dict[str, Any]) -> Request:
    compression = operation.get("compression") or "none"
    if compression not in _COMPRESSIONS:
        raise GraphError(f"compression must be of {_COMPRESSIONS}, got {compression!r}")
    size = operation.get("fragment_size")
    return Request(
        _number(operation, "throttle_rate") / 1000,
        _number(operation, "queue_length"),
        None if size is None else max(_number(operation, "fragment_size"), 1),
        compression,
    )
