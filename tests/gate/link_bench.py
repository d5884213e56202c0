"""Bridges in the event loop of a test: a real bridge, and one that sends any bytes."""

import asyncio
import base64
import contextlib
import functools
import gc
import hashlib
import inspect
import time
import warnings
from dataclasses import dataclass, field

from bridge_notes import BridgeMessage, Noting

from webmap.gate.lanes.lane import Lane
from webmap.gate.lanes.sockets import SocketHandlers
from webmap.testing.witness import WitnessBridge


def in_loop(test):
    """Run an async test in an event loop of its own."""

    @functools.wraps(test)
    def run(*args, **kwargs):
        with warnings.catch_warnings():
            # asyncio drops a socket that has just connected when the attempt is
            # cancelled: a lane that closes while it connects does this.
            warnings.simplefilter("ignore", ResourceWarning)
            asyncio.run(test(*args, **kwargs))
            gc.collect()

    run.__signature__ = inspect.signature(test)
    return run


class NotingBridge(Noting, WitnessBridge):
    """The witness's rosbridge, which also records the received messages."""

    def __init__(self):
        self.received = []
        super().__init__(self._note)

    def _note(self, link, message):
        self.received.append(BridgeMessage(time.monotonic(), link, message))

    @property
    def url(self):
        return f"ws://127.0.0.1:{self.port}"

    @property
    def links(self):
        """The numbers of the links that are open now."""
        return set(self._sockets)

    async def send(self, link, text):
        await self._sockets[link].connection.send(text)

    def transport_of(self, link):
        return self._sockets[link].connection.transport


@contextlib.asynccontextmanager
async def noting_bridge():
    bridge = NotingBridge()
    await bridge.start()
    try:
        yield bridge
    finally:
        await bridge.stop()


class RawLink:
    """One link of a :class:`RawBridge`: bytes in, bytes out."""

    def __init__(self, reader, writer):
        self.reader = reader
        self.writer = writer

    async def request(self):
        """Read the request for a WebSocket and return the response that accepts it."""
        request = await self.reader.readuntil(b"\r\n\r\n")
        lines = request.decode().split("\r\n")
        key = next(
            line.split(":")[1].strip()
            for line in lines
            if "sec-websocket-key" in line or "Sec-WebSocket-Key" in line
        )
        magic = key.encode() + b"258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
        accept = base64.b64encode(hashlib.sha1(magic).digest())
        return (
            b"HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\n"
            b"Connection: Upgrade\r\nSec-WebSocket-Accept: " + accept + b"\r\n\r\n"
        )

    async def accept(self, and_then=b""):
        """Accept the request, and send bytes in the same write."""
        self.send(await self.request() + and_then)

    def send(self, data):
        self.writer.write(data)


@contextlib.asynccontextmanager
async def raw_bridge(talk):
    """Serve with ``talk(link)`` for each link; yield the address."""
    writers, talks = [], []
    closed = False

    async def serve(link):
        with contextlib.suppress(ConnectionError, asyncio.IncompleteReadError):
            await talk(link)

    def take(reader, writer):
        writers.append(writer)
        if closed:  # a link that was already accepted when the server closed
            writer.transport.abort()
            return
        talks.append(asyncio.create_task(serve(RawLink(reader, writer))))

    server = await asyncio.start_server(take, "127.0.0.1", 0)
    try:
        yield f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}"
    finally:
        closed = True
        server.close()
        for task in talks:
            task.cancel()
        for writer in writers:
            writer.transport.abort()
        await asyncio.gather(*talks, return_exceptions=True)
        await asyncio.sleep(0.01)  # until links that were just accepted are here
        closing = (writer.wait_closed() for writer in writers)
        await asyncio.gather(*closing, return_exceptions=True)


def frame(opcode, body=b"", *, final=True):
    """Return a WebSocket frame of a server."""
    assert len(body) < 126
    return bytes([opcode | 0x80 * final, len(body)]) + body


TEXT, MORE, CLOSE, PING, PONG = 1, 0, 8, 9, 10
"""Kinds of frames."""


@dataclass
class Received:
    """Records the messages of a socket."""

    texts: list[bytes] = field(default_factory=list)
    pongs: list[bytes] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)

    @property
    def handlers(self):
        return SocketHandlers(self.texts.append, self.pongs.append, self.lost.append)


@contextlib.contextmanager
def noting_lane(url, happened, **more):
    """A lane that records its events."""
    lane = Lane(
        url,
        up=lambda: happened.append("up"),
        down=lambda: happened.append("down"),
        text=lambda data: happened.append(data),
        **more,
    )
    try:
        yield lane
    finally:
        lane.close()
