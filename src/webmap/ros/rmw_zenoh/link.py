"""The connection of a bridge to the Zenoh router of a robot with rmw_zenoh.

WebMap is a client of the router: it reads the tokens of the nodes and subscribes to
topics. It publishes nothing, calls no service, and announces no node.
"""

import asyncio
import atexit
import json
import logging
import threading
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import Any, Unpack
from urllib.parse import urlsplit

from webmap.base.errors import BridgeClosed, BridgeError, ConfigError, ServiceError
from webmap.base.text import one_line
from webmap.ros.bridge import LINKS
from webmap.ros.limits import MAX_FRAME
from webmap.ros.link import LinkCallbacks, ReconnectingLink
from webmap.ros.names import DEFAULT_PORTS, same_type
from webmap.ros.rmw_zenoh.graph import MOST_ENDPOINTS, ROOT, RmwZenohGraph
from webmap.ros.rmw_zenoh.messages import Sample, message_of, refusal_of
from webmap.ros.sockets.connection import (
    CLOSED_HERE,
    CONNECT_TIMEOUT,
    LOOK_PERIOD,
    BridgeConnection,
    why_not_reached,
)
from webmap.ros.subscriptions import Topic

try:
    import zenoh
    from zenoh import ext
    from zenoh.handlers import Callback, FifoChannel
except ImportError:
    raise ConfigError(
        "zenoh-ros2:// needs Zenoh, which is not installed: pip install 'webmap[fleet]'"
    ) from None

log = logging.getLogger("webmap.ros")

SCHEME = "zenoh-ros2"

PATIENCE = 4.0
"""Longest wait for the tokens, in seconds."""

MOST_WAITING = 1_000
"""Messages of one topic that wait at most to be read; then the oldest are dropped."""

MOST_WAITING_BYTES = 8 << 20
"""The same in bytes, besides the newest message."""

MOST_PUBLISHERS = 64
"""Publishers of one topic among which a readable one is searched."""

LOSSY = "messages come faster than they are read; the oldest were left out"

MOST_COMPLAINTS = 50
"""Different faults that are reported of one connection."""


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


async def open_session(url: str) -> zenoh.Session:
    """Open a session with the router of an address.

    Raises:
        BridgeClosed: If that fails; with the reason.

    """
    parts, port = urlsplit(url), urlsplit(url).port or DEFAULT_PORTS[SCHEME]
    host = parts.netloc.removesuffix(f":{port}")
    place = {"endpoints": [f"tcp/{host}:{port}"], "timeout_ms": 0}
    settings = {
        "mode": "client",
        "connect": {**place, "exit_on_failure": True},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": {
            "shared_memory": {"enabled": False},
            "unicast": {"open_timeout": int(CONNECT_TIMEOUT * 1000)},
            "link": {"rx": {"max_message_size": 4 * MAX_FRAME}},
        },
    }
    config = zenoh.Config.from_json5(json.dumps(settings))
    opening = asyncio.ensure_future(asyncio.to_thread(zenoh.open, config))
    try:
        session = await asyncio.shield(opening)
    except zenoh.ZError:
        why = await _why_not_opened(parts.hostname, port)
        text = f"cannot reach the Zenoh router at {url}: {why}"
        raise BridgeClosed(text, why) from None
    except asyncio.CancelledError:
        opening.add_done_callback(_close_late)
        raise
    atexit.register(session.close)  # an open one hangs the end of the process
    return session


async def _why_not_opened(host: str | None, port: int) -> str:
    try:
        async with asyncio.timeout(CONNECT_TIMEOUT):
            _, writer = await asyncio.open_connection(host, port)
    except (OSError, UnicodeError) as error:
        return why_not_reached(error)
    writer.close()
    return "what listens there is no Zenoh router, or lets nobody in without a user"


def _close_late(opening: "asyncio.Future[zenoh.Session]") -> None:
    """Close a session that was opened when nobody waited for it any more."""
    if not opening.cancelled() and opening.exception() is None:
        opening.result().close()  # type: ignore[no-untyped-call]


async def close_session(session: zenoh.Session) -> None:
    """Close a session, also while this task is cancelled."""
    atexit.unregister(session.close)
    await asyncio.shield(asyncio.to_thread(session.close))


class _RouterConnection(BridgeConnection):
    """A session with the router, kept open; its callbacks are those of the base."""

    session: zenoh.Session | None = None

    async def _one_link(self) -> float:
        try:
            session = await open_session(self.url)
        except BridgeClosed as error:
            self._failed(error)
            return 0.0
        began, reason = time.monotonic(), CLOSED_HERE
        try:
            self.state, self.session = "open", session
            self._opened()
            is_there = True
            while is_there:
                await asyncio.sleep(LOOK_PERIOD)
                is_there = bool(session.info.routers_zid())
            reason = "the Zenoh router closed it, or does not answer"
        finally:
            self.state, self.session = "connecting", None
            self._closed(reason)
            await close_session(session)
        return time.monotonic() - began

    def heard(self) -> None:
        """Note that the router sent something."""
        self._heard = time.monotonic()


