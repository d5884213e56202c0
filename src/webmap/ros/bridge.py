"""The link to one ROS system, shared by everything in the process that needs it."""

import asyncio
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from webmap.errors import BridgeClosed, BridgeError, ProtocolError
from webmap.lifecycle import lifecycle
from webmap.outside_text import one_line
from webmap.ros.callbacks import Callback, Callbacks
from webmap.ros.calls import Calls
from webmap.ros.connection import Lane, State
from webmap.ros.doubts import Doubts
from webmap.ros.events import CallService, Event, Malformed, Publish, Status
from webmap.ros.fan_out import FanOut
from webmap.ros.graph import Graph
from webmap.ros.link_trouble import LinkTrouble
from webmap.ros.names import normalise_topic, normalise_url, split_type
from webmap.ros.ops import service_response
from webmap.ros.protocol import Protocol
from webmap.ros.publications import Publications, written_behind
from webmap.ros.renewal import Renewals
from webmap.ros.subscriptions import Subscription, Topic
from webmap.ros.wish import Wish, checked
from webmap.scope import Removal, keep

log = logging.getLogger("webmap.ros")


@dataclass(slots=True)
class BridgeStats:
    """What came on the data lane, since the bridge was made."""

    frames: int = 0
    bytes: int = 0
    malformed: int = 0
    """Frames that were not rosbridge."""

    links: int = 0
    """How often the link was opened."""


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
        self.stats = BridgeStats()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._lane: Lane | None = None
        self._topics: dict[str, Topic] = {}
        self._publications = Publications(written_behind(self.url))
        self._calls = Calls(self.url)
        self._graph = Graph(self.call_service)
        self._fan_out = FanOut()
        self._doubts = Doubts(self.name, self._graph, self._report)
        self._renewals = Renewals(self._graph.published, self._topics.values)
        self._on_error = Callbacks(f"{self.name}: on_error", lambda _error: None)
        self._on_open = Callbacks(f"{self.name}: on_open", self._report)
        self._on_close = Callbacks(f"{self.name}: on_close", self._report)
        self._protocol = Protocol()
        self._trouble = LinkTrouble(self.name, self._report)
        self._over: str | None = None
        """Why nothing comes any more, once what made this bridge has ended."""
        lifecycle.add(self)
        keep(Removal(self._end))

    def __repr__(self) -> str:
        return f"<Bridge {self.url} {self.state}>"

    @property
    def state(self) -> State:
        """``new``, ``connecting``, ``open``, or ``closed`` after :meth:`stop`."""
        return self._lane.state if self._lane is not None else "new"

    @property
    def trouble(self) -> str | None:
        """Why the link is not open: how the last attempt failed or the link ended."""
        return self._trouble.why

    @property
    def lost(self) -> bool:
        """Whether the link is away, rather than open or not reached yet."""
        if self.state == "open":
            return False
        return self.state == "closed" or self.trouble is not None

    @property
    def last_heard(self) -> float | None:
        """When the last bytes came from the bridge, on the monotonic clock."""
        return self._lane.last_heard if self._lane is not None else None

    @property
    def lag(self) -> float:
        """How many seconds what comes from the bridge now was under way, about.

        It is the time that the bridge takes to answer a ping, which waits behind all
        that it has sent before; a link that becomes slow is seen within a second.
        What a robot's own nodes keep back is not in it.
        """
        return self._lane.lag if self._lane is not None else 0.0

    def on_open(self, fn: Callable[[], Any]) -> Removal:
        """Call ``fn`` whenever the link opens; soon, if it is open already.

        Raises:
            BridgeClosed: If the page or the module that made this bridge has ended.

        """
        self._refuse_if_over()
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
        compression: str | None = None,
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
            compression: ``none``, ``png``, ``cbor`` or ``cbor-raw``; None lets
                what may be large (scans, grids, clouds, paths, arrays of poses,
                markers) come in CBOR and the rest in JSON.
            queue_length: Messages that the bridge may hold back; it is asked for
                at least 1.

        Returns:
            What ends it. It ends with the current scope, too.

        Raises:
            ConfigError: If an argument makes no sense, or another listener said
                that the topic has another type.
            BridgeClosed: If the page or the module that made this bridge has ended.

        """
        self._refuse_if_over()
        name = normalise_topic(topic)
        checked(callback, throttle, queue_length, decode)
        if type is not None:
            split_type(type)
        wish = Wish(type, throttle, queue_length, compression)
        book = self._topics.get(name) or self._new_topic(name)
        book.check(wish)
        called = Callback(callback, f"{self.name}: {name}", self._report)
        listener = Subscription(book, called, wish, decode)
        if listener.removed:  # its scope has ended already
            return listener
        self._topics[name] = book
        late, is_first = book.replay, not book.listeners
        book.add(listener)
        if is_first and self.state == "open":
            self._doubts.watch(book)
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
        book = self._topics.get(name)
        known = self._graph.known(name) or (book.message_type if book else None)
        frames = self._publications.frames(name, message, type, known)
        try:
            for frame in frames:
                self._lane_or_raise().send(frame)
        except BridgeClosed:
            if len(frames) > 1:
                self._publications.forget(name)
            raise

    def unadvertise(self, topic: str) -> None:
        """Publish no more on ``topic``; nothing happens if nobody did."""
        for frame in self._publications.forget(topic):
            self._send(frame)

    def protect(self, topic: str, carries: str = "a goal") -> None:
        """Refuse to publish on ``topic`` from now on: the gate writes it.

        A topic that was declared as velocity, goal, cancel, initial pose or stop hook
        of a robot is one. It holds for every bridge of this address.

        Args:
            topic: Name of the topic.
            carries: What it carries, for whoever is refused.

        """
        for frame in self._publications.protect(topic, carries):
            self._send(frame)

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
        self._publications.refuse_goal_service(service)
        self._refuse_if_over()
        return await self._calls.call(normalise_topic(service), args, type, timeout)

    async def topic_type(self, topic: str) -> str | None:
        """Return the type of a topic as rosapi knows it, in the bridge's dialect.

        None if nobody knows the topic, the bridge has no rosapi, or it does not
        answer.
        """
        return await self._graph.topic_type(normalise_topic(topic))

    async def publishers(self, topic: str) -> list[str] | None:
        """Return the nodes that publish a topic, as rosapi knows them.

        None if the bridge has no rosapi, or it does not answer.
        """
        return await self._graph.publishers(normalise_topic(topic))

    async def topics(self) -> dict[str, str]:
        """Return the type of every topic.

        Raises:
            ServiceError: If the bridge has no rosapi, or it does not answer.
            BridgeClosed: If the link cannot be opened.

        """
        return await self._graph.topics()

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Open the link, and keep it open; called when WebMap starts."""
        if self._over or (self._lane is not None and self._lane.state != "closed"):
            return
        self._loop = loop
        self._fan_out.begin(loop)
        self._lane = Lane(
            self.url,
            opened=self._opened,
            received=self._received,
            closed=self._link_lost,
            failed=self._trouble.not_opened,
            busy=lambda: any(t.awaits_large for t in self._topics.values()),
        )
        self._lane.start(loop)

    def _end(self) -> None:
        """End for good: what made this bridge has ended."""
        self._over = (
            f"the link to {self.url} has ended with the page or the module that made "
            "it: a bridge that others use, too, is made outside of both"
        )
        lifecycle.end_service(self)

    def _refuse_if_over(self) -> None:
        if self._over is not None:
            raise BridgeClosed(self._over)

    async def stop(self) -> None:
        """Close every link; listeners stay, for another :meth:`start`."""
        if self._lane is not None:
            await self._lane.stop()
        await self._calls.stop()
        await self._fan_out.stop()
        await self._doubts.stop()
        await self._renewals.stop()
        if self._over is not None and self._topics:  # others listen, who outlive it
            log.warning("%s: nothing more of %s", self._over, ", ".join(self._topics))
            for topic in tuple(self._topics.values()):
                topic.over(BridgeClosed(self._over))

    def _new_topic(self, name: str) -> Topic:
        return Topic(
            name,
            send=self._send,
            complain=self._doubts.message_failed,
            too_large=self._doubts.too_large,
            emptied=self._topic_emptied,
        )

    def _topic_emptied(self, topic: Topic) -> None:
        self._topics.pop(topic.name, None)

    def _send(self, frame: bytes) -> None:
        """Send what a new link will be told anyway; nothing happens while closed."""
        if self._lane is not None and self._lane.state == "open":
            try:
                self._lane.send(frame)
            except BridgeError as error:
                self._report(error)

    def _lane_or_raise(self) -> Lane:
        self._refuse_if_over()
        if self._lane is None:
            raise BridgeClosed(f"the link to {self.url} was never opened")
        return self._lane

    def _opened(self) -> None:
        self.stats.links += 1
        self._protocol = Protocol()
        self._trouble.opened()
        self._graph.forget()
        for frame in self._publications.again():
            self._send(frame)
        for topic in list(self._topics.values()):
            topic.again()
            self._doubts.watch(topic)
        self._renewals.begin()
        self._on_open.call()

    def _link_lost(self, reason: str) -> None:
        self._trouble.lost(reason)
        self._doubts.forget()
        self._renewals.forget()
        for topic in self._topics.values():
            topic.link_lost()
        self._on_close.call(reason)

    def _report(self, error: Exception) -> None:
        self._on_error.call(error)

    def _received(self, frame: bytes | bytearray) -> None:
        event = self._protocol.receive(frame, time.monotonic())
        self.stats.frames += 1
        self.stats.bytes += len(frame)
        if isinstance(event, Publish):
            topic = self._topics.get(event.topic)
            if topic is not None and topic.received(event):
                self._fan_out.offer(event, topic.listeners)
        elif event is not None:
            self._other(event)

    def _other(self, event: Event) -> None:
        if isinstance(event, Malformed):
            self.stats.malformed += 1
            said = self._trouble.malformed(event)
            if said is not None:
                self._mention(said)
        elif isinstance(event, Status) and event.level == "error":
            words = one_line(event.msg)
            log.warning("%s says: %s", self.name, words)
            self._report(BridgeError(f"{self.name} says: {words}"))
        elif isinstance(event, CallService):
            answer = "this client offers no services"
            id = None if event.id is None else str(event.id)
            self._send(service_response(event.service, answer, id=id, result=False))

    def _mention(self, fault: ProtocolError) -> None:
        """Tell one of those who subscribed of what belongs to no topic."""
        for topic in self._topics.values():
            for listener in topic.listeners:
                if listener.mention(fault):
                    return
