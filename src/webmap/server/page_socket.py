"""The WebSockets of pages: bounded in both directions, and always closed with a reason.

Here are the open sockets, the limits of each, and how one is read and written. The two
sockets of a page are in ``sockets``.
"""

import asyncio
import contextlib
import logging
import re
import time
from collections import Counter, OrderedDict
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass

from starlette.websockets import WebSocket, WebSocketDisconnect

from webmap.base.counts import counts
from webmap.server.access import FRAME, PROTOCOL
from webmap.server.outbox import BatchedCalls, DriveQueue, FrameQueue, VideoQueue

log = logging.getLogger("webmap.server")

BROKEN_RULE = 1008
FAILED = 1011
COME_BACK = 1013

STALLED_S = 5.0
"""How long a page may leave one message unread before its socket is closed, in
seconds."""

_GOODBYE_S = 0.5

_REST_S = 0.5
"""How long messages that arrived before the end of the socket are read, in seconds."""

_REST_PAUSE_S = 0.01
"""How long to wait for the next of them, in seconds."""

# The exceptions of sending to a page that is gone. The last one is raised if the server
# itself closed the connection because its pings were not answered.
_GONE = (WebSocketDisconnect, OSError, RuntimeError)

_PAGE_ID = re.compile(r"[A-Za-z0-9_-]{1,64}")

Key = tuple[str, str]
"""A viewer and one of its pages."""

FULL = "too many open pages: close one, or try again later"

TOO_SOON = "too many new pages in a short time: try again later"

REPLACED = 4001
"""The close code of a socket whose page has opened another one."""


@dataclass(frozen=True, slots=True)
class SocketLimits:
    """How much a page may send over one socket."""

    max_bytes: int
    """The greatest message size, in bytes of UTF-8."""

    rate: float
    """Messages per second, on average."""

    burst: float
    """Messages at once. A connection that stalled delivers its queue at once."""


# An answer to each of 60 frames, and three kinds of events as often.
SCENE = SocketLimits(max_bytes=16 * 1024, rate=240.0, burst=480.0)
# 20 commands a second for the 6 s after which a silent connection is given up.
DRIVE = SocketLimits(max_bytes=1024, rate=60.0, burst=120.0)
# An answer to each picture, of which a new viewer gets many at once.
VIDEO = SocketLimits(max_bytes=32, rate=240.0, burst=1200.0)

OPENS = 2.0
"""Pages that one viewer may open each second."""

OPENS_AT_ONCE = 30
"""Pages that one viewer may open at once, if not more have a place."""

REFUSAL_S = 1.0
"""How long a socket that comes too soon, or is one too many, waits for its refusal, in
seconds. A page that connects again after each refusal then costs little."""

MOST_VIEWERS = 1024
"""Viewers whose new pages are counted; who opened one longest ago is forgotten."""


class Opens:
    """How often each viewer may open a page: many at once, then a few a second.

    Args:
        burst: Pages at once, :data:`OPENS_AT_ONCE` or more.

    """

    def __init__(self, burst: int) -> None:
        self._longest = max(burst, OPENS_AT_ONCE) / OPENS
        self._until: OrderedDict[str, float] = OrderedDict()
        """When each viewer will have opened no more than its rate allows."""

    def may_open(self, viewer: str, now: float) -> bool:
        """Count a page that a viewer opens, unless it comes too soon."""
        until = max(self._until.get(viewer, now), now) + 1 / OPENS
        if until - now > self._longest:
            return False
        self._until[viewer] = until
        self._until.move_to_end(viewer)
        if len(self._until) > MOST_VIEWERS:
            self._until.popitem(last=False)
        return True


class Allowance:
    """The remaining allowance of one socket: a bucket that fills at a rate."""

    __slots__ = ("_bounds", "_left", "_then")

    def __init__(self, bounds: SocketLimits, now: float) -> None:
        self._bounds = bounds
        self._left = bounds.burst
        self._then = now

    def spend(self, text: str, now: float) -> str | None:
        """Count one message; return why the socket must end, or None.

        Args:
            text: The message.
            now: Seconds, monotonic.

        """
        bounds = self._bounds
        size = len(text) if text.isascii() else len(text.encode(errors="replace"))
        if size > bounds.max_bytes:
            return f"got a message of {size} bytes, expected at most {bounds.max_bytes}"
        filled = self._left + (now - self._then) * bounds.rate
        self._left, self._then = min(bounds.burst, filled) - 1.0, now
        if self._left < 0.0:
            return f"more than {bounds.rate:.0f} messages a second"
        return None