class _Reader:
    """The subscription to a key at the router, and the messages that wait.

    Args:
        session: The session with the router.
        key: The key of the messages.
        latched: Whether publishers have kept messages, which are asked for.
        take: Called with each message in the model's thread.
        lossy: Called there when messages were dropped.

    """

    def __init__(
        self,
        session: zenoh.Session,
        key: str,
        latched: bool,
        take: Callable[[Sample], None],
        lossy: Callable[[], None],
    ) -> None:
        self.key, self.latched = key, latched
        self._take, self._lossy = take, lossy
        self._loop = asyncio.get_running_loop()
        self._lock = threading.Lock()
        self._waiting: deque[Sample] = deque()
        self._size = 0
        self._dropped = self._ended = False
        handler = Callback(self._came, indirect=False)
        kept = ext.HistoryConfig(detect_late_publishers=True)
        self._subscriber: Any = (
            ext.declare_advanced_subscriber(session, key, handler, history=kept)
            if latched
            else session.declare_subscriber(key, handler)
        )

    def _came(self, sample: zenoh.Sample) -> None:
        """Keep a message until it is read; called in a thread of Zenoh."""
        size = len(sample.payload)
        # Of a message that is too long the size is enough to refuse it.
        payload = sample.payload.to_bytes() if size <= MAX_FRAME else b""
        attachment = sample.attachment.to_bytes() if sample.attachment else b""
        with self._lock:
            is_first = not self._waiting
            self._waiting.append(Sample(payload, size, attachment))
            self._size += len(payload)
            while len(self._waiting) > MOST_WAITING or (
                self._size > MOST_WAITING_BYTES and len(self._waiting) > 1
            ):
                self._size -= len(self._waiting.popleft().payload)
                self._dropped = True
        if is_first and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._read)

    def _read(self) -> None:
        with self._lock:
            waiting, self._waiting, self._size = self._waiting, deque(), 0
            dropped, self._dropped = self._dropped, False
        if dropped:
            self._lossy()
        for sample in waiting:
            if self._ended:
                return
            try:
                self._take(sample)
            except Exception:
                log.exception("a message on %s was lost", self.key)

    def end(self) -> None:
        """End the subscription, and forget what waits."""
        self._ended = True
        self._subscriber.undeclare()


