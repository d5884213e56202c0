"""The WebSocket server of the sessions."""

import asyncio
import contextlib
import logging
import time
from typing import Any

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request

from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.graph import Graph
from webmap.ros.rosbridge.server.session import Session

log = logging.getLogger("webmap.sim")

_LARGEST_FRAME = 10_000_000


class RosbridgeServer:
    """Listens for rosbridge clients of a graph."""

    def __init__(self, graph: Graph, encoder: Encoder) -> None:
        self.graph = graph
        self.encoder = encoder
        self.sessions: set[Session] = set()
        self.hangs = False
        """Whether the server hangs: no handshake, no operation, no message."""
        self._stopped = asyncio.Event()
        self._server: Server | None = None

    async def start(self, host: str, port: int) -> str:
        """Listen, and return the URL.

        Raises:
            OSError: If the port is in use or the host is not this machine's.

        """
        self._stopped.clear()
        self.hangs = False
        self._server = await serve(
            self._serve_client,
            host,
            port,
            process_request=self._delay_handshake,
            compression=None,
            max_size=_LARGEST_FRAME,
            ping_interval=None,  # as in rosbridge: pings are off by default
            server_header=None,
        )
        bound = self._server.sockets[0].getsockname()[1]
        name = f"[{host}]" if ":" in host else host
        return f"ws://{name}:{bound}"

    async def stop(self) -> None:
        """Close every connection and stop listening."""
        self._stopped.set()
        if self._server:
            self._server.close()
            await self._server.wait_closed()

    async def _delay_handshake(
        self, _connection: ServerConnection, _request: Request
    ) -> None:
        await self._hang_if_spinning()

    async def _hang_if_spinning(self) -> None:
        if self.hangs:
            await self._stopped.wait()

    async def _serve_client(self, connection: ServerConnection) -> None:
        wake = asyncio.Event()
        session = Session(self.graph, self.encoder, clock=time.monotonic, wake=wake.set)
        self.sessions.add(session)
        writer = asyncio.create_task(self._write(connection, session, wake))
        try:
            await self._read(connection, session)
        finally:
            self.sessions.discard(session)
            session.close()
            self.hangs |= session.spinning
            writer.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await writer

    async def _read(self, connection: ServerConnection, session: Session) -> None:
        with contextlib.suppress(ConnectionClosed):
            async for data in connection:
                await self._hang_if_spinning()
                session.receive(data)
                self.hangs |= session.spinning
                if session.overflowed:
                    log.warning("a client reads too slowly: its connection is closed")
                    await connection.close(1008, "too many unsent messages")

    async def _write(
        self, connection: ServerConnection, session: Session, wake: asyncio.Event
    ) -> None:
        with contextlib.suppress(ConnectionClosed):
            while True:
                await self._hang_if_spinning()
                timeout = session.poll()
                frames: list[Any] = session.next_frames()
                for frame in frames:
                    await connection.send(frame)
                if frames:
                    continue
                wake.clear()
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(timeout):
                        await wake.wait()
