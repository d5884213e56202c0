"""The connections of a bridge to the Zenoh router of a robot with rmw_zenoh.

WebMap is a client of the router: it reads the tokens of the nodes and subscribes to
topics. It publishes nothing, calls no service, and announces no node.
"""

import asyncio
import atexit
import threading
import time
from collections import deque
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager, suppress
from typing import Any, Literal
from urllib.parse import urlsplit

import msgspec

from webmap.base.errors import BridgeClosed, BridgeError, ConfigError, ServiceError
from webmap.base.text import one_line
from webmap.base.zenoh_sessions import client_settings, why_not_reached, zenoh_config
from webmap.ros.bridge import LINKS
from webmap.ros.foxglove.graph import FoxgloveGraph
from webmap.ros.foxglove.link import FoxgloveLink
from webmap.ros.limits import MAX_FRAME
from webmap.ros.names import DEFAULT_PORTS
from webmap.ros.rmw_zenoh.offer import (
    INTRODUCTION,
    MOST_ENDPOINTS,
    ROOT,
    Change,
    Offer,
    change_of,
    error_status,
    message_frame,
)
from webmap.ros.sockets.connection import CLOSED_HERE, LOOK_PERIOD, BridgeConnection

try:
    import zenoh
    from zenoh import ext
    from zenoh.handlers import Callback, FifoChannel
except ImportError:
    raise ConfigError(
        "zenoh-ros2:// needs Zenoh, which is not installed: pip install 'webmap[fleet]'"
    ) from None

SCHEME = "zenoh-ros2"

PATIENCE = 4.0
"""Longest wait for the tokens, in seconds."""

MOST_WAITING = 1_000
"""Messages of one topic that wait at most to be read; then the oldest are dropped."""

MOST_WAITING_BYTES = 8 << 20
"""The same in bytes, besides the newest message."""

LOSSY = "messages come faster than they are read; the oldest were left out"


def domain_of(url: str) -> int:
    """Return the domain in an address, such as ``zenoh-ros2://robot:7447/42``; or 0.

    Raises:
        ConfigError: If the address has something else there.

    """
    text = urlsplit(url).path.strip("/") or "0"
    if not (text.isdecimal() and len(text) < 4 and int(text) <= 232):
        raise ConfigError(
            f"got the domain {text!r} in {url}, expected ROS_DOMAIN_ID of the robot, a "
            f"number from 0 to 232: {SCHEME}://robot:{DEFAULT_PORTS[SCHEME]}/42"
        )
    return int(text)


@asynccontextmanager
async def session_with(url: str) -> AsyncIterator[zenoh.Session]:
    """Open a session with the router of an address, and close it in the end.

    Raises:
        BridgeClosed: If that fails; with the reason.

    """
    parts = urlsplit(url)
    port = "" if parts.port else f":{DEFAULT_PORTS[SCHEME]}"
    locator = f"tcp/{parts.netloc}{port}"
    config = zenoh_config(**client_settings(locator, 4 * MAX_FRAME))
    opening = asyncio.ensure_future(asyncio.to_thread(zenoh.open, config))
    try:
        session = await asyncio.shield(opening)
    except zenoh.ZError:
        why = await asyncio.to_thread(why_not_reached, locator) or (
            "it is not a Zenoh router, or it lets nobody in without a user"
        )
        text = f"cannot reach the Zenoh router at {url}: {why}"
        raise BridgeClosed(text, why) from None
    except asyncio.CancelledError:
        opening.add_done_callback(_close_late)
        raise
    atexit.register(session.close)  # an open one hangs the end of the process
    try:
        yield session
    finally:
        atexit.unregister(session.close)
        await asyncio.shield(asyncio.to_thread(session.close))


def _close_late(opening: "asyncio.Future[zenoh.Session]") -> None:
    """Close a session that was opened when nobody waited for it any more."""
    if not opening.cancelled() and opening.exception() is None:
        opening.result().close()  # type: ignore[no-untyped-call]


