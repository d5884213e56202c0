"""The ROS graph behind the server: topics, services, actions and their nodes."""

import asyncio
import logging
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

from webmap.ros.definitions import UnknownType
from webmap.ros.rosbridge.server.dialect import canonical, resolve
from webmap.ros.rosbridge.server.encode import Publication
from webmap.ros.rosbridge.server.schema import MessageMismatch, Schema

log = logging.getLogger("webmap.sim")

BRIDGE_NODE = "/rosbridge_websocket"

Deliver = Callable[[Publication], None]


class GraphError(Exception):
    """A request that the graph refuses; the text is for the client."""


class ServiceFailed(Exception):
    """A service ran and failed; the text becomes the response's values."""


class Respond(Protocol):
    """Ends a service call; called once."""

    def __call__(self, values: Any, *, ok: bool = True) -> None:
        """End the call with the response's values, or the reason of the failure."""


ServiceHandler = Callable[[dict[str, Any], Respond], None]


@dataclass(slots=True)
class GraphTopic:
    """A topic with its type, publishers and subscribers."""

    name: str
    type: str
    publishers: dict[object, str] = field(default_factory=dict)
    """The node's name for each publisher."""
    subscribers: dict[object, tuple[str, Deliver]] = field(default_factory=dict)
    latched: dict[object, Publication | None] = field(default_factory=dict)
    """The newest message of each publisher that latches."""


@dataclass(frozen=True, slots=True)
class Service:
    """A service with its type and its server."""

    name: str
    type: str
    node: str
    owner: object
    handle: ServiceHandler


class GoalHandle(Protocol):
    """A goal that an action server has accepted."""

    def cancel(self) -> None:
        """Request the end of the goal; its result still comes."""


class ActionServer(Protocol):
    """Executes the goals of an action."""

    type: str

    def send_goal(
        self,
        goal: dict[str, Any],
        on_feedback: Callable[[dict[str, Any]], None],
        on_result: Callable[[int, dict[str, Any]], None],
    ) -> GoalHandle | None:
        """Accept a goal, or return None to reject it.

        ``on_result`` is called once for an accepted goal, with a status of action_msgs.
        """