async def accept(socket: WebSocket) -> None:
    """Accept a socket, with WebMap's subprotocol if the page offers it."""
    offered = socket.scope.get("subprotocols", ())
    await socket.accept(PROTOCOL if PROTOCOL in offered else None)


async def close(socket: WebSocket, code: int, reason: str) -> None:
    """Close a socket with a reason, unless the page is gone or reads nothing."""
    with contextlib.suppress(TimeoutError, *_GONE):
        async with asyncio.timeout(_GOODBYE_S):
            await socket.close(code, short(reason))


class PageSocket:
    """An accepted socket.

    Args:
        socket: The socket, accepted.
        name: The name in the log.
        calls: Calls functions in the socket's event loop.
        bounds: The limits of the page's messages.
        queue: The queue of messages for the page.

    """

    def __init__(
        self,
        socket: WebSocket,
        name: str,
        calls: BatchedCalls,
        bounds: SocketLimits,
        queue: FrameQueue | DriveQueue | VideoQueue,
    ) -> None:
        self._socket = socket
        self._name = name
        self._calls = calls
        self._allowance = Allowance(bounds, time.monotonic())
        self._queue = queue
        self._wake = asyncio.Event()
        self._over = asyncio.Event()
        self._ended: tuple[int, str] | None = None
        self._gone = False
        self._left = "the browser closed it"

    @property
    def cause(self) -> str:
        """Why the socket has ended, as text for people."""
        return self._left if self._ended is None else self._ended[1]

    def offer(self, item: bytes | str) -> None:
        """Send a message soon; callable from any thread."""
        self._calls.call(self._put, item)

    def go_on(self) -> None:
        """Send what the queue held back; called in the socket's event loop."""
        self._wake.set()

    def end(self, code: int, reason: str) -> None:
        """Close the socket with a reason; callable from any thread."""
        self._calls.call(self._end, code, reason)

    async def refuse(self, code: int, reason: str) -> None:
        """Close the socket with a reason before any message was passed."""
        if code == COME_BACK:
            await asyncio.sleep(REFUSAL_S)
        self._end(code, reason)
        await self._send_close()

    async def run(
        self,
        on_text: Callable[[str], None],
        on_broken: Callable[[str], None],
        on_rest: Callable[[str | bytes], None] | None = None,
    ) -> None:
        """Pass messages in both directions until either side ends the socket.

        Args:
            on_text: Called with each text message within the limits.
            on_broken: Called with the error of a message beyond the limits; it is the
                last.
            on_rest: Called with the message beyond the limits, and with those that had
                arrived after it when this side ends the socket.

        """
        # The third one detects an end while the other two are blocked.
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
                        FAILED, "WebMap failed on this page; see the log of WebMap"
                    )
        if on_rest is not None and not self._gone:
            await self._read_rest(on_rest)
        await self._send_close()

    def _put(self, item: bytes | str) -> None:
        if self._queue.put(item):
            self._wake.set()
        else:
            self._end(COME_BACK, "this page does not read its messages")

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
                self._left = message.get("reason") or self._left
                # No page can send this code: its ping was not answered.
                if message.get("code") == 1006 and message.get("reason"):
                    log.info("%s: closed, %s", self._name, message["reason"])
                return
            text: str | None = message.get("text")
            if text is None:
                broken: str | None = "got a binary message, expected text"
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
        """Read messages that have already arrived, for a limited time."""
        until = time.monotonic() + _REST_S
        pauses = 0
        # If the thread did not run during a pause, a message may have come meanwhile.
        while pauses < 2 and time.monotonic() < until:
            try:
                async with asyncio.timeout(_REST_PAUSE_S):
                    message = await self._socket.receive()
            except TimeoutError:
                pauses += 1
                continue
            except RuntimeError:
                return
            pauses = 0
            if message["type"] == "websocket.disconnect":
                self._gone = True
                return
            on_rest(message.get("text") or message.get("bytes") or "")

    async def _write(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            item = self._queue.pop()
            if item is None:
                self._wake.clear()
                await self._wake.wait()
                continue
            # A timer costs a tenth of asyncio.timeout(), and nearly no message waits.
            stalled = loop.call_later(STALLED_S, self._stalled)
            try:
                await self._send(item)
            except _GONE:
                self._gone = True
                return
            finally:
                stalled.cancel()

    def _stalled(self) -> None:
        counts["stalled_pages"] += 1
        self._end(COME_BACK, f"this page read no message for {STALLED_S:.0f} s")

    async def _send(self, item: bytes | str) -> None:
        counts["sent_bytes"] += len(item)
        if isinstance(item, str):
            await self._socket.send_text(item)
        else:
            await self._socket.send_bytes(item)

    async def _send_close(self) -> None:
        if self._gone or self._ended is None:
            return
        code, reason = self._ended
        log.info("%s: closed with %d, %s", self._name, code, reason)
        await close(self._socket, code, reason)


def page_id_of(query: Mapping[str, str]) -> str | None:
    """Return a page's identifier; None if it is not valid.

    A page in a frame is no page that was open in a tab before, with other rights.
    """
    page_id = query.get("id", "")
    if not _PAGE_ID.fullmatch(page_id):
        return None
    return f"{FRAME}-{page_id}" if FRAME in query else page_id


def short(reason: str) -> str:
    """Return a reason cut to the 123 bytes of a close frame."""
    return reason.encode()[:123].decode(errors="ignore")


class OpenSockets:
    """The open sockets of one kind: one for each page.

    When there are too many, a viewer with more of them yields to one with fewer, so
    that nobody can take all places.

    Args:
        limit: The greatest number of pages with a socket.
        always: Whether each new page gets a place, however many its viewer has.

    """

    def __init__(self, limit: int, *, always: bool = False) -> None:
        self._limit = limit
        self._always = always
        self._sockets: dict[Key, PageSocket] = {}

    def __len__(self) -> int:
        return len(self._sockets)

    @property
    def viewers(self) -> int:
        """The number of people with a socket."""
        return len({viewer for viewer, _ in self._sockets})

    @property
    def full(self) -> bool:
        """Whether no place is left."""
        return len(self._sockets) >= self._limit

    def add(self, key: Key, socket: PageSocket) -> bool:
        """Add a page's socket; return False if there is no place for it.

        It replaces the previous socket of this page, whose connection may be lost
        without either side having detected it.
        """
        before = self._sockets.pop(key, None)
        if before is None and self.full and not self._make_room(key[0]):
            return False
        self._sockets[key] = socket  # the newest at the end
        if before is not None:
            before.end(REPLACED, "this page was opened again in another tab")
        return True

    def _make_room(self, viewer: str) -> bool:
        """Close a socket of the viewer with the most; return whether that was fair."""
        numbers = Counter(owner for owner, _ in self._sockets)
        most, number = numbers.most_common(1)[0]
        if not self._always and number <= numbers[viewer] + 1:
            return False
        # The oldest pages are rather in use; of those that can only stop, none is.
        order = self._sockets if self._always else reversed(self._sockets)
        self.end(next(key for key in order if key[0] == most), FULL)
        return True

    def end(self, key: Key, reason: str) -> None:
        """Close a page's socket, so that its place is free at once."""
        self._sockets.pop(key).end(COME_BACK, reason)

    def end_oldest(self, reason: str) -> None:
        """Close the socket that was opened first, if there is one."""
        if self._sockets:
            self.end(next(iter(self._sockets)), reason)

    def end_unless(self, lasts: Callable[[str], object], reason: str) -> None:
        """Close the sockets of the viewers whose session has ended.

        Args:
            lasts: Called with the id of each viewer.
            reason: Why the sockets are closed.

        """
        for key in [key for key in self._sockets if not lasts(key[0])]:
            self.end(key, reason)

    def remove(self, key: Key, socket: PageSocket) -> None:
        """Remove a page's socket, unless another one has replaced it."""
        if self._sockets.get(key) is socket:
            del self._sockets[key]

    @asynccontextmanager
    async def holding(self, key: Key, socket: PageSocket) -> AsyncIterator[bool]:
        """Count a socket as open within an ``async with`` block.

        Yields:
            False if too many other pages have one.

        """
        added = self.add(key, socket)
        try:
            yield added
        finally:
            self.remove(key, socket)
