"""Viewers that draw nothing: they receive and acknowledge frames, like a page.

Each also has a socket to the gates, like a page, and sends no commands. The sockets use
little code, so that hundreds of viewers can run in one process.

Run as ``python -m benchmarks.watchers URL COUNT SECONDS [PERIODS [STALLED]]``. Prints
``ready`` when all have received a frame, then ``PERIODS`` lines of JSON, each with the
figures of ``SECONDS`` seconds. ``STALLED`` more viewers read nothing after their first
frame.
"""

import asyncio
import json
import re
import statistics
import struct
import sys
import time
from collections.abc import Callable
from functools import partial
from urllib.parse import urlsplit

import httpx

from benchmarks.harness import percentile
from benchmarks.stamped import Y, age

HEAD = struct.Struct("<HBI")
"""Version, flags and number of a frame."""

NOW = struct.Struct("<d")
"""The clock of the display, after the head of a frame."""

PLACE = re.compile(rb"(....)" + re.escape(struct.pack("<ff", Y, 0.0)), re.DOTALL)
"""x, y and yaw of a robot of ``stamped``."""

TEXT, BINARY, PING, PONG = 1, 2, 9, 10
UNMASKED = bytes(4)
"""A mask that changes nothing, so that messages need no copy."""


class Socket(asyncio.Protocol):
    """A client's end of a WebSocket.

    Args:
        request: The request that opens it.
        take: Called with each binary message.

    """

    def __init__(self, request: bytes, take: Callable[[bytes], None]) -> None:
        self.opened = asyncio.get_running_loop().create_future()
        self.transport: asyncio.Transport
        self._request = request
        self._take = take
        self._data = bytearray()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Send the request."""
        assert isinstance(transport, asyncio.Transport)
        self.transport = transport
        transport.write(self._request)

    def connection_lost(self, exc: Exception | None) -> None:
        """Set the error of the opening if the socket is not open yet."""
        if not self.opened.done():
            self.opened.set_exception(exc or ConnectionError("it was closed"))

    def data_received(self, data: bytes) -> None:
        """Process all complete messages."""
        self._data += data
        if not self.opened.done():
            head, found, rest = self._data.partition(b"\r\n\r\n")
            if not found:
                return
            if not head.startswith(b"HTTP/1.1 101"):
                self.opened.set_exception(ConnectionError(head[:200].decode()))
                return
            self.opened.set_result(None)
            self._data = rest
        at = 0
        while (end := self._message(at)) is not None:
            at = end
        del self._data[:at]

    def _message(self, at: int) -> int | None:
        """Process the message at a place; return its end, None if it is incomplete."""
        data = self._data
        if len(data) < at + 2:
            return None
        kind, size, begin = data[at] & 15, data[at + 1], at + 2
        if size > 125:
            begin += 2 if size == 126 else 8
            if len(data) < begin:
                return None
            size = int.from_bytes(data[at + 2 : begin])
        if len(data) < begin + size:
            return None
        if kind == BINARY:
            self._take(bytes(data[begin : begin + size]))
        elif kind == PING:
            self.send(data[begin : begin + size], PONG)
        return begin + size

    def send(self, payload: bytes | bytearray, kind: int = TEXT) -> None:
        """Send a message."""
        head = bytes((0x80 | kind, 0x80 | len(payload)))
        if len(payload) > 125:
            head = struct.pack(">BBH", 0x80 | kind, 0x80 | 126, len(payload))
        self.transport.write(head + UNMASKED + payload)


class Watcher:
    """One viewer.

    Args:
        name: The name of the viewer and of its page.
        looks: Whether the viewer searches frames for poses of ``stamped``.
        stalls: Whether the viewer reads nothing after its first frame.

    """

    def __init__(self, name: str, *, looks: bool = False, stalls: bool = False) -> None:
        self.first = asyncio.Event()
        self._name = name
        self._looks = looks
        self._stalls = stalls
        self._scene: Socket
        self.forget()

    def forget(self) -> None:
        """Count from now on."""
        self.bytes = self.frames = 0
        self.ages: list[float] = []
        """Milliseconds from the creation of each frame to its arrival."""
        self.poses: list[float] = []
        """Milliseconds from the sending of each pose by its robot to its arrival."""

    async def open(self, url: str) -> None:
        """Open both sockets like a separate browser, with a key if there is a token."""
        # No address uses TLS, and loading certificates for each viewer takes long.
        async with httpx.AsyncClient(
            follow_redirects=True, verify=False, timeout=30.0
        ) as client:
            page = (await client.get(url)).raise_for_status().text
        key = re.search(r'name="webmap-key" content="([^"]+)"', page)
        protocols = f"webmap, {key[1]}" if key else "webmap"
        place = urlsplit(url)
        for path, take in (("scene", self._take), ("drive", _leave)):
            request = (
                f"GET /_webmap/{path}?page=/&id={self._name} HTTP/1.1\r\n"
                f"Host: {place.netloc}\r\nOrigin: http://{place.netloc}\r\n"
                "Connection: Upgrade\r\nUpgrade: websocket\r\n"
                "Sec-WebSocket-Version: 13\r\n"
                "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
                f"Sec-WebSocket-Protocol: {protocols}\r\n\r\n"
            ).encode()
            socket = Socket(request, take)
            await asyncio.get_running_loop().create_connection(
                partial(_same, socket), place.hostname or "", place.port or 0
            )
            await socket.opened
            if path == "scene":
                self._scene = socket
        container = {"webmap_container": [1200, 900]}
        hello = {"op": "hello", "page": self._name, "url": "/"}
        size = {"width": 1200, "height": 900, "containers": container}
        self._scene.send(json.dumps(hello | size).encode())

    def _take(self, frame: bytes) -> None:
        now = time.monotonic()
        self.bytes += len(frame)
        self.frames += 1
        self.ages.append(1000 * (now - NOW.unpack_from(frame, HEAD.size)[0]))
        if self._looks:
            for x in PLACE.findall(frame):
                self.poses.append(1000 * age(struct.unpack("<f", x)[0], now))
        if self._stalls:
            self._scene.transport.pause_reading()
        self._scene.send(b'{"op":"seen","frame":%d}' % HEAD.unpack_from(frame)[2])
        self.first.set()


def _same(socket: Socket) -> Socket:
    return socket


def _leave(_message: bytes) -> None:
    """Ignore a message."""


def figures(watchers: list[Watcher], seconds: float) -> dict[str, float]:
    """Return the data that a viewer received a second, and its age."""
    ages = [each for watcher in watchers for each in watcher.ages]
    poses = [each for watcher in watchers for each in watcher.poses]
    total = len(watchers) * seconds
    return {
        "bytes": sum(watcher.bytes for watcher in watchers) / total,
        "frames": sum(watcher.frames for watcher in watchers) / total,
        "least frames": min(watcher.frames for watcher in watchers) / seconds,
        "frame age, 50": statistics.median(ages or [0.0]),
        "frame age, 99": percentile(ages or [0.0], 99),
        "poses": len(poses) / seconds,
        "pose age, 50": statistics.median(poses or [0.0]),
        "pose age, 99": percentile(poses or [0.0], 99),
    }


async def main(
    url: str, count: int, seconds: float, periods: int = 1, stalled: int = 0
) -> None:
    """Run ``count`` viewers and print the figures of their data."""
    watchers = [Watcher(f"watcher{n:04d}", looks=n == 0) for n in range(count)]
    others = [Watcher(f"stalled{n:04d}", stalls=True) for n in range(stalled)]
    async with asyncio.timeout(max(90, 0.5 * count)):
        for each in (*watchers, *others):
            await each.open(url)
        for each in (*watchers, *others):
            await each.first.wait()
    await asyncio.sleep(1.0)
    print("ready", flush=True)
    for _ in range(periods):
        for watcher in watchers:
            watcher.forget()
        begun = time.monotonic()
        await asyncio.sleep(seconds)
        took = time.monotonic() - begun
        print(json.dumps(figures(watchers, took)), flush=True)


if __name__ == "__main__":
    link, number, length, *more = sys.argv[1:]
    asyncio.run(main(link, int(number), float(length), *map(int, more)))