class Graph:
    """One ROS system in one process."""

    def __init__(
        self, schema: Schema, *, clock: Callable[[], float] = time.time
    ) -> None:
        self.schema = schema
        self.clock = clock
        self.topics: dict[str, GraphTopic] = {}
        self.services: dict[str, Service] = {}
        self.actions: dict[str, ActionServer] = {}
        self.refusal = ""
        """Why there may be no new publisher and no new service; empty if there may."""
        self.subscribed = asyncio.Event()
        """Set at the first subscription."""

    def _refuse_new(self) -> None:
        if self.refusal:
            raise GraphError(self.refusal)

    def advertise(
        self,
        owner: object,
        name: str,
        type_name: str,
        *,
        node: str = BRIDGE_NODE,
        latch: bool = False,
    ) -> None:
        """Register ``owner`` as publisher of a topic.

        Raises:
            GraphError: If the type is unknown, or the topic has another, or no new
                publisher is allowed.

        """
        self._refuse_new()
        topic = self._topic(name, type_name)
        topic.publishers[owner] = node
        if latch:
            topic.latched.setdefault(owner, None)

    def unadvertise(self, owner: object, name: str) -> None:
        """Remove the publisher and its latched message."""
        topic = self.topics.get(resolve(name))
        if topic:
            topic.publishers.pop(owner, None)
            topic.latched.pop(owner, None)
            self._forget_if_unused(topic)

    def subscribe(
        self,
        owner: object,
        name: str,
        deliver: Deliver,
        type_name: str | None = None,
        *,
        node: str = BRIDGE_NODE,
    ) -> None:
        """Subscribe ``owner`` to a topic, and deliver its latched messages.

        Raises:
            GraphError: If the type is unknown, missing or not the topic's.

        """
        topic = self._topic(name, type_name)
        topic.subscribers[owner] = (node, deliver)
        self.repeat_latched(topic.name, deliver)
        self.subscribed.set()

    def repeat_latched(self, name: str, deliver: Deliver) -> None:
        """Deliver the latched messages of a topic."""
        topic = self.topics.get(name)
        for publication in tuple(topic.latched.values()) if topic else ():
            if publication:
                deliver(publication)

    def forget_latched(self, owner: object, name: str) -> None:
        """Forget the newest message of a publisher that latches."""
        topic = self.topics.get(name)
        if topic and owner in topic.latched:
            topic.latched[owner] = None

    def unsubscribe(self, owner: object, name: str) -> None:
        """End a subscription; a topic without publishers and subscribers is removed."""
        topic = self.topics.get(resolve(name))
        if topic:
            topic.subscribers.pop(owner, None)
            self._forget_if_unused(topic)

    def is_wanted(self, name: str) -> bool:
        """Return whether a message on this topic would be delivered, now or later."""
        topic = self.topics.get(name)
        return bool(topic and (topic.subscribers or topic.latched))

    def publish(self, owner: object, name: str, message: dict[str, Any]) -> None:
        """Deliver a message, which must fit the topic's type, to all subscribers."""
        topic = self.topics[resolve(name)]
        publication = Publication(topic.name, topic.type, message, self.clock())
        if owner in topic.latched:
            topic.latched[owner] = publication
        for _, deliver in tuple(topic.subscribers.values()):
            try:
                deliver(publication)
            except Exception:
                log.exception("a subscriber of %s failed", name)

    def conform(self, type_name: str, value: Any, *, finite: bool) -> dict[str, Any]:
        """Return a complete message from a client's values.

        Raises:
            GraphError: If the values do not fit the type.

        """
        try:
            return self.schema.conform(type_name, value, finite=finite)
        except (MessageMismatch, UnknownType) as error:
            raise GraphError(str(error)) from None

    def serve(
        self,
        owner: object,
        name: str,
        type_name: str,
        handle: ServiceHandler,
        *,
        node: str = BRIDGE_NODE,
    ) -> None:
        """Register ``owner`` as the server of a service; the newest server responds.

        Raises:
            GraphError: If no new service is allowed.

        """
        self._refuse_new()
        name = resolve(name)
        self.services[name] = Service(name, canonical(type_name), node, owner, handle)

    def unserve(self, owner: object, name: str) -> None:
        """Remove a service, if ``owner`` is still its server."""
        service = self.services.get(resolve(name))
        if service and service.owner is owner:
            del self.services[service.name]

    def call(self, name: str, args: Any, respond: Respond) -> None:
        """Call a service; ``respond`` is called once, now, later or never."""
        service = self.services.get(resolve(name))
        if service is None:
            respond(f"Service {name} does not exist", ok=False)
            return
        try:
            service.handle(self._request(service.type, args), respond)
        except (GraphError, MessageMismatch, UnknownType, ServiceFailed) as error:
            respond(str(error), ok=False)
        except Exception as error:
            log.exception("service %s failed", name)
            respond(str(error), ok=False)

    def _request(self, type_name: str, args: Any) -> dict[str, Any]:
        request = f"{type_name}Request"
        try:
            self.schema.fields(request)
        except UnknownType:
            # A type of the client: the client knows its fields, the graph does not.
            return dict(args) if isinstance(args, Mapping) else {}
        return self.schema.conform(request, args)

    def _topic(self, name: str, type_name: str | None) -> GraphTopic:
        name = resolve(name)
        topic = self.topics.get(name)
        if type_name is None:
            if topic is None:
                raise GraphError(
                    f"Cannot infer the type of {name}: the topic does not exist"
                )
            return topic
        canonical_name = canonical(type_name)
        if not self.schema.knows(canonical_name):
            raise GraphError(f"Unable to load the message type {type_name}")
        if topic is None:
            topic = self.topics[name] = GraphTopic(name, canonical_name)
        if topic.type != canonical_name:
            raise GraphError(f"{name} is a {topic.type}, not a {type_name}")
        return topic

    def _forget_if_unused(self, topic: GraphTopic) -> None:
        if not topic.publishers and not topic.subscribers:
            self.topics.pop(topic.name, None)
