"""A WebSocket that reads its bytes in turns, so that a flood does not block the loop.

The ``websockets`` package processes at once all data that asyncio has read, which may
be 256 KiB and 128,000 frames, and passes each message through a queue to a task.
"""

import asyncio
import math
import socket
import time
from collections.abc import Callable
from contextlib import suppress
from contextvars import copy_context
from functools import partial

from websockets.asyncio.client import ClientConnection
from websockets.frames import DATA_OPCODES, CloseCode, Frame
from websockets.http11 import Request, Response
from websockets.protocol import State

from webmap.base.errors import ProtocolError
from webmap.ros.sockets.frame_reader import FrameReader, ignore
from webmap.ros.sockets.turns import SHARE, Turn, turns

MAX_WAITING = 1 << 20
"""Bytes that may wait for their turn; above that, reading stops."""

RATE = 128 << 20
"""Bytes per second of long messages read from a connection, on average."""

CLOSE_TIMEOUT = 0.5
"""Longest wait for the bridge to close its end, in seconds."""

REST = SHARE
"""The longest rest between the turns of all connections, in seconds.

The turns include the program's callbacks, which may need most of the time.
"""


class WebSocketConnection(ClientConnection):
    """A connection that takes turns with the others of its loop."""

    bytes_came = -math.inf
    """When the last bytes came, by :func:`time.monotonic`."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start reading."""
        super().connection_made(transport)
        self._turns = turns()
        self._turns.longest_rest = REST
        # The turns of several connections run in the context of one of them.
        self._context = copy_context()
        self._incoming = FrameReader(self._pass_on)
        self._delivers = False
        self._reading = True
        self._rests_until = 0.0
        self._lost = self._finished = False
        self._lost_by: Exception | None = None
        self._acknowledge: Callable[[], None] | None = None

    def acknowledge_at_once(self) -> None:
        """Acknowledge all bytes at once, where the system can.

        A server without ``TCP_NODELAY`` sends nothing small while the system delays the
        acknowledgement of earlier bytes, which Linux does for up to 40 ms.
        """
        peer = self.transport.get_extra_info("socket")
        if peer is not None and hasattr(socket, "TCP_QUICKACK"):
            self._acknowledge = partial(
                peer.setsockopt, socket.IPPROTO_TCP, socket.TCP_QUICKACK, 1
            )

    def deliver_to(self, receive: Callable[[bytes | bytearray], None]) -> None:
        """Call ``receive`` with each message; those that came before have waited."""
        self._incoming.message = receive
        self._delivers = True
        self._ask()

    def ignore_messages(self) -> None:
        """Drop all further messages."""
        self.deliver_to(ignore)

    def data_received(self, data: bytes) -> None:
        """Keep bytes until the connection has its turn."""
        self.bytes_came = time.monotonic()
        if self._acknowledge is not None:  # Linux forgets it after some packets
            with suppress(OSError):
                self._acknowledge()
        self._incoming.feed(data)
        if len(self._incoming) > MAX_WAITING and self._reading:
            self._reading = False
            self.transport.pause_reading()
        self._ask()

    def resume_writing(self) -> None:
        """Continue with bytes that may need an answer."""
        super().resume_writing()
        self._ask()

    def eof_received(self) -> None:
        """Let asyncio close the connection; earlier bytes are processed first."""

    def connection_lost(self, exc: Exception | None) -> None:
        """Note the end of the connection; earlier bytes are processed first."""
        self._lost, self._lost_by = True, exc
        if self._incoming:
            self._ask()
        else:
            self._finish()

    def send_data(self) -> None:
        """Write what the protocol has to send, unless the connection has ended."""
        if not self.transport.is_closing():
            super().send_data()

    def process_event(self, event: Request | Response | Frame) -> None:
        """Process what is no message; of messages only heads come here."""
        if not isinstance(event, Frame) or event.opcode not in DATA_OPCODES:
            super().process_event(event)

    def take(self, turn: Turn) -> float | None:
        """Process waiting bytes until the turn ends.

        Args:
            turn: The turn; no frame is begun when it is over.

        Returns:
            Seconds until it needs another turn; ``None`` if it will ask for one.

        """
        return self._context.run(self._take, turn)

    def _take(self, turn: Turn) -> float | None:
        rest = self._rests_until - time.monotonic()
        if rest > 0:
            return rest
        if self._finished:
            return None
        incoming = self._incoming
        while self._delivers or not incoming.handshake_done:
            if self.paused and not self._lost:
                break
            try:
                more = incoming.step()
            except ProtocolError as error:
                self._refuse(str(error))
                continue
            if not more:
                self._read_all()
                break
            if incoming.came_long:
                rest, incoming.came_long = incoming.came_long / RATE, 0
                self._rests_until = time.monotonic() + rest
                return rest
            if turn.is_over:
                return 0.0
        return None

    def _ask(self) -> None:
        self._turns.ask(self)

    def _pass_on(self, data: bytes) -> None:
        """Let ``websockets`` process bytes, and note what they change."""
        super().data_received(data)
        state = self.protocol.state
        self._incoming.handshake_done = state is not State.CONNECTING
        if state in (State.CLOSING, State.CLOSED):
            self._incoming.message = ignore

    def _refuse(self, reason: str) -> None:
        """Close the connection because of a message that is too long."""
        self.protocol.fail(CloseCode.MESSAGE_TOO_BIG, reason)
        self._pass_on(b"")
        self.loop.call_later(CLOSE_TIMEOUT, self.transport.abort)

    def _read_all(self) -> None:
        """Go on after all bytes that came."""
        if self._lost:
            self._finish()
        elif not self._reading:
            self._reading = True
            self.transport.resume_reading()

    def _finish(self) -> None:
        self._finished = True
        super().eof_received()
        super().connection_lost(self._lost_by)
