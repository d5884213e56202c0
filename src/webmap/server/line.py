"""One open WebSocket: bounded both ways, and always ended with a reason."""

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable

from starlette.websockets import WebSocket, WebSocketDisconnect

from webmap.server.bounds import Allowance, Bounds
from webmap.server.hop import Hop
from webmap.server.queues import Queue
from webmap.server.request import PROTOCOL

log = logging.getLogger("webmap.server")

BROKEN_RULE = 1008
FAILED = 1011
COME_BACK = 1013

STALLED_S = 5.0
"""How long a page may leave one message unread before it is given up."""

_GOODBYE_S = 0.5

_REST_S = 0.05
"""How long messages that had come before the socket was ended are read."""

_REST_PAUSE_S = 0.01
"""How long the next of them is waited for."""

# What sending to a page that has gone raises. The last is for one that the server gave
# up itself, as its pings were not answered.
_GONE = (WebSocketDisconnect, OSError, RuntimeError)


async def accept(socket: WebSocket) -> None:
    """Accept a socket, with our subprotocol if the page offers it."""
    offered = socket.scope.get("subprotocols", ())
    await socket.accept(PROTOCOL if PROTOCOL in offered else None)


async def close(socket: WebSocket, code: int, reason: str) -> None:
    """Close a socket and say why, unless the page has gone or reads nothing."""
    with contextlib.suppress(TimeoutError, *_GONE):
        async with asyncio.timeout(_GOODBYE_S):
            await socket.close(code, short(reason))


class Line:
    """A socket that has been accepted.

    Args:
        socket: The socket, accepted.
        name: What it is called in the log.
        hop: The way into the socket's event loop.
        bounds: What the page may send.
        queue: Where messages for the page wait.

    """

    def __init__(
        self, socket: WebSocket, name: str, hop: Hop, bounds: Bounds, queue: Queue
    ) -> None:
        self._socket = socket
        self._name = name
        self._hop = hop
        self._allowance = Allowance(bounds, time.monotonic())
        self._queue = queue
        self._wake = asyncio.Event()
        self._over = asyncio.Event()
        self._ended: tuple[int, str] | None = None
        self._gone = False

    def offer(self, item: bytes | str) -> None:
        """Send a message soon; callable from any thread."""
        self._hop.call(self._put, item)

    def end(self, code: int, reason: str) -> None:
        """End the socket and say why; callable from any thread."""
        self._hop.call(self._end, code, reason)

    async def refuse(self, code: int, reason: str) -> None:
        """End the socket before anything was carried, and say why."""
        self._end(code, reason)
        await self._say_goodbye()

    async def refuse_full(self) -> None:
        """End the socket because too many pages are open."""
        await self.refuse(
            COME_BACK, "this server takes no more pages now: close one, or come back"
        )

    async def run(
        self,
        on_text: Callable[[str], None],
        on_broken: Callable[[str], None],
        on_rest: Callable[[str | bytes], None] | None = None,
    ) -> None:
        """Carry messages both ways until either side ends the socket.

        Args:
            on_text: Called with each text message that is within the bounds.
            on_broken: Called with what is wrong with one that is not; it is the last.
            on_rest: Called with the message that was not within the bounds, and with
                those that had come behind it when this side ends the socket.

        """
        # The third waits for an end that comes while the other two are stuck.
        tasks = [
            asyncio.create_task(self._read(on_text, on_broken, on_rest)),
            asyncio.create_task(self._write()),
            asyncio.create_task(self._over.wait()),
        ]
        try:
            await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in tasks:
                task.cancel()
            for result in await asyncio.gather(*tasks, return_exceptions=True):
                if isinstance(result, Exception):
                    log.error("%s failed", self._name, exc_info=result)
                    self._end(
                        FAILED, "the server failed on this page; its log says why"
                    )
        if on_rest is not None and not self._gone:
            await self._read_rest(on_rest)
        await self._say_goodbye()

    def _put(self, item: bytes | str) -> None:
        if self._queue.put(item):
            self._wake.set()
        else:
            self._end(COME_BACK, "this page does not read what it is sent")

    def _end(self, code: int, reason: str) -> None:
        if self._ended is None:
            self._ended = (code, reason)
            self._over.set()

    async def _read(
        self,
        on_text: Callable[[str], None],
        on_broken: Callable[[str], None],
        on_rest: Callable[[str | bytes], None] | None,
    ) -> None:
        while self._ended is None:
            message = await self._socket.receive()
            if message["type"] == "websocket.disconnect":
                self._gone = True
                return
            text: str | None = message.get("text")
            if text is None:
                broken: str | None = "a binary message; only text is taken"
            else:
                broken = self._allowance.spend(text, time.monotonic())
            if broken is not None:
                if on_rest is not None:
                    on_rest(message.get("bytes") or "" if text is None else text)
                on_broken(broken)
                self._end(BROKEN_RULE, broken)
                return
            on_text(text or "")

    async def _read_rest(self, on_rest: Callable[[str | bytes], None]) -> None:
        """Read what has come already; a page that goes on sending is not waited for."""
        until = time.monotonic() + _REST_S
        while time.monotonic() < until:
            try:
                async with asyncio.timeout(_REST_PAUSE_S):
                    message = await self._socket.receive()
            except (TimeoutError, RuntimeError):
                return
            if message["type"] == "websocket.disconnect":
                self._gone = True
                return
            on_rest(message.get("text") or message.get("bytes") or "")

    async def _write(self) -> None:
        while True:
            item = self._queue.pop()
            if item is None:
                self._wake.clear()
                await self._wake.wait()
                continue
            try:
                async with asyncio.timeout(STALLED_S):
                    await self._send(item)
            except TimeoutError:
                self._end(COME_BACK, f"this page read nothing for {STALLED_S:.0f} s")
                return
            except _GONE:
                self._gone = True
                return

    async def _send(self, item: bytes | str) -> None:
        if isinstance(item, str):
            await self._socket.send_text(item)
        else:
            await self._socket.send_bytes(item)

    async def _say_goodbye(self) -> None:
        if self._gone or self._ended is None:
            return
        code, reason = self._ended
        log.info("%s: closed with %d, %s", self._name, code, reason)
        await close(self._socket, code, reason)


def short(reason: str) -> str:
    """Return a reason that fits into a close frame, which has room for 123 bytes."""
    return reason.encode()[:123].decode(errors="ignore")
