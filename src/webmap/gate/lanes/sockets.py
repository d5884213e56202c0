"""One WebSocket to a bridge, written without waiting and cut without mercy.

The usual asyncio client waits while its buffer is full and cannot say what lies in it.
Here a write happens at once, what is unsent can be asked for, and :meth:`Socket.abort`
has the kernel throw away what it still holds.
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
from typing import cast

from websockets.client import ClientProtocol
from websockets.exceptions import WebSocketException
from websockets.frames import Frame, Opcode
from websockets.http11 import Response
from websockets.protocol import State
from websockets.uri import parse_uri

from webmap.base.errors import BridgeClosed, ProtocolError
from webmap.gate.clock import now
from webmap.gate.lanes.budget import Budget
from webmap.gate.lanes.navigation import readable
from webmap.ros.rosbridge.pieces import Pieces
from webmap.ros.rosbridge.turns import turns

log = logging.getLogger("webmap.gate")

CONNECT_TIMEOUT = 3.0
"""Seconds for name lookup, TCP, TLS and handshake together."""

MAX_FRAME = 1 << 20
"""The longest message that is taken from a bridge, in bytes."""

MAX_PARTS = 4096
"""The most frames of one message. Bridges send one, some proxies a few."""

MAX_WAITING = 1 << 16
"""Bytes that may wait for their turn until no more are read. asyncio reads up to
256 KiB at once, so at most that much more waits."""

# The kernel's "linger 0": closing drops unsent bytes and resets the connection.
_LINGER = struct.pack("hh" if sys.platform == "win32" else "ii", 1, 0)


@dataclass(slots=True)
class SocketHandlers:
    """Who hears what comes on a socket; may be changed while it is open."""

    text: Callable[[bytes], None]
    """May raise ``ProtocolError``: the message is left out and the log says why."""
    pong: Callable[[bytes], None]
    lost: Callable[[str], None]
    """Called once, with the reason, when a socket that was open is no longer."""


class Socket(asyncio.Protocol):
    """One WebSocket, client side, without compression.

    Args:
        url: The bridge's address.
        ears: Who hears what comes.
        budget: How much may come.

    """

    def __init__(self, url: str, ears: SocketHandlers, budget: Budget) -> None:
        self.url = url
        self.ears = ears
        self.flooded = False
        """Whether it was dropped for what the bridge sent."""
        self._budget = budget
        self._turns = turns()
        self._pieces = Pieces()
        self._waiting = bytearray()
        """What came and was not dealt with yet."""
        self._choked = False
        """Whether the bridge does not take what is written, as answers to pings."""
        self._complained = False
        self._ended: str | None = None
        """Why nothing more comes, as soon as that is known."""
        self.opened: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._protocol = ClientProtocol(parse_uri(url), max_size=MAX_FRAME)
        self._transport: asyncio.Transport | None = None
        self._parts: list[bytes] = []
        self._over = False

    @property
    def is_open(self) -> bool:
        """Whether something can be written now."""
        open = not self._over and self._ended is None
        return open and self._protocol.state is State.OPEN

    @property
    def unsent(self) -> int:
        """Bytes that were written and that the kernel has not taken yet."""
        return 0 if self._transport is None else self._transport.get_write_buffer_size()

    def send(self, data: bytes, until: float = math.inf) -> bool:
        """Write one text message; return whether it was still worth it.

        The clock is read at the last moment. A process that is stopped (SIGSTOP, a
        laptop that sleeps) and goes on later would else write what it had decided
        before, as the first thing that a robot hears.

        Args:
            data: The message.
            until: When it is too old to be written, by the gate's clock.

        """
        self._protocol.send_text(data)
        return self._flush(until)

    def ping(self, data: bytes) -> None:
        """Write a ping; the bridge answers with a pong of the same data."""
        self._protocol.send_ping(data)
        self._flush()

    @property
    def is_behind(self) -> bool:
        """Whether more has come than was dealt with."""
        return bool(self._waiting)

    def close(self) -> None:
        """Say goodbye, send what is unsent, and close."""
        if self.is_open:
            self._protocol.send_close(1001)
            self._flush()
        self._over = True
        if self._transport is not None:
            self._transport.close()

    def abort(self, why: str) -> None:
        """Throw the socket away with everything that was not sent."""
        if self._transport is not None:
            raw = self._transport.get_extra_info("socket")
            with contextlib.suppress(OSError, AttributeError):
                raw.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _LINGER)
            self._transport.abort()
        self._lose(why)

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Ask for a WebSocket."""
        self._transport = cast("asyncio.Transport", transport)
        self._budget.note(now(), behind=False)  # as the socket before may have been
        self._protocol.send_request(self._protocol.connect())
        self._flush()

    def data_received(self, data: bytes) -> None:
        """Keep bytes until the link has its turn."""
        self._waiting += data
        if len(self._waiting) > MAX_WAITING:
            self._read_on(False)
        self._turns.ask(self)

    def eof_received(self) -> None:
        """Note the end of the bytes; asyncio closes the connection."""
        self._end("the bridge closed the connection")

    def connection_lost(self, error: Exception | None) -> None:
        """Note the end; what came before it is dealt with first."""
        self._end(str(error) if error else "the bridge closed the connection")

    def pause_writing(self) -> None:
        """Take in nothing more: it might have to be answered."""
        self._choked = True

    def resume_writing(self) -> None:
        """Take in what comes."""
        self._choked = False
        self._turns.ask(self)

    def take(self, until: float) -> float | None:
        """Deal with what waits, as far as the time and the budget of the link allow.

        Args:
            until: When to end, by :func:`time.thread_time`.

        Returns:
            Seconds until it wants another turn; ``None`` if it will ask for one.

        """
        at, begun = now(), time.thread_time()
        why, wait = self._budget.flood(at), self._budget.wait(at)
        if why is not None:
            self.drop(why)
            return None
        if wait > 0:
            self._read_on(False)
            return wait
        pieces, size = 1, 0  # one for the turn: a byte at a time costs turns
        while length := self._next_piece():
            piece = bytes(self._waiting[:length])
            del self._waiting[:length]
            try:
                self._protocol.receive_data(piece)
                self._take_events()
            except Exception as error:
                self.drop(f"invalid data from the bridge: {error!r}")
            pieces, size = pieces + 1, size + length
            if time.thread_time() >= until:
                break
        self._budget.spend(pieces, size, time.thread_time() - begun, at)
        self._budget.note(at, behind=length > 0)
        # Not only when nothing waits: a flood would seem to pause each time.
        self._read_on(not self._choked and len(self._waiting) <= MAX_WAITING)
        if length:
            return 0.0
        if self._ended is not None:
            self._finish(self._ended)
        return None

    def drop(self, why: str) -> None:
        """Throw the socket away because of what the bridge sends."""
        self.flooded = True
        self.abort(why)

    def _next_piece(self) -> int:
        """Return how many of the bytes that wait are to be dealt with next."""
        if self._over or self._choked:
            return 0
        shaken = self._protocol.state is not State.CONNECTING
        return self._pieces.next(self._waiting, shaken=shaken)

    def _read_on(self, on: bool) -> None:
        """Have asyncio read from the connection or not."""
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
        """Note the end, after everything that came before it."""
        self._protocol.receive_eof()
        self._take_events()
        self._lose(why)

    def _take_events(self) -> None:
        self._flush()
        for event in self._protocol.events_received():
            if isinstance(event, Response):
                self._shake_hands()
            else:
                assert isinstance(event, Frame)
                self._on_frame(event)
        if self._protocol.handshake_exc is not None:
            self.abort(f"no WebSocket at this address: {self._protocol.handshake_exc}")
        elif self._protocol.close_expected() and self._transport is not None:
            self._waiting.clear()
            self._transport.close()

    def _shake_hands(self) -> None:
        if self._protocol.handshake_exc is None and not self.opened.done():
            self.opened.set_result(None)

    def _on_frame(self, frame: Frame) -> None:
        if frame.opcode is Opcode.PONG:
            self.ears.pong(bytes(frame.data))
        elif frame.opcode in (Opcode.TEXT, Opcode.BINARY, Opcode.CONT):
            self._parts.append(bytes(frame.data))
            if len(self._parts) > MAX_PARTS:
                self.drop(f"a message in more than {MAX_PARTS} frames")
            elif frame.fin:
                text, self._parts = b"".join(self._parts), []
                self._pass_on(text)

    def _pass_on(self, text: bytes) -> None:
        try:
            self.ears.text(text)
        except ProtocolError as error:
            if not self._complained:
                self._complained = True
                log.warning("%s: %s; ignored, as are similar messages", self.url, error)

    def _flush(self, until: float = math.inf) -> bool:
        """Hand over what the protocol has to say, unless that is too old."""
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
        why = readable(why)  # it may hold what the bridge sent
        if not self.opened.done():
            self.opened.set_exception(BridgeClosed(f"{self.url}: {why}"))
        elif not self.opened.cancelled():  # given up before it was open
            self.ears.lost(why)


async def open_socket(url: str, ears: SocketHandlers, budget: Budget) -> Socket:
    """Connect to a bridge.

    Args:
        url: Its address.
        ears: Who hears what comes.
        budget: How much may come, and came on earlier sockets.

    Raises:
        BridgeClosed: If that does not succeed in time.

    """
    uri = parse_uri(url)
    made = Socket(url, ears, budget)
    try:
        async with asyncio.timeout(CONNECT_TIMEOUT):
            # Reading who may vouch for a name takes 0.1 s: other robots cannot wait.
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
    """Return how bridges prove who they are, by the system's authorities of now."""
    return ssl.create_default_context()


def _retrieve(future: "asyncio.Future[None]") -> None:
    """Look at the outcome, so that asyncio does not complain that nobody did."""
    if not future.cancelled():
        future.exception()
