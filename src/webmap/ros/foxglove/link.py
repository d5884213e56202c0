"""The connections of a bridge to a Foxglove server, such as ``foxglove_bridge``.

There are three: one for most topics, one for large ones, which would delay the others,
and one for calls of services, which the server handles before anything that comes after
them. The last two are opened when they are needed.
"""

import asyncio
import itertools
import logging
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Unpack

from msgspec.structs import replace

from webmap.base.errors import BridgeClosed, BridgeError, ConfigError
from webmap.ros.bridge import LINKS
from webmap.ros.foxglove import protocol
from webmap.ros.foxglove.calls import Calls
from webmap.ros.foxglove.graph import FoxgloveGraph
from webmap.ros.foxglove.messages import Format, format_of, included_text, own_channel
from webmap.ros.foxglove.session import Session
from webmap.ros.limits import LIMITS
from webmap.ros.link import PATIENCE, LinkCallbacks, ReconnectingLink
from webmap.ros.names import VIDEO, is_type
from webmap.ros.sockets.connection import BridgeConnection
from webmap.ros.subscriptions import Topic

log = logging.getLogger("webmap.ros")


@dataclass(slots=True)
class _Published:
    """A topic of this client."""

    id: int
    type: str
    format: Format | None = None
    """The format on this connection, where it was advertised."""


def _is_large(type: str) -> bool:
    return is_type(type, *LIMITS, *VIDEO)


class FoxgloveLink(ReconnectingLink):
    """Topics and services over a Foxglove server; reconnects after each loss.

    The server sends every message of a topic: it has no throttle. The bridge decodes
    only those that a listener needs.

    Args:
        url: The bridge's address.
        name: The bridge's name, as shown to people.
        callbacks: Those of the bridge.

    """

    lane_type: type[BridgeConnection] = BridgeConnection
    """The kind of its connections."""
    graph_type: type[FoxgloveGraph] = FoxgloveGraph
    """The kind of its graph."""

    def __init__(self, url: str, name: str, **callbacks: Unpack[LinkCallbacks]) -> None:
        super().__init__(name, **callbacks)
        self._timer: asyncio.TimerHandle | None = None
        """When the server must have introduced itself."""
        self._published: dict[str, _Published] = {}
        self._ids = itertools.count(1)
        session = partial(Session, url, stats=self.stats, lane_type=self.lane_type)
        self._main = session(
            name,
            opened=self._opened,
            informed=self._informed,
            closed=self._lost,
            failed=self._not_opened,
            received=self._on_message,
            report=self._report,
            carries=lambda type: not _is_large(type),
            elsewhere=self._open_large,
        )
        self._large = session(
            f"{name}, large topics",
            opened=self._large_opened,
            closed=lambda _reason: self._large_lost(),
            received=self._on_message,
            report=self._report,
            carries=_is_large,
        )
        self._calls = Calls(partial(session, f"{name}, calls", again=False))
        self.graph = self.graph_type(self._main, self._calls)

    @property
    def lane(self) -> BridgeConnection:
        """The connection for most topics."""
        return self._main.connection

    async def stop(self) -> None:
        """Close every socket; keep the subscriptions for another start."""
        await self._main.connection.stop()
        await self._large.connection.stop()
        await self._calls.stop()

    def subscribe(self, topic: Topic) -> None:
        """Subscribe to a topic as its listeners need it now."""
        self._large.subscribe(topic)
        self._main.subscribe(topic)

    def unsubscribe(self, topic: Topic) -> None:
        """End the subscription to a topic."""
        self._main.unsubscribe(topic)
        self._large.unsubscribe(topic)

    def published_type(self, topic: str) -> str | None:
        """Return the type with which ``topic`` is published here, None if it is not."""
        published = self._published.get(topic)
        return None if published is None else published.type

    def publish(self, topic: str, type: str, message: Mapping[str, Any]) -> None:
        """Publish a message now, or raise an error; the topic is advertised first.

        Raises:
            BridgeClosed: If the connection is not open.
            BridgeError: If the bridge accepts no such message.
            ValueError: If the message does not fit its type.

        """
        self.refuse_if_over()
        info = self._main.info
        if info is None:
            raise BridgeClosed(f"the connection to {self.lane.url} is not open")
        published = self._published.get(topic) or _Published(next(self._ids), type)
        format = published.format or self._advertise(topic, published)
        payload = format.write(message)
        self._published[topic] = published
        self._main.send(protocol.message(published.id, payload))

    def _advertise(self, topic: str, published: _Published) -> Format:
        """Advertise a topic of this client; return the format of its messages."""
        info = self._main.info
        assert info is not None
        if "clientPublish" not in info.capabilities:
            raise BridgeError(
                f"{self._name}: {topic} cannot be published, since the bridge accepts "
                "no messages of clients: its parameter capabilities lacks clientPublish"
            )
        try:
            channel = own_channel(
                published.id, topic, published.type, info.supported_encodings or []
            )
            known = self._main.channel_with(published.type)
            if known is not None and known.encoding == channel.encoding:
                language, text = known.schema_encoding, known.schema
            else:
                language = channel.schema_encoding
                text = included_text(published.type, ros2=channel.encoding == "cdr")
        except ConfigError as error:
            raise BridgeError(
                f"{self._name}: {topic} cannot be published: {error}"
            ) from None
        format = format_of(channel.schema_name, channel.encoding, language, text)
        channel = replace(channel, schema=text, schema_encoding=language)
        self._main.send(protocol.advertise([channel]))
        published.format = format
        return format

    def unadvertise(self, topic: str) -> None:
        """Stop publishing on ``topic``; no effect if it was not advertised."""
        published = self._published.pop(topic, None)
        if published is None or published.format is None:
            return
        try:
            self._main.send(protocol.unadvertise([published.id]))
        except BridgeError as error:
            self._report(error)

    def _opened(self) -> None:
        super()._opened()
        for topic in list(self._main.topics.values()):
            topic.begin_anew()
        loop = asyncio.get_running_loop()
        self._forget_timer()
        self._timer = loop.call_later(PATIENCE, self._not_informed)

    def _not_informed(self) -> None:
        error = BridgeError(
            f"{self._name}: the bridge accepted the connection and did not introduce "
            f"itself within {PATIENCE:g} s"
        )
        log.warning("%s", error)
        self._report(error)

    def _forget_timer(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _informed(self) -> None:
        """Advertise again, and report the connection as open: it can be used now."""
        self._forget_timer()
        for topic, published in self._published.items():
            published.format = None
            try:
                self._advertise(topic, published)
            except BridgeError as error:
                self._report(error)
        self._on_open()

    def _lost(self, reason: str) -> None:
        super()._lost(reason)
        self._forget_timer()
        for published in self._published.values():
            published.format = None
        self._on_close(reason)

    def _open_large(self) -> None:
        """Open the connection for large topics; no effect if it is open already."""
        self._large.connection.start(asyncio.get_running_loop())

    def _large_opened(self) -> None:
        for topic in self._large_topics():
            topic.begin_anew()

    def _large_lost(self) -> None:
        for topic in self._large_topics():
            topic.link_lost()

    def _large_topics(self) -> list[Topic]:
        return [
            topic
            for name, topic in self._large.topics.items()
            if (type := self.graph.known(name)) is not None and _is_large(type)
        ]


for scheme in ("foxglove", "foxgloves"):
    LINKS[scheme] = FoxgloveLink
