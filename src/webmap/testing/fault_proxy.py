"""A TCP proxy on the loopback address that imitates network faults."""

import asyncio
import contextlib
import random
import socket
import struct
from collections import deque
from dataclasses import dataclass
from typing import Literal
from weakref import WeakSet

from webmap.base.tasks import LoopThread

Way = Literal["up", "down", "both"]
"""``up``: from the client to the server behind the proxy; ``down``: the opposite."""

# Linger 0: closing drops unsent bytes and resets the connection.
_LINGER = struct.pack("ii", 1, 0)

Stream = tuple[asyncio.StreamReader, asyncio.StreamWriter]


@dataclass(frozen=True, slots=True)
class Shape:
    """The properties of one direction of a link."""

    latency: float = 0.0
    """Seconds by which every byte is delayed."""

    jitter: float = 0.0
    """Most seconds that are added to the latency at random, in order."""

    bandwidth: float | None = None
    """Bytes a second; None for no limit."""

    slice_size: int | None = None
    """Bytes of the pieces into which a write is cut; None for no cutting."""

    slice_gap: float = 0.0
    """Seconds between two pieces of one write."""

    def __post_init__(self) -> None:
        for name in ("latency", "jitter", "slice_gap"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} must be 0 or more, got {getattr(self, name)}")
        for name in ("bandwidth", "slice_size"):
            if getattr(self, name) is not None and getattr(self, name) <= 0:
                raise ValueError(f"{name} must be above 0, got {getattr(self, name)}")


class Shaper:
    """Computes when each byte of one direction is due; never out of order.

    Args:
        shape: The properties of the link; may be changed at any time.
        seed: Seed of the jitter.

    """

    def __init__(self, shape: Shape | None = None, seed: int = 1) -> None:
        self.shape = shape or Shape()
        self._random = random.Random(seed)  # noqa: S311 - a fault, not a secret
        self._due = float("-inf")
        self._free_at = float("-inf")

    def take(self, data: bytes, now: float) -> list[tuple[float, bytes]]:
        """Return the pieces of data received at ``now``, each with its due time."""
        pieces = []
        for number, piece in enumerate(self._cut(data)):
            begun = now + number * self.shape.slice_gap
            pieces.append((self._when(len(piece), begun), piece))
        return pieces

    def _cut(self, data: bytes) -> list[bytes]:
        size = self.shape.slice_size or max(len(data), 1)
        return [data[at : at + size] for at in range(0, len(data), size)]

    def _when(self, size: int, now: float) -> float:
        shape = self.shape
        if shape.bandwidth is not None:
            now = self._free_at = max(self._free_at, now) + size / shape.bandwidth
        due = now + shape.latency + shape.jitter * self._random.random()
        self._due = max(self._due, due)
        return self._due


class Direction:
    """The state of one direction, for all links."""

    def __init__(self, seed: int) -> None:
        self.shape = Shape()
        self.seed = seed
        self.flowing = asyncio.Event()
        self.flowing.set()


