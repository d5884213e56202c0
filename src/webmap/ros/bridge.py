"""The connection to one ROS system, shared by the whole process.

A :class:`Bridge` has topics, messages and services, and refuses messages that only the
gate may publish. The wire protocols are in ``rosbridge``, ``foxglove`` and
``rmw_zenoh``.
"""

import asyncio
import importlib
import logging
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec

from webmap.base.audience import audience
from webmap.base.errors import BridgeClosed, BridgeError
from webmap.base.lifecycle import lifecycle
from webmap.base.scope import Removal, keep
from webmap.ros.callbacks import Callback, Callbacks
from webmap.ros.definitions import Definitions
from webmap.ros.fan_out import FanOut
from webmap.ros.link import LinkType
from webmap.ros.motion_topics import written_behind
from webmap.ros.names import normalise_topic, normalise_url, same_type, split_type
from webmap.ros.received_message import BridgeStats, LinkState, ReceivedMessage
from webmap.ros.rosbridge.graph import is_client_node
from webmap.ros.rosbridge.link import RosbridgeLink
from webmap.ros.subscriptions import (
    Encoding,
    Subscription,
    SubscriptionOptions,
    Topic,
    checked,
)
from webmap.ros.topic_faults import TopicFaults

log = logging.getLogger("webmap.ros")

LINKS: dict[str, LinkType] = {"ws": RosbridgeLink, "wss": RosbridgeLink}
"""The kind of link by the scheme of the URL: *A new kind of link* in the design."""

_HOMES = {
    "foxglove": "webmap.ros.foxglove.link",
    "foxgloves": "webmap.ros.foxglove.link",
    "zenoh": "webmap.agents.link",
    "zenohs": "webmap.agents.link",
    "zenoh-ros2": "webmap.ros.rmw_zenoh.link",
}
"""Modules of WebMap that add a kind of link when they are imported."""


def _link_type(url: str) -> LinkType:
    scheme = url.partition(":")[0]
    if scheme not in LINKS:
        importlib.import_module(_HOMES[scheme])
    return LINKS[scheme]


