"""One WebSocket to a bridge, which never blocks and can be cut at once.

The usual asyncio client waits while its buffer is full and does not show how much is in
it. Here a write never waits, :attr:`Socket.unsent` is the size of the buffer, and
:meth:`Socket.abort` makes the kernel discard the bytes that it still holds.
"""

import asyncio
import contextlib
import logging
import math
import socket
import ssl
import struct
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, cast

from websockets.client import ClientProtocol
from websockets.exceptions import WebSocketException
from websockets.frames import Frame, Opcode
from websockets.http11 import Response
from websockets.protocol import State
from websockets.typing import Subprotocol
from websockets.uri import parse_uri

from webmap.base.errors import BridgeClosed, ProtocolError
from webmap.gate.clock import now
from webmap.gate.lanes.budget import Budget
from webmap.gate.lanes.navigation import readable
from webmap.ros.foxglove.protocol import SUBPROTOCOLS
from webmap.ros.names import is_foxglove_url, web_socket_url
from webmap.ros.rosbridge.pieces import Pieces
from webmap.ros.sockets.turns import Turn, turns

log = logging.getLogger("webmap.gate")

CONNECT_TIMEOUT = 3.0
"""Seconds for name lookup, TCP, TLS and handshake together."""

MAX_FRAME = 1 << 20
"""The longest message that is accepted from a bridge, in bytes."""

MAX_OFFER = 4 << 20
"""The same for Foxglove, whose first message has all topics with their definitions."""

MAX_PARTS = 4096
"""The most frames in one message. Bridges send one, some proxies a few."""

MAX_WAITING = 1 << 16
"""With more bytes than this waiting for their turn, no more are read. As many are read
at once: for 256 KiB, as asyncio has it, the system gets new memory for each message."""

_OFFERED = [Subprotocol(name) for name in SUBPROTOCOLS]

# "Linger 0": the kernel drops unsent bytes on close and resets the connection.
_LINGER = struct.pack("hh" if sys.platform == "win32" else "ii", 1, 0)


@dataclass(slots=True)
class SocketHandlers:
    """The callbacks of a socket; they may be replaced while it is open."""

    text: Callable[[bytes], None]
    """May raise ``ProtocolError``: the message is left out and the reason logged."""
    pong: Callable[[bytes], None]
    lost: Callable[[str], None]
    """Called once, with the reason, when a socket that was open has ended."""


