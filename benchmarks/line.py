"""A line between an agent and its router: it counts bytes, and may be narrow."""

import asyncio
import contextlib
import socket
from collections import deque
from collections.abc import Awaitable, Callable
from typing import Literal

from webmap.base.loop_thread import LoopThread

Queue = Literal["fair", "one"]

PACKET = 1448
"""Bytes that cross the line at a time: what an Ethernet packet of TCP carries."""

KEPT = 4096
"""Bytes of a connection to a narrow line that the system keeps; Linux doubles it."""

READ = 1 << 16
"""Bytes that are read at a time where the line is as wide as the machine can."""


class Direction:
    """One direction of the line, which all connections share.

    Args:
        rate: Bytes a second; None for no limit.
        queue: ``one``: what was sent first crosses first, of whatever connection, as in
            a plain modem. ``fair``: the connections take turns, as with fq_codel.
        depth: Bytes that wait in one queue; the connections wait outside beyond that.

    """

    def __init__(self, rate: float | None, queue: Queue, depth: int) -> None:
        self.bytes = 0
        """What has crossed the line."""
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
        """Carry what one connection sends until it ends."""
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
                async with self._turn:  # in the order in which they ask for it
                    await self._pace(len(data))
                    await self._cross(writer, data)

    async def empty_queue(self) -> None:
        """Let the one queue cross, for ever."""
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
        # What sleep() was late is made good by the next one, up to a moment.
        begun = max(self._free_at, loop.time() - 0.005)
        self._free_at = begun + size / self._rate
        await asyncio.sleep(self._free_at - loop.time())

    async def _cross(self, writer: asyncio.StreamWriter, data: bytes) -> None:
        self.bytes += len(data)
        with contextlib.suppress(OSError):
            writer.write(data)
            await writer.drain()


class Line:
    """Passes connections on to a port of this computer; a context manager.

    Args:
        port: The port.
        rate: Bytes a second, each way, of all connections; None for no limit.
        queue: Who waits where the line is too narrow; see :class:`Direction`.
        depth: Bytes that may wait in front of the line where there is one queue.

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
            # What the kernel of this computer kept would be a queue of its own.
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