class Bridge:
    """A connection to one ROS system, through a rosbridge or a Foxglove bridge.

    Creating a bridge opens no connection. The connection opens when WebMap starts, and
    reopens after each loss with all subscriptions and advertisements. Call the methods
    in the model's thread.

    A bridge created by a page function or a module ends with that page or module, also
    for its other users, who get an error. Create a bridge that must outlive a page
    outside of the page function.

    Args:
        url: Address of a rosbridge, such as ``ws://localhost:9090``, or of a Foxglove
            bridge, such as ``foxglove://localhost:8765``, or of the Zenoh router of a
            robot that is only read, such as ``zenoh-ros2://robot:7447``.
        name: Name shown to people; the address if not given.

    Raises:
        ConfigError: If ``url`` is not the address of a bridge.

    """

    def __init__(self, url: str, *, name: str | None = None) -> None:
        self.url = normalise_url(url)
        """The normalised address."""
        self.name = name or self.url
        self.replays = False
        """Whether the bridge plays a recording; its robots may pause and end."""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._topics: dict[str, Topic] = {}
        self._written = written_behind(self.url)
        self._fan_out = FanOut()
        self._on_error = Callbacks(f"{self.name}: on_error", lambda _error: None)
        self._on_open = Callbacks(f"{self.name}: on_open", self._report)
        self._on_close = Callbacks(f"{self.name}: on_close", self._report)
        self._link = _link_type(self.url)(
            self.url,
            self.name,
            opened=self._opened,
            closed=self._closed,
            received=self._received,
            report=self._report,
        )
        self._graph = self._link.graph
        self._faults = TopicFaults(self.name, self._graph.topic_type, self._report)
        self._enlist()

    def _enlist(self) -> None:
        lifecycle.add(self)
        audience.follow(self)
        keep(Removal(self._end))

    def __repr__(self) -> str:
        return f"<Bridge {self.url} {self.state}>"

    @property
    def state(self) -> LinkState:
        """``new``, ``connecting``, ``open``, or ``closed`` after :meth:`stop`."""
        return self._link.lane.state

    @property
    def stats(self) -> BridgeStats:
        """Counts of the connection since the bridge was created."""
        return self._link.stats

    @property
    def trouble(self) -> str | None:
        """Why the connection is not open: the last failed attempt or the last loss."""
        return self._link.trouble

    @property
    def lost(self) -> bool:
        """Whether the connection is closed or failing, not only new or connecting."""
        if self.state == "open":
            return False
        return self.state == "closed" or self.trouble is not None

    @property
    def last_heard(self) -> float | None:
        """When the last bytes came from the bridge, on the monotonic clock."""
        return self._link.lane.last_heard

    @property
    def lag(self) -> float:
        """Approximate delay of the data that now comes from the bridge, in seconds.

        This is the time that the bridge takes to answer a ping; the answer waits behind
        all data that the bridge has sent before. A connection that becomes slow shows
        within a second. Delays in the robot's own nodes are not included.
        """
        return self._link.lane.lag

    def on_open(self, fn: Callable[[], Any]) -> Removal:
        """Call ``fn`` whenever the connection opens; soon, if it is open already.

        Raises:
            BridgeClosed: If the page or module that created this bridge has ended.

        """
        self._link.refuse_if_over()
        callback, removal = self._on_open.add(fn)
        if self.state == "open" and self._loop is not None:
            self._loop.call_soon(callback)
        return removal

    def on_close(self, fn: Callable[[str], Any]) -> Removal:
        """Call ``fn`` with the reason whenever an open connection ends."""
        return self._on_close.add(fn)[1]

    def on_error(self, fn: Callable[[Exception], Any]) -> Removal:
        """Call ``fn`` with each error that a person may need to know."""
        return self._on_error.add(fn)[1]

    def subscribe(
        self,
        topic: str,
        callback: Callable[[Any], Any],
        type: str | None = None,
        *,
        throttle: int = 0,
        decode: type[msgspec.Struct] | None = None,
        encoding: Encoding | None = None,
        queue_length: int = 1,
        unwatched: int = 0,
    ) -> Subscription:
        """Subscribe to a topic, also to one that does not exist yet.

        All listeners of a topic share one subscription on the wire. Each has its own
        throttle, and a message is decoded once for each ``decode``.

        Args:
            topic: Name of the topic.
            callback: Called with each message. If it is a coroutine function, its
                running tasks are cancelled when the subscription ends.
            type: Message type, in either dialect. Without it the bridge can serve only
                a topic that exists at the time of the subscription.
            throttle: Least time between two messages, in milliseconds; 0 gives every
                message. WebMap asks the bridge for at least 1 ms; the bridge then
                queues the messages of a burst.
            decode: A type with the fields to decode; None for a plain dict.
            encoding: ``binary`` for a binary encoding, which keeps infinities and costs
                a bridge less for large messages; ``text``; or ``raw`` for a mapping
                with the serialized bytes of ROS. None uses a binary encoding for types
                that may be large (scans, grids, clouds, paths, arrays of poses,
                markers) and text for all others.
            queue_length: Most messages that the bridge may queue; WebMap asks for at
                least 1.
            unwatched: The same as ``throttle``, if that is longer, while the process
                serves pages and none was open for ten seconds. For data that is only
                shown; it has no effect with a ``throttle`` of 0.

        Returns:
            The subscription. It ends with the current scope, or by its ``remove()``.

        Raises:
            ConfigError: If an argument is invalid, or another listener stated another
                type for the topic.
            BridgeClosed: If the page or module that created this bridge has ended.

        """
        self._link.refuse_if_over()
        name = normalise_topic(topic)
        given = SubscriptionOptions(type, throttle, queue_length, encoding, unwatched)
        options = checked(given, callback, decode)
        if type is not None:
            split_type(type)
        entry = self._topics.get(name) or self._new_topic(name)
        entry.check(options)
        called = Callback(callback, f"{self.name}: {name}", self._report)
        listener = Subscription(entry, called, options, decode)
        if listener.removed:  # its scope has already ended
            return listener
        self._topics[name] = entry
        late, is_first = entry.replay, not entry.listeners
        entry.add(listener)
        if is_first and self.state == "open":
            self._faults.watch(entry)
        elif late is not None:
            self._fan_out.give_soon(late, listener)
        return listener

    def publish(
        self, topic: str, message: Mapping[str, Any], type: str | None = None
    ) -> None:
        """Publish a message now, or raise an error; messages are never queued.

        Args:
            topic: Name of the topic; the first call advertises it.
            message: The fields of the message.
            type: Message type; required the first time.

        Raises:
            MotionRefused: If the topic moves a robot: see :meth:`protect`.
            BridgeClosed: If the connection is not open.
            BridgeError: If the type is unknown or differs from the earlier one.
            ValueError: If a number in the message is NaN or infinite.
            TypeError: If a value in the message has no form in JSON.

        """
        name = normalise_topic(topic)
        entry, before = self._topics.get(name), self._link.published_type(name)
        known = self._graph.known(name) or (entry.message_type if entry else None)
        published_as = type or before or known
        self._written.refuse_message(name, published_as, known)
        if published_as is None:
            raise BridgeError(
                f"{name}: the message type is unknown; pass type= the first time"
            )
        if before is not None and not same_type(before, published_as):
            raise BridgeError(
                f"{name} is advertised as {before}, not as {published_as}"
            )
        self._link.publish(name, published_as, message)

    def unadvertise(self, topic: str) -> None:
        """Stop publishing on ``topic``; no effect if it was not advertised."""
        self._link.unadvertise(normalise_topic(topic))

    def protect(self, topic: str, carries: str = "a goal") -> None:
        """Refuse to publish on ``topic`` from now on: only the gate publishes there.

        WebMap calls this for each topic that is declared as velocity, goal, cancel,
        initial pose or stop hook of a robot. The rule holds for every bridge of this
        address.

        Args:
            topic: Name of the topic.
            carries: What the topic carries, for the error message.

        """
        name = normalise_topic(topic)
        self._written.declare(name, carries)
        self._link.unadvertise(name)

    async def call_service(
        self,
        service: str,
        args: Mapping[str, Any] | Sequence[Any] | None = None,
        *,
        type: str | None = None,
        timeout: float = 5.0,
    ) -> Any:
        """Call a ROS service, over another socket than the data.

        Args:
            service: Name of the service.
            args: The fields of the request.
            type: Service type; some bridges need it.
            timeout: Longest time for the response, in seconds.

        Returns:
            The fields of the response.

        Raises:
            ServiceError: If the service fails or does not respond in time.
            BridgeClosed: If the connection cannot be opened, or ends before the
                response.
            MotionRefused: If the service would move a robot.

        """
        name = normalise_topic(service)
        self._written.refuse_service(name)
        return await self._link.call_service(name, args, type=type, timeout=timeout)

    async def topics(self) -> dict[str, str]:
        """Return the topics and the type of each.

        Raises:
            ServiceError: If the bridge does not list its topics.
            BridgeClosed: If the connection cannot be opened.

        """
        return await self._graph.topics()

    async def topic_type(self, topic: str) -> str | None:
        """Return the type of a topic in the bridge's dialect.

        None if the topic is unknown, or the bridge does not answer.
        """
        return await self._graph.topic_type(normalise_topic(topic))

    async def service_type(self, service: str) -> str | None:
        """Return the type of a service in the bridge's dialect.

        None if the service is unknown, or the bridge does not answer.
        """
        return await self._graph.service_type(normalise_topic(service))

    async def publishers(self, topic: str) -> list[str] | None:
        """Return the nodes that publish a topic; None if the bridge does not answer."""
        return await self._graph.nodes("publishers", normalise_topic(topic))

    async def other_publishers(self, topic: str) -> list[str] | None:
        """Return the publishers without those that serve clients of a bridge.

        WebMap itself is such a client. None as for :meth:`publishers`.
        """
        nodes = await self.publishers(topic)
        return nodes and [name for name in nodes if not is_client_node(name)]

    async def subscribers(self, topic: str) -> list[str] | None:
        """Return the nodes that subscribe to a topic; None if there is no answer."""
        return await self._graph.nodes("subscribers", normalise_topic(topic))

    async def definitions(self, type: str, kind: str = "msg") -> Definitions:
        """Return the definitions of a type and of all its parts, and the included ones.

        Args:
            type: The type.
            kind: ``"msg"``, or ``"srv"`` for the request of a service.

        Raises:
            ServiceError: If the bridge does not return them, or cannot be asked safely.
            BridgeClosed: If the connection cannot be opened.

        """
        return await self._graph.definitions(type, kind)

    async def time(self) -> float | None:
        """Return the time of the ROS system in seconds since 1970.

        The time of a simulator may begin at zero. None if the bridge does not answer.
        """
        return await self._graph.time()

    async def set_parameter(
        self, name: str, value: Any, *, timeout: float = 5.0
    ) -> Any:
        """Set a parameter of ROS 1 and return its new value.

        In ROS 2 parameters belong to nodes and are set by services of the nodes.

        Raises:
            ServiceError: If the bridge does not answer in time.
            BridgeClosed: If the connection cannot be opened.

        """
        return await self._graph.set_parameter(name, value, timeout)

    def audience_changed(self) -> None:
        """Subscribe to what is only shown as often as somebody looks."""
        for topic in list(self._topics.values()):
            topic.change_pace()

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Open the connection and keep it open; called when WebMap starts."""
        if self._link.over is None:
            self._loop = loop
            self._fan_out.begin(loop)
            self._link.lane.start(loop)

    async def stop(self) -> None:
        """Close all connections; the listeners stay for another :meth:`start`."""
        await self._link.stop()
        await self._fan_out.stop()
        await self._faults.stop()
        if self._link.over is not None and self._topics:  # it still has listeners
            log.warning(
                "%s; no more messages from %s", self._link.over, ", ".join(self._topics)
            )
            for topic in tuple(self._topics.values()):
                topic.over(BridgeClosed(self._link.over))

    def _end(self) -> None:
        """End for ever: the page or module that created this bridge has ended."""
        self._link.over = (
            f"the connection to {self.url} ended with the page or the module that made "
            "its bridge: if others use it too, create it outside of both"
        )
        lifecycle.end_service(self)

    def _new_topic(self, name: str) -> Topic:
        return Topic(
            name,
            changed=self._link.subscribe,
            emptied=self._topic_emptied,
            complain=self._faults.message_failed,
        )

    def _topic_emptied(self, topic: Topic) -> None:
        self._topics.pop(topic.name, None)
        self._link.unsubscribe(topic)

    def _opened(self) -> None:
        for topic in list(self._topics.values()):
            self._faults.watch(topic)
        self._on_open.call()

    def _closed(self, reason: str) -> None:
        self._faults.forget()
        for topic in self._topics.values():
            topic.link_lost()
        self._on_close.call(reason)

    def _received(self, topic: Topic, message: ReceivedMessage) -> bool:
        usable = topic.received(message)
        if usable:
            self._fan_out.offer(message, topic.listeners)
        return usable

    def _report(self, error: Exception) -> None:
        self._on_error.call(error)