class Socket(asyncio.Protocol):
    """One WebSocket, client side, without compression.

    Args:
        url: The bridge's address.
        handlers: The callbacks.
        budget: How much the bridge may send.

    """

    def __init__(self, url: str, handlers: SocketHandlers, budget: Budget) -> None:
        self.url = url
        self.handlers = handlers
        self.flooded = False
        """Whether it was dropped for what the bridge sent: too much or invalid data."""
        self._budget = budget
        self._turns = turns()
        self._pieces = Pieces()
        self._waiting = bytearray()
        """The bytes that were received and not processed yet."""
        self._choked = False
        """Whether the bridge does not read what is written, such as pongs."""
        self._complained = False
        self._ended: str | None = None
        """Why nothing more will be received, once that is known."""
        self.opened: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._is_foxglove = is_foxglove_url(url)
        self._protocol = ClientProtocol(
            parse_uri(web_socket_url(url)),
            max_size=MAX_OFFER if self._is_foxglove else MAX_FRAME,
            subprotocols=_OFFERED if self._is_foxglove else None,
        )
        self._transport: asyncio.Transport | None = None
        self._parts: list[bytes] = []
        self._over = False

    @property
    def is_open(self) -> bool:
        """Whether messages can be written now."""
        open = not self._over and self._ended is None
        return open and self._protocol.state is State.OPEN

    @property
    def subprotocol(self) -> str | None:
        """The subprotocol that the bridge has chosen, if it was offered any."""
        return self._protocol.subprotocol

    @property
    def unsent(self) -> int:
        """Written bytes that the kernel has not accepted yet."""
        return 0 if self._transport is None else self._transport.get_write_buffer_size()

    def send(self, *messages: bytes, until: float = math.inf) -> bool:
        """Write messages, unless they are too old; return whether it was done.

        The clock is read at the last moment. Otherwise a process that was stopped
        (SIGSTOP, a laptop that sleeps) would first write a velocity that was decided
        before, when it goes on.

        Args:
            messages: The messages; one call of the system is enough for all.
            until: When they are too old, by the gate's clock.

        """
        for data in messages:
            if data[:1] < b" ":  # the opcode of a binary message of Foxglove
                self._protocol.send_binary(data)
            else:
                self._protocol.send_text(data)
        return self._flush(until)

    def ping(self, data: bytes) -> None:
        """Write a ping; the bridge answers with a pong that has the same data."""
        self._protocol.send_ping(data)
        self._flush()

    @property
    def is_behind(self) -> bool:
        """Whether received bytes are not processed yet."""
        return bool(self._waiting)

    def close(self) -> None:
        """Send a close frame and the unsent bytes, then close."""
        if self.is_open:
            self._protocol.send_close(1001)
            self._flush()
        self._over = True
        if self._transport is not None:
            self._transport.close()

    def abort(self, why: str) -> None:
        """Discard the socket with all unsent bytes."""
        if self._transport is not None:
            raw = self._transport.get_extra_info("socket")
            with contextlib.suppress(OSError, AttributeError):
                raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _LINGER)
            self._transport.abort()
        self._lose(why)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Send the handshake of the WebSocket."""
        self._transport = cast("asyncio.Transport", transport)
        cast("Any", transport).max_size = MAX_WAITING
        self._budget.note(now(), behind=False)  # the previous socket may have been
        self._protocol.send_request(self._protocol.connect())
        self._flush()

    def data_received(self, data: bytes) -> None:
        """Keep the bytes until the link has its turn."""
        self._waiting += data
        if self._is_foxglove:
            self._answer_quickly()
        if len(self._waiting) > MAX_WAITING:
            self._read_on(False)
        self._turns.ask(self)

    def eof_received(self) -> None:
        """Note that the bridge sends no more; asyncio closes the connection."""
        self._end("the bridge closed the connection")

    def connection_lost(self, error: Exception | None) -> None:
        """Note the end of the connection; earlier bytes are processed first."""
        self._end(str(error) if error else "the bridge closed the connection")

    def pause_writing(self) -> None:
        """Process nothing more for now: it might need an answer."""
        self._choked = True

    def resume_writing(self) -> None:
        """Process what comes again."""
        self._choked = False
        self._turns.ask(self)

    def take(self, turn: Turn) -> float | None:
        """Process waiting bytes, as far as the time and the link's budget allow.

        Args:
            turn: The turn; no piece is begun when it is over.

        Returns:
            Seconds until the socket needs another turn; ``None`` if it will ask for
            one.

        """
        at, begun = now(), time.thread_time()
        why, wait = self._budget.flood(at), self._budget.wait(at)
        if why is not None:
            self.drop(why)
            return None
        if wait > 0:
            self._read_on(False)
            return wait
        pieces, size = 1, 0  # 1 for the turn: single bytes cost turns
        while length := self._next_piece():
            piece = bytes(self._waiting[:length])
            del self._waiting[:length]
            try:
                head = 0 if self._parts else self._pieces.head
                if head and self._protocol.state is State.OPEN:
                    self._pass_on(piece[head:])
                else:
                    self._protocol.receive_data(piece)
                    self._take_events()
            except Exception as error:
                self.drop(f"invalid data from the bridge: {error!r}")
            pieces, size = pieces + 1, size + length
            if turn.is_over:
                break
        self._budget.spend(pieces, size, time.thread_time() - begun, at)
        self._budget.note(at, behind=length > 0)
        # Not only when nothing waits: otherwise a flood would look like pauses.
        self._read_on(not self._choked and len(self._waiting) <= MAX_WAITING)
        if length:
            return 0.0
        if self._ended is not None:
            self._finish(self._ended)
        return None

    def drop(self, why: str) -> None:
        """Discard the socket because of what the bridge sent."""
        self.flooded = True
        self.abort(why)

    def _next_piece(self) -> int:
        """Return how many of the waiting bytes to process next."""
        if self._over or self._choked:
            return 0
        handshake_done = self._protocol.state is not State.CONNECTING
        return self._pieces.next(self._waiting, handshake_done=handshake_done)

    def _read_on(self, on: bool) -> None:
        """Resume or pause reading from the connection."""
        assert self._transport is not None
        if on:
            self._transport.resume_reading()
        else:
            self._transport.pause_reading()

    def _end(self, why: str) -> None:
        if self._ended is None:
            self._ended = why
            self._turns.ask(self)

    def _finish(self, why: str) -> None:
        """End the socket, after all earlier bytes were processed."""
        self._protocol.receive_eof()
        self._take_events()
        self._lose(why)

    def _take_events(self) -> None:
        self._flush()
        for event in self._protocol.events_received():
            if isinstance(event, Response):
                self._finish_handshake()
            else:
                assert isinstance(event, Frame)
                self._on_frame(event)
        if self._protocol.handshake_exc is not None:
            self.abort(f"no WebSocket at this address: {self._protocol.handshake_exc}")
        elif self._protocol.close_expected() and self._transport is not None:
            self._waiting.clear()
            self._transport.close()

    def _finish_handshake(self) -> None:
        if self._is_foxglove and self._protocol.subprotocol is None:
            self.abort("no bridge of Foxglove at this address")
        elif self._protocol.handshake_exc is None and not self.opened.done():
            self.opened.set_result(None)

    def _on_frame(self, frame: Frame) -> None:
        if frame.opcode is Opcode.PONG:
            self.handlers.pong(bytes(frame.data))
        elif frame.opcode in (Opcode.TEXT, Opcode.BINARY, Opcode.CONT):
            self._parts.append(bytes(frame.data))
            if len(self._parts) > MAX_PARTS:
                self.drop(f"a message in more than {MAX_PARTS} frames")
            elif frame.fin:
                text, self._parts = b"".join(self._parts), []
                self._pass_on(text)

    def _pass_on(self, text: bytes) -> None:
        try:
            self.handlers.text(text)
        except ProtocolError as error:
            if not self._complained:
                self._complained = True
                log.warning("%s: %s; ignored, as are similar messages", self.url, error)

    def _answer_quickly(self) -> None:
        """Acknowledge data at once: servers of Foxglove keep back a small message.

        They do so until the message before it is acknowledged, for up to 40 ms.
        """
        assert self._transport is not None
        raw = self._transport.get_extra_info("socket")
        with contextlib.suppress(OSError, AttributeError):  # only Linux has it
            raw.setsockopt(socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1)

    def _flush(self, until: float = math.inf) -> bool:
        """Write what the protocol has to send, unless that is too old."""
        assert self._transport is not None
        data = b"".join(self._protocol.data_to_send())
        if now() > until or self._ended is not None:
            return False
        self._transport.write(data)
        return True

    def _lose(self, why: str) -> None:
        if self._over:
            return
        self._over = True
        self._waiting.clear()
        why = readable(why)  # it may contain text from the bridge
        if not self.opened.done():
            self.opened.set_exception(BridgeClosed(f"{self.url}: {why}"))
        elif not self.opened.cancelled():  # cancelled: given up before it was open
            self.handlers.lost(why)


async def open_socket(url: str, handlers: SocketHandlers, budget: Budget) -> Socket:
    """Connect to a bridge.

    Args:
        url: Its address.
        handlers: The callbacks.
        budget: How much the bridge may send, with the use by earlier sockets.

    Raises:
        BridgeClosed: If no connection is made in time.

    """
    uri = parse_uri(web_socket_url(url))
    made = Socket(url, handlers, budget)
    try:
        async with asyncio.timeout(CONNECT_TIMEOUT):
            # Loading the certificates takes 0.1 s, and other robots cannot wait.
            tls = await asyncio.to_thread(_trust) if uri.secure else None
            await asyncio.get_running_loop().create_connection(
                lambda: made,
                uri.host,
                uri.port,
                ssl=tls,
                happy_eyeballs_delay=0.25,
            )
            await made.opened
    except (OSError, WebSocketException, TimeoutError) as error:
        made.abort("given up")
        _retrieve(made.opened)
        why = str(error) or f"no answer within {CONNECT_TIMEOUT:g} s"
        raise BridgeClosed(f"{url}: {why}") from error
    except asyncio.CancelledError:
        made.abort("no longer wanted")
        _retrieve(made.opened)
        raise
    return made


def _trust() -> ssl.SSLContext:
    """Return a TLS context with the system's present certificate authorities."""
    return ssl.create_default_context()


def _retrieve(future: "asyncio.Future[None]") -> None:
    """Read a future's exception, or asyncio logs that it was never retrieved."""
    if not future.cancelled():
        future.exception()
