"""A kind of link: a robot that sends and reads a line of JSON for each message.

A line is ``{"topic": "/odom", "type": "nav_msgs/Odometry", "msg": {...}}``, over plain
TCP. A program that imports this file can use addresses such as ``lines://robot:7777``.
"""

import asyncio
import json
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, Literal
from urllib.parse import urlsplit

import msgspec

from webmap.base.errors import BridgeClosed, ProtocolError, ServiceError
from webmap.ros.backoff import Backoff
from webmap.ros.bridge import LINKS
from webmap.ros.decoding import check_depth, decode_json
from webmap.ros.definitions import Definitions
from webmap.ros.limits import MAX_FRAME
from webmap.ros.names import DEFAULT_PORTS
from webmap.ros.received_message import BridgeStats, LinkState, ReceivedMessage
from webmap.ros.rosbridge.events import check_count
from webmap.ros.subscriptions import Topic

log = logging.getLogger("webmap.lines")

PORT = 7777
PATIENCE = 5.0
"""Longest time to connect, in seconds."""

LISTENING = 1.0
"""Seconds in which a robot is expected to send each of its topics once."""

MAX_UNSENT = 1 << 20
"""Most bytes that wait to be sent."""


class _Head(msgspec.Struct):
    """What is read of each line: its message is decoded when a listener needs it."""

    topic: str
    type: str


@cache
def _line_with(type: type[msgspec.Struct] | None) -> Any:
    return msgspec.defstruct("Line", [("msg", type or dict[str, Any])])


class LineMessage(ReceivedMessage):
    """One line."""

    is_binary = False

    def check_count(self) -> None:
        """Count the values in the line."""
        check_count(self.frame)

    def _decode(self, type: type[msgspec.Struct] | None) -> Any:
        message = decode_json(self.frame, _line_with(type)).msg
        if type is None:
            check_depth(message)
        return message


class LinesGraph:
    """The topics that the robot has sent; it answers no questions."""

    def __init__(self, listen: Callable[[], Any]) -> None:
        self.types: dict[str, str] = {}
        self._listen = listen

    def known(self, topic: str) -> str | None:
        return self.types.get(topic)

    async def topics(self) -> dict[str, str]:
        await self._listen()
        return dict(self.types)

    async def topic_type(self, topic: str) -> str | None:
        return self.types.get(topic)

    async def service_type(self, service: str) -> str | None:
        return None

    async def nodes(
        self, kind: Literal["publishers", "subscribers"], topic: str
    ) -> list[str] | None:
        return None

    async def definitions(self, type: str, kind: str) -> Definitions:
        raise ServiceError("the robot sends no definitions")

    async def time(self) -> float | None:
        return None

    async def set_parameter(self, name: str, value: Any, patience: float) -> Any:
        raise ServiceError("the robot has no parameters")