class FaultProxy:
    """Passes bytes on, and holds, delays, cuts or resets them on request.

    It runs in its own thread and is a context manager, so a test may block. The kernel
    chooses the port, ``proxy.port``.

    Args:
        port: The port of the server behind it, on the loopback address.

    """

    def __init__(self, port: int) -> None:
        self.target = port
        self._thread = LoopThread("fault-proxy")
        self._links: dict[_Link, None] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        # Weak, because a client that reconnects for days leaves thousands behind.
        self._writers: WeakSet[asyncio.StreamWriter] = WeakSet()
        self._refusing = False
        self._directions, self._server, self.port = self._thread.call(self._listen())

    def __enter__(self) -> "FaultProxy":
        return self

    def __exit__(self, *exception: object) -> None:
        self.end()

    def end(self) -> None:
        """Drop every link and stop listening."""

        async def end() -> None:
            self._server.close()
            await asyncio.sleep(0.01)  # for connections that were accepted just now
            for link in list(self._links):
                link.reset()
            for writer in list(self._writers):
                writer.transport.abort()
            await asyncio.sleep(0.01)

        self._thread.call(end())
        self._thread.end()

    async def _listen(
        self,
    ) -> tuple[dict[str, Direction], asyncio.Server, int]:
        directions = {"up": Direction(1), "down": Direction(2)}
        server = await asyncio.start_server(self._accept, "127.0.0.1", 0)
        return directions, server, server.sockets[0].getsockname()[1]

    def _choose(self, way: Way) -> list[Direction]:
        return [
            each for name, each in self._directions.items() if way in (name, "both")
        ]

    # Faults; each takes effect before the call returns.

    def shape(self, shape: Shape, way: Way = "both") -> None:
        """Delay, slow down or cut up all data from now on."""

        def change() -> None:
            for direction in self._choose(way):
                direction.shape = shape

        self._thread.do(change)

    def hold(self, way: Way = "both") -> None:
        """Hold all bytes without losing any: the link looks alive."""

        def hold() -> None:
            for direction in self._choose(way):
                direction.flowing.clear()

        self._thread.do(hold)

    def release(self, way: Way = "both") -> None:
        """Pass on all held bytes at once, as TCP does after a stall."""

        def release() -> None:
            for direction in self._choose(way):
                direction.flowing.set()

        self._thread.do(release)

    def hold_link(self, number: int) -> None:
        """Hold all bytes of one link.

        Args:
            number: Its place among the links, in the order in which they were opened.

        """
        self._thread.do(lambda: list(self._links)[number].flowing.clear())

    def release_link(self, number: int) -> None:
        """Pass on all bytes that :meth:`hold_link` has held."""
        self._thread.do(lambda: list(self._links)[number].flowing.set())

    def reset(self) -> None:
        """Reset every link (RST) at both ends; new ones are accepted."""

        def reset() -> None:
            for link in list(self._links):
                link.reset()

        self._thread.do(reset)

    def half_close(self, way: Literal["up", "down"]) -> None:
        """Close one direction of every link cleanly; the other continues."""

        def close() -> None:
            for link in list(self._links):
                link.half_close(way)

        self._thread.do(close)

    def refuse(self, refusing: bool = True) -> None:
        """Reset every new link from now on, or accept them again."""
        self._refusing = refusing

    @property
    def links(self) -> int:
        """Number of links through the proxy now."""
        return len(self._links)

    def _accept(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        self._writers.add(writer)
        task = asyncio.get_running_loop().create_task(self._serve(reader, writer))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _serve(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        try:
            if self._refusing:
                raise ConnectionRefusedError
            far = await asyncio.open_connection("127.0.0.1", self.target)
        except (OSError, asyncio.CancelledError):
            _reset(writer)
            return
        self._writers.add(far[1])
        link = _Link((reader, writer), far, self._directions)
        self._links[link] = None
        try:
            await link.run()
        finally:
            self._links.pop(link, None)


class _Link:
    """One connection through the proxy."""

    def __init__(
        self, near: Stream, far: Stream, directions: dict[str, Direction]
    ) -> None:
        self._task = asyncio.current_task()
        self.flowing = asyncio.Event()
        self.flowing.set()
        self._writers = [near[1], far[1]]
        self._pumps = {
            "up": _Pump(near[0], far[1], directions["up"], self.flowing),
            "down": _Pump(far[0], near[1], directions["down"], self.flowing),
        }

    async def run(self) -> None:
        """Pass bytes on until both directions have ended, or one has failed."""
        try:
            async with asyncio.TaskGroup() as group:
                for pump in self._pumps.values():
                    group.create_task(pump.read())
                    group.create_task(pump.write())
        except* OSError:
            for writer in self._writers:
                _reset(writer)
        finally:
            for writer in self._writers:
                writer.close()

    def reset(self) -> None:
        for writer in self._writers:
            _reset(writer)
        if self._task is not None:
            self._task.cancel()  # it may wait for a held link

    def half_close(self, way: str) -> None:
        self._pumps[way].finish()


class _Pump:
    """One direction of one connection."""

    def __init__(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        direction: Direction,
        flowing: asyncio.Event,
    ) -> None:
        self._flowing = flowing
        self._reader = reader
        self._writer = writer
        self._direction = direction
        self._shaper = Shaper(seed=direction.seed)
        self._waiting: deque[tuple[float, bytes]] = deque()
        self._more = asyncio.Event()
        self._ended = False

    def finish(self) -> None:
        """End this direction and drop its remaining bytes."""
        self._ended = True
        self._waiting.clear()
        self._more.set()

    async def read(self) -> None:
        loop = asyncio.get_running_loop()
        while data := await self._reader.read(1 << 16):
            if self._ended:
                continue
            self._shaper.shape = self._direction.shape
            self._waiting.extend(self._shaper.take(data, loop.time()))
            self._more.set()
            # A held link stops reading too, so that the sender's buffers fill.
            await self._flow()
        self._ended = True
        self._more.set()

    async def _flow(self) -> None:
        """Wait until neither the direction nor the link is held."""
        while not (self._direction.flowing.is_set() and self._flowing.is_set()):
            await self._direction.flowing.wait()
            await self._flowing.wait()

    async def write(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            while not self._waiting:
                if self._ended:
                    with contextlib.suppress(OSError):
                        self._writer.write_eof()
                    return
                self._more.clear()
                await self._more.wait()
            due, _ = self._waiting[0]
            if (early := due - loop.time()) > 0:
                await asyncio.sleep(early)
            await self._flow()
            if self._waiting:  # not dropped in the meantime
                self._writer.write(self._waiting.popleft()[1])
                await self._writer.drain()


def _reset(writer: asyncio.StreamWriter) -> None:
    raw = writer.get_extra_info("socket")
    with contextlib.suppress(OSError):
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _LINGER)
    writer.transport.abort()