class RouterConnection(BridgeConnection):
    """A session with the router, which offers its topics as a Foxglove server would.

    Args:
        url: The bridge's address: ``zenoh-ros2://host:port/domain``.
        options: The other arguments of ``BridgeConnection``.

    Raises:
        ConfigError: If the address has no valid domain.

    """

    def __init__(self, url: str, **options: Any) -> None:
        super().__init__(url, **options)
        self._domain = domain_of(url)
        self._session: zenoh.Session | None = None
        self._offer = Offer()
        self._readers: dict[int, _Reader] = {}
        """By the ids of the subscriptions."""

    async def _one_link(self) -> float:
        try:
            async with session_with(self.url) as session:
                changes = await asyncio.to_thread(self._tokens, session)
                return await self._serve_topics(session, changes)
        except BridgeClosed as error:
            self._failed(error)
            return 0.0

    def _tokens(self, session: zenoh.Session) -> deque[Change]:
        """Return the tokens of the domain, to which later changes are added.

        Waits for the router.

        Raises:
            BridgeClosed: If there are only tokens of other domains.

        """
        changes: deque[Change] = deque()

        def changed(sample: zenoh.Sample) -> None:  # called in a thread of Zenoh
            came = sample.kind == zenoh.SampleKind.PUT
            changes.append(change_of(str(sample.key_expr), came=came))

        mine = f"{ROOT}/{self._domain}/"
        # A full channel would block the question itself, so every token must fit.
        channel: FifoChannel[zenoh.Reply] = FifoChannel(10 * MOST_ENDPOINTS)
        try:
            session.liveliness().declare_subscriber(
                f"{mine}**", Callback(changed, indirect=False), history=True
            )
            replies = session.liveliness().get(f"{ROOT}/**", channel, timeout=PATIENCE)
            # The router does not repeat tokens that it has sent to the subscriber.
            tokens = [str(each.ok.key_expr) for each in replies if each.ok is not None]
        except zenoh.ZError as error:  # it was closed just now
            why = one_line(error)
            raise BridgeClosed(f"{self.url}: {why}", why) from None
        others = sorted({token.split("/")[1] for token in tokens})
        if others and str(self._domain) not in others and not changes:
            why = (
                f"there is no node in the domain {self._domain}, but in "
                f"{one_line(', '.join(others))}: add the robot's domain at the end of "
                f"the address, such as {SCHEME}://robot/42"
            )
            raise BridgeClosed(f"{self.url}: {why}", why)
        return changes

    async def _serve_topics(
        self, session: zenoh.Session, changes: deque[Change]
    ) -> float:
        """Offer the topics until the connection ends, and return its duration."""
        began, reason = time.monotonic(), CLOSED_HERE
        self.state, self._session, self._offer = "open", session, Offer()
        try:
            self._opened()
            self._deliver(INTRODUCTION)
            while session.info.routers_zid():
                for frame in self._offer.apply(changes):
                    self._deliver(frame)
                there = self._offer.channels
                gone = [k for k, v in self._readers.items() if v.channel not in there]
                self._end_readers(gone)
                await asyncio.sleep(LOOK_PERIOD)
            reason = "the Zenoh router closed it, or does not answer"
        finally:
            self._end_readers(self._readers)
            self.state = "connecting" if self._again else "closed"
            self._session = None
            self._closed(reason)
        return time.monotonic() - began

    def nodes(self, topic: str, *, publish: bool) -> list[str] | None:
        """Return the nodes that publish or read a topic; None without a connection."""
        if self.state != "open":
            return None
        return self._offer.nodes(topic, publish=publish)

    def _deliver(self, frame: bytes | bytearray) -> None:
        self._heard = time.monotonic()
        super()._deliver(frame)

    def _send(self, frame: bytes) -> None:
        """Begin and end subscriptions; nothing else is asked of a robot."""
        asked = msgspec.json.decode(frame)
        for each in asked.get("subscriptions", ()):
            self._readers[each["id"]] = self._read(each["id"], each["channelId"])
        self._end_readers(asked.get("subscriptionIds", ()))

    def _read(self, id: int, channel: int) -> "_Reader":
        assert self._session is not None
        source = self._offer.channels[channel]
        reader = _Reader(id, channel, source.topic, self._deliver)
        handler = Callback(reader.came, indirect=False)
        key = f"{self._domain}/{source.key}"
        try:
            if source.latched:
                kept = ext.HistoryConfig(detect_late_publishers=True)
                reader.subscriber = ext.declare_advanced_subscriber(
                    self._session, key, handler, history=kept
                )
            else:
                reader.subscriber = self._session.declare_subscriber(key, handler)
        except zenoh.ZError as error:  # it was closed just now
            raise BridgeClosed(f"{self.url}: {one_line(error)}") from None
        return reader

    def _end_readers(self, ids: Iterable[int]) -> None:
        for id in list(ids):
            with suppress(zenoh.ZError):  # the session was closed just now
                self._readers.pop(id).subscriber.undeclare()


