"""A line between an agent and its router: it counts bytes, and may be narrow."""

import asyncio
import contextlib
import socket
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Literal

from webmap.base.tasks import LoopThread

Queue = Literal["fair", "one"]

PACKET = 1448
"""Bytes that cross the line at a time, as many as a TCP packet on Ethernet has."""

KEPT = 4096
"""The receive buffer of a connection to a narrow line; Linux doubles it."""

READ = 1 << 16
"""Bytes that are read at a time if the line has no limit."""


class Direction:
    """One direction of the line, which all connections share.

    Args:
        rate: Bytes a second; None for no limit.
        queue: ``one``: bytes of all connections cross in the order in which they were
            sent, as in a simple modem. ``fair``: the connections take turns, as with
            fq_codel.
        depth: The size of one queue in bytes; if it is full, the connections wait.

    """

    def __init__(self, rate: float | None, queue: Queue, depth: int) -> None:
        self.bytes = 0
        """The number of bytes that have crossed the line."""
        self._rate = rate
        self._depth = depth if queue == "one" else 0
        self._waiting: deque[tuple[asyncio.StreamWriter, bytes]] = deque()
        self._size = 0
        self._room = asyncio.Condition()
        self._turn = asyncio.Lock()
        self._free_at = 0.0

    @property
    def narrow(self) -> bool:
        """Whether the line has a limit."""
        return self._rate is not None

    async def carry(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
    ) -> None:
        """Carry the bytes of one connection until it ends."""
        while data := await reader.read(PACKET if self._rate else READ):
            if self._rate is None:
                await self._cross(writer, data)
            elif self._depth:
                async with self._room:
                    await self._room.wait_for(lambda: self._size < self._depth)
                    self._waiting.append((writer, data))
                    self._size += len(data)
                    self._room.notify_all()
            else:
                async with self._turn:  # in the order of the requests
                    await self._pace(len(data))
                    await self._cross(writer, data)

    async def empty_queue(self) -> None:
        """Send the bytes of the one queue over the line, for ever."""
        while True:
            async with self._room:
                await self._room.wait_for(lambda: bool(self._waiting))
                writer, data = self._waiting[0]
            await self._pace(len(data))
            await self._cross(writer, data)
            async with self._room:
                self._waiting.popleft()
                self._size -= len(data)
                self._room.notify_all()

    async def _pace(self, size: int) -> None:
        """Wait as long as the bytes take to cross."""
        assert self._rate is not None
        loop = asyncio.get_running_loop()
        # The next wait is shorter if sleep() was late, by at most 5 ms.
        begun = max(self._free_at, loop.time() - 0.005)
        self._free_at = begun + size / self._rate
        await asyncio.sleep(self._free_at - loop.time())

    async def _cross(self, writer: asyncio.StreamWriter, data: bytes) -> None:
        self.bytes += len(data)
        with contextlib.suppress(OSError):
            writer.write(data)
            await writer.drain()


class Line:
    """Forwards connections to a port of this computer; a context manager.

    Args:
        port: The port.
        rate: Bytes a second, each way, of all connections; None for no limit.
        queue: The order of the bytes on a narrow line; see :class:`Direction`.
        depth: The size of the queue in bytes, if there is one queue.

    """

    def __init__(
        self,
        port: int,
        rate: float | None = None,
        queue: Queue = "fair",
        depth: int = 32_000,
    ) -> None:
        self._target = port
        self._thread = LoopThread("line")
        self._tasks: set[asyncio.Task[None]] = set()
        self.up = Direction(rate, queue, depth)
        self.down = Direction(rate, queue, depth)
        self.port: int = self._thread.call(self._listen())

    def __enter__(self) -> "Line":
        return self

    def __exit__(self, *exception: object) -> None:
        self._thread.do(self._server.close)
        self._thread.end()

    async def _listen(self) -> int:
        for direction in (self.up, self.down):
            self._begin(direction.empty_queue())
        server = socket.create_server(("127.0.0.1", 0))
        if self.up.narrow:
            # A large buffer in the kernel would be another queue.
            server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, KEPT)
        self._server = await asyncio.start_server(
            self._accept, sock=server, limit=PACKET
        )
        port: int = self._server.sockets[0].getsockname()[1]
        return port

    def _begin(self, work: Awaitable[None]) -> None:
        async def run() -> None:
            await work

        task = asyncio.get_running_loop().create_task(run())
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _accept(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        far_reader, far_writer = await asyncio.open_connection(
            "127.0.0.1", self._target, limit=PACKET
        )
        ways: list[tuple[Direction, asyncio.StreamReader, asyncio.StreamWriter]] = [
            (self.up, reader, far_writer),
            (self.down, far_reader, writer),
        ]
        for direction, source, target in ways:
            self._begin(_until_end(direction.carry, source, target))


async def _until_end(
    carry: Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]],
    source: asyncio.StreamReader,
    target: asyncio.StreamWriter,
) -> None:
    with contextlib.suppress(OSError):
        await carry(source, target)
    target.close()
