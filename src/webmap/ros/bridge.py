"""The link to one ROS system, shared by everything in the process that needs it.

What is said here holds for any kind of link: topics, messages, services and who may
publish what. How it goes over the wire is known to the link behind it alone.
"""

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Self

import msgspec

from webmap.base.errors import BridgeClosed, BridgeError
from webmap.base.lifecycle import lifecycle
from webmap.base.scope import Removal, keep, no_scope
from webmap.ros.callbacks import Callback, Callbacks
from webmap.ros.definitions import Definitions
from webmap.ros.fan_out import FanOut
from webmap.ros.moving import written_behind
from webmap.ros.names import normalise_topic, normalise_url, same_type, split_type
from webmap.ros.received import BridgeStats, LinkState, ReceivedMessage
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


class Bridge:
    """A link to one ROS system through a rosbridge v2 server.

    Making one only records; the link is opened when WebMap starts and is opened again
    whenever it is lost, with all subscriptions and advertisements. Its methods are
    called in the model's thread.

    One that a page function or a module makes ends with that page or module, also for
    others who use it: they are told so. What outlives a page needs one made outside.

    Args:
        url: Address of the rosbridge, such as ``ws://localhost:9090``.
        name: What people call it; the address if not given.

    Raises:
        ConfigError: If ``url`` is not a WebSocket address.

    """

    def __init__(self, url: str, *, name: str | None = None) -> None:
        self.url = normalise_url(url)
        """The one spelling of the address."""
        self.name = name or self.url
        self.replays = False
        """Whether a recording is played behind it, whose robots may pause and end."""
        self._loop: asyncio.AbstractEventLoop | None = None
        self._topics: dict[str, Topic] = {}
        self._written = written_behind(self.url)
        self._fan_out = FanOut()
        self._on_error = Callbacks(f"{self.name}: on_error", lambda _error: None)
        self._on_open = Callbacks(f"{self.name}: on_open", self._report)
        self._on_close = Callbacks(f"{self.name}: on_close", self._report)
        self._link = RosbridgeLink(
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
        keep(Removal(self._end))

    def __repr__(self) -> str:
        return f"<Bridge {self.url} {self.state}>"

    @property
    def state(self) -> LinkState:
        """``new``, ``connecting``, ``open``, or ``closed`` after :meth:`stop`."""
        return self._link.lane.state

    @property
    def stats(self) -> BridgeStats:
        """What came over the link, since the bridge was made."""
        return self._link.stats

    @property
    def trouble(self) -> str | None:
        """Why the link is not open: how the last attempt failed or the link ended."""
        return self._link.trouble

    @property
    def lost(self) -> bool:
        """Whether the link is away, rather than open or not reached yet."""
        if self.state == "open":
            return False
        return self.state == "closed" or self.trouble is not None

    @property
    def last_heard(self) -> float | None:
        """When the last bytes came from the bridge, on the monotonic clock."""
        return self._link.lane.last_heard

    @property
    def lag(self) -> float:
        """How many seconds what comes from the bridge now was under way, about.

        It is the time that the bridge takes to answer a ping, which waits behind all
        that it has sent before; a link that becomes slow is seen within a second.
        What a robot's own nodes keep back is not in it.
        """
        return self._link.lane.lag

    def on_open(self, fn: Callable[[], Any]) -> Removal:
        """Call ``fn`` whenever the link opens; soon, if it is open already.

        Raises:
            BridgeClosed: If the page or the module that made this bridge has ended.

        """
        self._link.refuse_if_over()
        callback, removal = self._on_open.add(fn)
        if self.state == "open" and self._loop is not None:
            self._loop.call_soon(callback)
        return removal

    def on_close(self, fn: Callable[[str], Any]) -> Removal:
        """Call ``fn`` with the reason whenever an open link ends."""
        return self._on_close.add(fn)[1]

    def on_error(self, fn: Callable[[Exception], Any]) -> Removal:
        """Call ``fn`` with each error that a person might want to know of."""
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
    ) -> Subscription:
        """Hear the messages of a topic; also of one that does not exist yet.

        All listeners to a topic share what comes over the wire, each with a throttle
        of its own, and a message is decoded once for each ``decode``.

        Args:
            topic: Name of the topic.
            callback: Called with each message; what a coroutine function goes on
                with is cancelled when the subscription ends.
            type: Message type, in either dialect. Without it the bridge can only
                serve a topic that exists when it is asked.
            throttle: Least time between two messages, in milliseconds; 0 gives every
                message. The bridge is never asked for less than 1 ms between two, and
                then keeps the messages of a burst.
            decode: A type with the fields that are wanted; None for a plain dict.
            encoding: ``binary`` for a binary encoding, which keeps infinities and
                costs a bridge less for large messages; ``text``; or ``raw`` for a
                mapping with the bytes that ROS itself sends. None lets what may be
                large (scans, grids, clouds, paths, arrays of poses, markers) come in
                a binary encoding and the rest as text.
            queue_length: Messages that the bridge may hold back; it is asked for
                at least 1.

        Returns:
            What ends it. It ends with the current scope, too.

        Raises:
            ConfigError: If an argument makes no sense, or another listener said
                that the topic has another type.
            BridgeClosed: If the page or the module that made this bridge has ended.

        """
        self._link.refuse_if_over()
        name = normalise_topic(topic)
        wanted = SubscriptionOptions(type, throttle, queue_length, encoding)
        options = checked(wanted, callback, decode)
        if type is not None:
            split_type(type)
        entry = self._topics.get(name) or self._new_topic(name)
        entry.check(options)
        called = Callback(callback, f"{self.name}: {name}", self._report)
        listener = Subscription(entry, called, options, decode)
        if listener.removed:  # its scope has ended already
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
        """Publish a message now, or not at all; it is never kept for later.

        Args:
            topic: Name of the topic; it is advertised the first time.
            message: The fields of the message.
            type: Message type; needed the first time.

        Raises:
            MotionRefused: If the topic moves a robot: see :meth:`protect`.
            BridgeClosed: If the link is not open.
            BridgeError: If the type is not known or not the one of before.
            ValueError: If a number in the message is NaN or infinite.
            TypeError: If a value in the message is nothing that JSON knows.

        """
        name = normalise_topic(topic)
        entry, before = self._topics.get(name), self._link.published_type(name)
        known = self._graph.known(name) or (entry.message_type if entry else None)
        wanted = type or before or known
        self._written.refuse_message(name, wanted, known)
        if wanted is None:
            raise BridgeError(f"{name}: say the message type the first time")
        if before is not None and not same_type(before, wanted):
            raise BridgeError(f"{name} is advertised as {before}, not as {wanted}")
        self._link.publish(name, wanted, message)

    def unadvertise(self, topic: str) -> None:
        """Publish no more on ``topic``; nothing happens if nobody did."""
        self._link.unadvertise(normalise_topic(topic))

    def protect(self, topic: str, carries: str = "a goal") -> None:
        """Refuse to publish on ``topic`` from now on: the gate writes it.

        A topic that was declared as velocity, goal, cancel, initial pose or stop hook
        of a robot is one. It holds for every bridge of this address.

        Args:
            topic: Name of the topic.
            carries: What it carries, for whoever is refused.

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
        """Call a ROS service; calls share no socket with data.

        Args:
            service: Name of the service.
            args: The fields of the request.
            type: Service type; some bridges need it.
            timeout: Longest time for the answer, in seconds.

        Returns:
            The fields of the answer.

        Raises:
            ServiceError: If the service fails or does not answer in time.
            BridgeClosed: If the link cannot be opened, or ends before the answer.
            MotionRefused: If the service would send a robot somewhere.

        """
        name = normalise_topic(service)
        self._written.refuse_service(name)
        return await self._link.call_service(name, args, type=type, timeout=timeout)

    async def topics(self) -> dict[str, str]:
        """Return the type of every topic.

        Raises:
            ServiceError: If the bridge does not list its topics.
            BridgeClosed: If the link cannot be opened.

        """
        return await self._graph.topics()

    async def topic_type(self, topic: str) -> str | None:
        """Return the type of a topic in the bridge's dialect.

        None if nobody knows the topic, or the bridge does not answer.
        """
        return await self._graph.topic_type(normalise_topic(topic))

    async def service_type(self, service: str) -> str | None:
        """Return the type of a service in the bridge's dialect.

        None if nobody knows the service, or the bridge does not answer.
        """
        return await self._graph.service_type(normalise_topic(service))

    async def publishers(self, topic: str) -> list[str] | None:
        """Return the nodes that publish a topic; None if the bridge does not answer."""
        return await self._graph.nodes("publishers", normalise_topic(topic))

    async def other_publishers(self, topic: str) -> list[str] | None:
        """Return the publishers without those that publish for clients of a bridge.

        WebMap itself is such a client. None as for :meth:`publishers`.
        """
        return await self._graph.other_publishers(normalise_topic(topic))

    async def subscribers(self, topic: str) -> list[str] | None:
        """Return the nodes that subscribe to a topic; None as for publishers."""
        return await self._graph.nodes("subscribers", normalise_topic(topic))

    async def definitions(self, type: str, kind: str = "msg") -> Definitions:
        """Return the definitions of a type and of all its parts, and the shipped ones.

        Args:
            type: The type.
            kind: ``"msg"``, or ``"srv"`` for the request of a service.

        Raises:
            ServiceError: If the bridge does not say them, or cannot be asked safely.
            BridgeClosed: If the link cannot be opened.

        """
        return await self._link.definitions(type, kind)

    async def time(self) -> float | None:
        """Return the time of the ROS system in seconds since 1970.

        That of a simulator may begin at zero. None if the bridge does not answer.
        """
        return await self._graph.time()

    async def set_parameter(
        self, name: str, value: Any, *, timeout: float = 5.0
    ) -> Any:
        """Set a parameter of ROS 1; return the value that it has then.

        Parameters of ROS 2 belong to nodes, which have services for them.

        Raises:
            ServiceError: If the bridge does not answer in time.
            BridgeClosed: If the link cannot be opened.

        """
        return await self._graph.set_parameter(name, value, timeout)

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Open the link, and keep it open; called when WebMap starts."""
        if self._link.over is None:
            self._loop = loop
            self._fan_out.begin(loop)
            self._link.lane.start(loop)

    async def stop(self) -> None:
        """Close every link; listeners stay, for another :meth:`start`."""
        await self._link.stop()
        await self._fan_out.stop()
        await self._faults.stop()
        if self._link.over is not None and self._topics:  # others listen to it still
            log.warning(
                "%s: nothing more of %s", self._link.over, ", ".join(self._topics)
            )
            for topic in tuple(self._topics.values()):
                topic.over(BridgeClosed(self._link.over))

    def _end(self) -> None:
        """End for good: what made this bridge has ended."""
        self._link.over = (
            f"the link to {self.url} has ended with the page or the module that made "
            "it: a bridge that others use, too, is made outside of both"
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


class TemporaryBridge(Bridge):
    """A bridge for the time of an ``async with``, such as to look at a robot.

    WebMap's life cycle does not start it.
    """

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(self, *exception: object) -> None:
        await self.stop()

    async def open(self) -> None:
        """Open the link for messages; questions open one of their own.

        Raises:
            BridgeClosed: If it cannot be opened.

        """
        loop = asyncio.get_running_loop()
        opened: asyncio.Future[None] = loop.create_future()

        def failed(error: Exception) -> None:
            if not opened.done():
                opened.set_exception(error)

        def succeeded() -> None:
            if not opened.done():
                opened.set_result(None)

        with no_scope():
            removals = (self.on_open(succeeded), self.on_error(failed))
        self.start(loop)
        try:
            await opened
        finally:
            for removal in removals:
                removal.remove()

    def _enlist(self) -> None:
        pass