class RmwZenohLink(ReconnectingLink):
    """The topics of one domain of a Zenoh router; reconnects after each loss.

    Args:
        url: The bridge's address: ``zenoh-ros2://host:port/domain``.
        name: The bridge's name, as shown to people.
        callbacks: Those of the bridge.

    Raises:
        ConfigError: If the address has no valid domain, or Zenoh is not installed.

    """

    def __init__(self, url: str, name: str, **callbacks: Unpack[LinkCallbacks]) -> None:
        super().__init__(name, **callbacks)
        self._url, self._domain = url, domain_of(url)
        self.lane = _RouterConnection(
            url,
            opened=self._opened,
            received=lambda _frame: None,
            closed=self._lost,
            failed=self._not_opened,
        )
        self.graph = RmwZenohGraph(url, self._ask)
        self._topics: dict[str, Topic] = {}
        self._readers: dict[str, _Reader] = {}
        self._complaints: set[str] = set()

    async def stop(self) -> None:
        """Close the connection; keep the subscriptions for another start."""
        await self.lane.stop()

    def subscribe(self, topic: Topic) -> None:
        """Subscribe to a topic, now or when a node announces it."""
        self._topics[topic.name] = topic
        self._attach(topic.name)

    def unsubscribe(self, topic: Topic) -> None:
        """End the subscription to a topic."""
        self._topics.pop(topic.name, None)
        self._detach(topic.name)

    def published_type(self, topic: str) -> str | None:
        """Return None: nothing is published."""
        return None

    def publish(self, topic: str, *_: Any, **__: Any) -> None:
        """Raise BridgeError: WebMap sends nothing to this robot."""
        raise BridgeError(f"{topic} is not published: WebMap only reads {self._url}")

    def unadvertise(self, topic: str) -> None:
        """Do nothing: nothing is published."""

    async def call_service(self, service: str, *_: Any, **__: Any) -> Any:
        """Raise ServiceError: WebMap sends nothing to this robot."""
        raise ServiceError(f"{service} is not called: WebMap only reads {self._url}")

    # The connection.

    def _opened(self) -> None:
        super()._opened()
        session, loop = self.lane.session, asyncio.get_running_loop()
        assert session is not None

        def changed(sample: zenoh.Sample) -> None:  # called in a thread of Zenoh
            token, is_there = str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT
            if not loop.is_closed():
                loop.call_soon_threadsafe(self._changed, session, token, is_there)

        session.liveliness().declare_subscriber(
            f"{ROOT}/{self._domain}/**", Callback(changed, indirect=False), history=True
        )
        for topic in list(self._topics.values()):
            topic.begin_anew()
        self._on_open()

    def _lost(self, reason: str) -> None:
        for name in list(self._readers):
            self._detach(name)
        self.graph.clear()
        self._complaints.clear()
        super()._lost(reason)
        self._on_close(reason)

    async def _ask(self) -> list[str]:
        """Return the tokens of the domain, also without an open connection."""
        open_now = self.lane.session
        session = open_now or await open_session(self._url)
        try:
            return await asyncio.to_thread(self._tokens, session)
        except zenoh.ZError as error:  # it was closed just now
            raise BridgeClosed(f"{self._url}: {one_line(error)}") from None
        finally:
            if open_now is None:
                await close_session(session)

    def _tokens(self, session: zenoh.Session) -> list[str]:
        """Return the tokens of the domain; waits for the router."""
        # A full channel would block the question itself, so every token must fit.
        channel: FifoChannel[zenoh.Reply] = FifoChannel(10 * MOST_ENDPOINTS)
        replies = session.liveliness().get(f"{ROOT}/**", channel, timeout=PATIENCE)
        tokens = [str(each.ok.key_expr) for each in replies if each.ok is not None]
        found = [t for t in tokens if t.startswith(f"{ROOT}/{self._domain}/")]
        if tokens and not found:
            others = sorted({token.split("/")[1] for token in tokens})
            raise ServiceError(
                f"{self._url}: there is no node in the domain {self._domain}, but in "
                f"{one_line(', '.join(others))}: the robot's domain belongs at the end "
                "of the address, after a /"
            )
        return found

    # Topics.

    def _changed(self, session: zenoh.Session, token: str, is_there: bool) -> None:
        if session is not self.lane.session:
            return  # it was on its way when the connection ended
        self.lane.heard()
        if not is_there:
            self.graph.remove(token)
            return
        try:
            topic = self.graph.add(token)
        except BridgeError as error:
            self.stats.malformed += 1
            self._complain(str(error))
            return
        if topic is not None:
            self._attach(topic)

    def _attach(self, name: str) -> None:
        """Read the first publisher of a wanted topic that can be read; report others.

        Publishers of the same type are read together, as one key.
        """
        topic, session = self._topics.get(name), self.lane.session
        if topic is None or session is None:
            return
        stated, refused, readable = topic.message_type, "", []
        for each in self.graph.endpoints("publishers", name)[:MOST_PUBLISHERS]:
            if stated is not None and not same_type(stated, each.type):
                continue
            why = refusal_of(each.type, each.hash)
            if why is None:
                readable.append(each)
            else:
                refused = f"{name} is not read from {one_line(each.node)}: {why}"
                self._complain(refused)
        if not readable:
            if refused:
                topic.over(BridgeError(refused))
            return
        type, key = readable[0].type, f"{self._domain}/{readable[0].key}"
        latched = any(each.latched for each in readable if each.type == type)
        reader = self._readers.get(name)
        if reader is not None and (reader.key, reader.latched) == (key, latched):
            return
        self._detach(name)
        topic.begin_anew()
        take, lossy = partial(self._take, topic, type), f"{name}: {LOSSY}"
        self._readers[name] = _Reader(
            session, key, latched, take, partial(self._complain, lossy)
        )

    def _detach(self, name: str) -> None:
        reader = self._readers.pop(name, None)
        if reader is not None:
            reader.end()

    def _take(self, topic: Topic, type: str, sample: Sample) -> None:
        self.stats.frames += 1
        self.stats.bytes += sample.size
        self.lane.heard()
        try:
            message, stamp = message_of(topic, type, sample)
        except BridgeError as error:
            self.stats.malformed += 1
            self._complain(str(error))
            topic.over(error)
            return
        self.graph.stamp = (stamp, time.monotonic())
        self._on_message(topic, message)

    def _complain(self, text: str) -> None:
        """Report a fault, once for each connection."""
        if text in self._complaints or len(self._complaints) >= MOST_COMPLAINTS:
            return
        self._complaints.add(text)
        log.warning("%s: %s", self._name, text)
        self._report(BridgeError(f"{self._name}: {text}"))


LINKS[SCHEME] = RmwZenohLink