class LinesLink:
    """The topics of one robot; its lane is the link itself."""

    def __init__(
        self,
        url: str,
        name: str,
        *,
        opened: Callable[[], None],
        closed: Callable[[str], None],
        received: Callable[[Topic, ReceivedMessage], bool],
        report: Callable[[Exception], None],
    ) -> None:
        self._url, self._name = url, name
        self._opened, self._closed = opened, closed
        self._received, self._report = received, report
        self.lane = self
        self.graph = LinesGraph(self._listen)
        self.stats = BridgeStats()
        self.trouble: str | None = None
        self.over: str | None = None
        self.state: LinkState = "new"
        self.last_heard: float | None = None
        self.lag = 0.0
        self._topics: dict[str, Topic] = {}
        self._published: dict[str, str] = {}
        self._writer: asyncio.StreamWriter | None = None
        self._task: asyncio.Task[None] | None = None

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        if self._task is None:
            self.state = "connecting"
            self._task = loop.create_task(self._run())

    async def stop(self) -> None:
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            await asyncio.wait([task])
        self.state = "closed"

    def refuse_if_over(self) -> None:
        if self.over is not None:
            raise BridgeClosed(self.over)

    def subscribe(self, topic: Topic) -> None:
        self._topics[topic.name] = topic

    def unsubscribe(self, topic: Topic) -> None:
        self._topics.pop(topic.name, None)

    def published_type(self, topic: str) -> str | None:
        return self._published.get(topic)

    def publish(self, topic: str, type: str, message: Mapping[str, Any]) -> None:
        self.refuse_if_over()
        line = json.dumps(
            {"topic": topic, "type": type, "msg": message}, allow_nan=False
        )
        if self._writer is None:
            raise BridgeClosed(f"the connection to {self._url} is not open")
        if self._writer.transport.get_write_buffer_size() > MAX_UNSENT:
            raise BridgeClosed(f"{self._url} accepts no more data")
        self._published[topic] = type
        self._writer.write(line.encode() + b"\n")

    def unadvertise(self, topic: str) -> None:
        self._published.pop(topic, None)

    async def call_service(
        self,
        service: str,
        args: Mapping[str, Any] | Sequence[Any] | None,
        *,
        type: str | None,
        timeout: float,
    ) -> Any:
        raise ServiceError(f"{service} cannot be called: the robot has no services")

    async def _connect(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        parts = urlsplit(self._url)
        host, port = parts.hostname, parts.port or PORT
        try:
            async with asyncio.timeout(PATIENCE):
                return await asyncio.open_connection(host, port, limit=MAX_FRAME)
        except OSError as error:  # also TimeoutError
            why = str(error) or f"no answer within {PATIENCE:g} s"
            closed = BridgeClosed(f"cannot reach {self._url}: {why}")
            closed.why = why
            raise closed from None

    async def _run(self) -> None:
        backoff = Backoff()
        while True:
            began = time.monotonic()
            try:
                reader, writer = await self._connect()
            except BridgeClosed as error:
                if self.trouble is None:  # one line for each outage
                    log.warning("%s", error)
                self.trouble = error.why
                self._report(error)
                await asyncio.sleep(backoff.next())
                continue
            reason = "WebMap closed the connection"
            self._begin(writer)
            try:
                reason = await self._read(reader)
                log.warning("%s: the connection ended: %s", self._name, reason)
            finally:
                self._end(writer, reason)
            await asyncio.sleep(backoff.next(time.monotonic() - began))

    def _begin(self, writer: asyncio.StreamWriter) -> None:
        self._writer, self.state, self.trouble = writer, "open", None
        self.stats.links += 1
        log.info("%s: the connection is open", self._name)
        for topic in list(self._topics.values()):
            topic.begin_anew()
        self._opened()

    def _end(self, writer: asyncio.StreamWriter, reason: str) -> None:
        writer.close()
        self._writer, self.state, self.trouble = None, "connecting", reason
        self._closed(reason)

    async def _read(self, reader: asyncio.StreamReader) -> str:
        """Pass on all messages; return why no more come."""
        try:
            async for line in reader:
                self.last_heard = time.monotonic()
                self.stats.frames += 1
                self.stats.bytes += len(line)
                name = self._topic_of(line)
                if name in self._topics:
                    self._received(self._topics[name], LineMessage(name, line))
        except (OSError, ValueError) as error:  # ValueError: a line is too long
            return str(error)
        return "the robot closed it"

    def _topic_of(self, line: bytes) -> str:
        """Return the topic of a line; empty if the line is invalid."""
        try:
            head: _Head = decode_json(line, _Head)
        except ProtocolError as error:
            if self.stats.malformed == 0:
                log.warning("%s sent a line without a message: %s", self._name, error)
                self._report(error)
            self.stats.malformed += 1
            return ""
        self.graph.types[head.topic] = head.type
        return head.topic

    async def _listen(self) -> None:
        """Listen to all topics, over a connection of its own."""
        reader, writer = await self._connect()
        try:
            async with asyncio.timeout(LISTENING):
                async for line in reader:
                    self._topic_of(line)
        except (OSError, ValueError):  # also TimeoutError: the time is over
            pass
        finally:
            writer.close()


LINKS["lines"] = LinesLink
DEFAULT_PORTS["lines"] = PORT
