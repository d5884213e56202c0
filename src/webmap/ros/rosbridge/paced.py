"""A WebSocket that reads its bytes in turns, so that a flood does not block the loop.

The ``websockets`` package processes at once all data that asyncio has read, which may
be 256 KiB and 128,000 frames, and only then stops reading.
"""

import asyncio
import math
import time

from websockets.asyncio.client import ClientConnection
from websockets.protocol import State

from webmap.ros.rosbridge.pieces import Pieces
from webmap.ros.rosbridge.turns import turns

MAX_WAITING = 1 << 20
"""Bytes that may wait for their turn; above that, reading stops."""


class PacedConnection(ClientConnection):
    """A connection that takes turns with the others of its loop."""

    bytes_came = -math.inf
    """When the last bytes came, by :func:`time.monotonic`."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start reading, and limit the messages by turns only."""
        super().connection_made(transport)
        self._turns = turns()
        self._pieces = Pieces()
        self._waiting = bytearray()
        self._reading = True
        # When too many messages wait for recv(), no more bytes are parsed.
        self.recv_messages.pause = lambda: None
        self.recv_messages.resume = self._ask

    def data_received(self, data: bytes) -> None:
        """Keep bytes until the connection has its turn."""
        self.bytes_came = time.monotonic()
        self._waiting += data
        if len(self._waiting) > MAX_WAITING and self._reading:
            self._reading = False
            self.transport.pause_reading()
        self._ask()

    def resume_writing(self) -> None:
        """Continue with bytes that may need an answer."""
        super().resume_writing()
        self._ask()

    def eof_received(self) -> None:
        """Process the last bytes, and the end of the stream."""
        while self._feed():
            pass
        super().eof_received()

    def take(self, until: float) -> float | None:
        """Process waiting bytes until the turn ends.

        Args:
            until: When to end, by :func:`time.thread_time`.

        Returns:
            Seconds until it needs another turn; ``None`` if it will ask for one.

        """
        while not (self.paused or self.recv_messages.paused):
            if not self._feed():
                if not self._reading:
                    self._reading = True
                    self.transport.resume_reading()
                break
            if time.thread_time() >= until:
                return 0.0
        return None

    def _ask(self) -> None:
        self._turns.ask(self)

    def _feed(self) -> bool:
        """Process one piece; return whether there was one."""
        shaken = self.protocol.state is not State.CONNECTING
        if self.protocol.state is State.CLOSED:
            return False
        piece = self._pieces.take(self._waiting, shaken=shaken)
        if piece:
            super().data_received(piece)
        return bool(piece)
