"""One WebSocket to a bridge, written without waiting and cut without mercy.

The usual asyncio client waits while its buffer is full and cannot say what lies in it.
Here a write happens at once, what is unsent can be asked for, and :meth:`Socket.abort`
has the kernel throw away what it still holds.
"""

import asyncio
import contextlib
import math
import socket
import ssl
import struct
import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import cast

from websockets.client import ClientProtocol
from websockets.exceptions import WebSocketException
from websockets.frames import Frame, Opcode
from websockets.http11 import Response
from websockets.protocol import State
from websockets.uri import parse_uri

from webmap.errors import BridgeClosed
from webmap.gate.clock import now

CONNECT_TIMEOUT = 3.0
"""Seconds for name lookup, TCP, TLS and handshake together."""

MAX_FRAME = 1 << 20
"""The longest message that is taken from a bridge, in bytes."""

# The kernel's "linger 0": closing drops unsent bytes and resets the connection.
_LINGER = struct.pack("hh" if sys.platform == "win32" else "ii", 1, 0)


@dataclass(slots=True)
class Ears:
    """Who hears what comes on a socket; may be changed while it is open."""

    text: Callable[[bytes], None]
    pong: Callable[[bytes], None]
    lost: Callable[[str], None]
    """Called once, with the reason, when a socket that was open is no longer."""


class Socket(asyncio.Protocol):
    """One WebSocket, client side, without compression.

    Args:
        url: The bridge's address.
        ears: Who hears what comes.

    """

    def __init__(self, url: str, ears: Ears) -> None:
        self.url = url
        self.ears = ears
        self.opened: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._protocol = ClientProtocol(parse_uri(url), max_size=MAX_FRAME)
        self._transport: asyncio.Transport | None = None
        self._parts: list[bytes] = []
        self._over = False

    @property
    def is_open(self) -> bool:
        """Whether something can be written now."""
        return not self._over and self._protocol.state is State.OPEN

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
        self._protocol.send_request(self._protocol.connect())
        self._flush()

    def data_received(self, data: bytes) -> None:
        """Take in bytes."""
        self._protocol.receive_data(data)
        self._take_events()

    def eof_received(self) -> None:
        """Take in the end of the bytes."""
        self._protocol.receive_eof()
        self._take_events()

    def connection_lost(self, error: Exception | None) -> None:
        """Note the end."""
        self._lose(str(error) if error else "the bridge closed the link")

    def _take_events(self) -> None:
        self._flush()
        for event in self._protocol.events_received():
            if isinstance(event, Response):
                self._shake_hands()
            elif isinstance(event, Frame) and not self._over:
                self._hear(event)
        if self._protocol.handshake_exc is not None:
            self.abort(f"no WebSocket there: {self._protocol.handshake_exc}")
        elif self._protocol.close_expected() and self._transport is not None:
            self._transport.close()

    def _shake_hands(self) -> None:
        if self._protocol.handshake_exc is None and not self.opened.done():
            self.opened.set_result(None)

    def _hear(self, frame: Frame) -> None:
        if frame.opcode is Opcode.PONG:
            self.ears.pong(bytes(frame.data))
        elif frame.opcode in (Opcode.TEXT, Opcode.BINARY, Opcode.CONT):
            self._parts.append(bytes(frame.data))
            if frame.fin:
                text, self._parts = b"".join(self._parts), []
                self.ears.text(text)

    def _flush(self, until: float = math.inf) -> bool:
        """Hand over what the protocol has to say, unless that is too old."""
        assert self._transport is not None
        waiting = self._protocol.data_to_send()
        if now() > until:
            return False
        for data in waiting:
            if data:
                self._transport.write(data)
            elif self._transport.can_write_eof():
                self._transport.write_eof()
        return True

    def _lose(self, why: str) -> None:
        if self._over:
            return
        self._over = True
        if not self.opened.done():
            self.opened.set_exception(BridgeClosed(f"{self.url}: {why}"))
        elif not self.opened.cancelled():  # given up before it was open
            self.ears.lost(why)


async def open_socket(url: str, ears: Ears) -> Socket:
    """Connect to a bridge.

    Raises:
        BridgeClosed: If that does not succeed in time.

    """
    uri = parse_uri(url)
    made = Socket(url, ears)
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