class _Reader:
    """The messages of a subscription at the router that wait to be delivered.

    Args:
        id: The subscription.
        channel: What is subscribed to.
        topic: The topic.
        deliver: Called with each frame in the model's thread.

    """

    def __init__(
        self, id: int, channel: int, topic: str, deliver: Callable[[bytes], None]
    ) -> None:
        self.channel = channel
        self.subscriber: Any = None
        self._id = id
        self._topic = topic
        self._deliver = deliver
        self._loop = asyncio.get_running_loop()
        self._lock = threading.Lock()
        self._waiting: deque[bytes] = deque()
        self._size = 0
        self._dropped = False

    def came(self, sample: zenoh.Sample) -> None:
        """Keep a message until it is delivered; called in a thread of Zenoh."""
        size = len(sample.payload)
        # Of a message that is too long the size is enough to refuse it.
        payload = sample.payload.to_bytes() if size <= MAX_FRAME else b""
        attachment = sample.attachment.to_bytes() if sample.attachment else b""
        frame = message_frame(self._id, self._topic, payload, size, attachment)
        with self._lock:
            is_first = not self._waiting
            self._waiting.append(frame)
            self._size += len(frame)
            while len(self._waiting) > MOST_WAITING or (
                self._size > MOST_WAITING_BYTES and len(self._waiting) > 1
            ):
                self._size -= len(self._waiting.popleft())
                self._dropped = True
        if is_first and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._deliver_waiting)

    def _deliver_waiting(self) -> None:
        with self._lock:
            waiting, self._waiting, self._size = self._waiting, deque(), 0
            dropped, self._dropped = self._dropped, False
        if dropped:
            self._deliver(error_status(f"{self._topic}: {LOSSY}"))
        for frame in waiting:
            self._deliver(frame)


class _Graph(FoxgloveGraph):
    async def nodes(
        self, kind: Literal["publishers", "subscribers"], topic: str
    ) -> list[str] | None:
        lane = self._main.connection
        assert isinstance(lane, RouterConnection)
        return lane.nodes(topic, publish=kind == "publishers")

    async def set_parameter(self, name: str, value: Any, patience: float) -> Any:
        url = self._main.connection.url
        raise ServiceError(f"{name} cannot be set: WebMap only reads {url}")


class RmwZenohLink(FoxgloveLink):
    """The topics of one domain of a Zenoh router; nothing is published or called.

    Args:
        url: The bridge's address: ``zenoh-ros2://host:port/domain``.
        name: The bridge's name, as shown to people.
        callbacks: Those of the bridge.

    Raises:
        ConfigError: If the address has no valid domain.

    """

    lane_type = RouterConnection
    graph_type = _Graph

    def publish(self, topic: str, *_: Any, **__: Any) -> None:
        """Raise BridgeError: WebMap sends nothing to this robot."""
        raise BridgeError(
            f"{topic} is not published: WebMap only reads {self.lane.url}"
        )

    async def call_service(self, service: str, *_: Any, **__: Any) -> Any:
        """Raise ServiceError: WebMap sends nothing to this robot."""
        raise ServiceError(
            f"{service} is not called: WebMap only reads {self.lane.url}"
        )


LINKS[SCHEME] = RmwZenohLink
