"""A WebSocket whose bytes are dealt with in turns, so that a flood holds up nobody.

The ``websockets`` package deals at once with all that asyncio has read, which may be
256 KiB and 128,000 frames, and only then stops reading.
"""

import asyncio
import math
import time

from websockets.asyncio.client import ClientConnection
from websockets.protocol import State

from webmap.ros.rosbridge.pieces import Pieces
from webmap.ros.rosbridge.turns import turns

MAX_WAITING = 1 << 20
"""Bytes that may wait for their turn until no more are read."""


class PacedConnection(ClientConnection):
    """A connection that takes turns with the others of its loop."""

    bytes_came = -math.inf
    """When the last bytes came, by :func:`time.monotonic`."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin."""
        super().connection_made(transport)
        self._turns = turns()
        self._pieces = Pieces()
        self._waiting = bytearray()
        self._reading = True
        # When too many messages wait for recv(), no more are cut out of the bytes.
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
        """Go on with what may have to be answered."""
        super().resume_writing()
        self._ask()

    def eof_received(self) -> None:
        """Deal with the last bytes, and with their end."""
        while self._feed():
            pass
        super().eof_received()

    def take(self, until: float) -> float | None:
        """Deal with what waits, for as long as the turn lasts.

        Args:
            until: When to end, by :func:`time.thread_time`.

        Returns:
            Seconds until it wants another turn; ``None`` if it will ask for one.

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
        """Deal with one piece; return whether there was one."""
        shaken = self.protocol.state is not State.CONNECTING
        if self.protocol.state is State.CLOSED:
            return False
        piece = self._pieces.take(self._waiting, shaken=shaken)
        if piece:
            super().data_received(piece)
        return bool(piece)
