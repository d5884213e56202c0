"""Reads the messages in the bytes of one WebSocket. No I/O.

Nearly every frame of a bridge is a whole message, and is read here alone. The
``websockets`` package gets everything else: the handshake, pings, pongs, the end of the
connection, and the head of each frame of another kind, to check their order.

Of a message in one frame that is longer than any message may be, only the beginning is
kept. A map that is too large would otherwise end the connection, and, since it is sent
again on the next one, take the robot's odometry away for good.
"""

import sys
from collections.abc import Callable

from webmap.base.errors import ProtocolError
from webmap.ros.limits import MAX_FRAME

PIECE = 1 << 16
"""Most bytes that are read in one step, unless they are a whole frame of this size."""

MOST_FRAGMENTS = 4096
"""Most frames of one message."""

SHORTENED = b"\0shortened\0"
"""The start of a message that replaces a longer one: its length in 8 bytes and its
first bytes follow. No message of a bridge begins like this.
"""

KEPT = 1024
"""Bytes of a message that is too long that are passed on; the topic is among them."""

_WHOLE = (0x81, 0x82)
"""The first byte of a frame that is a whole message, as text or binary."""

_FIN = 0x80
"""The bit of a head's first byte that ends a message."""

_DATA = (0, 1, 2)
"""A head's first byte without ``_FIN``, of a continuation, a text or binary data."""

_MASKED = 0x80
"""The bit of a head's second byte that no server sets."""

_TWO, _EIGHT = 126, 127
"""Lengths that mean that as many further bytes hold the length."""


class FrameReader:
    """The bytes of one WebSocket that were received and not read yet.

    Args:
        other: Called with all bytes that ``websockets`` has to read.

    """

    def __init__(self, other: Callable[[bytes], None]) -> None:
        self.message: Callable[[bytes | bytearray], None] = ignore
        """Called with each message, text or binary."""
        self.came_long = 0
        """Bytes of the newest message that was longer than a step."""
        self.handshake_done = False
        """Whether the handshake has ended. Before that, each line is a step."""
        self._other = other
        self._data: bytes | bytearray = b""
        self._at = 0
        """Where the unread bytes begin."""
        self._open: bytearray | None = None
        """What came of a message in several frames, or in a long one."""
        self._fragments = 0
        self._ends = False
        """Whether the current frame ends the open message."""
        self._rest = 0
        """Missing bytes of the current frame of the open message."""
        self._dropping = 0
        """Bytes to drop: the rest of a frame that is too long."""
        self._passing = 0
        """Bytes of the current frame that ``websockets`` has to read."""

    def __len__(self) -> int:
        return len(self._data) - self._at

    def feed(self, data: bytes) -> None:
        """Add received bytes."""
        if not len(self):
            self._data = data
        else:
            if isinstance(self._data, bytearray):
                del self._data[: self._at]  # moves no byte
            else:
                self._data = bytearray(memoryview(self._data)[self._at :])
            self._data += data
        self._at = 0

    def step(self) -> bool:
        """Read the next frame, or a part of a long one.

        Returns:
            False if more bytes must come first.

        Raises:
            ProtocolError: If a message is too long, or has too many frames.

        """
        data, at = self._data, self._at
        left = len(data) - at
        if self._rest or self._dropping or self._passing or not self.handshake_done:
            return left > 0 and self._go_on(left)
        if left < 2:
            if not left:
                self._data, self._at = b"", 0
            return False
        first, length, head = data[at], data[at + 1], 2
        if length == _TWO:
            head = 4
            if left < head:
                return False
            length = data[at + 2] << 8 | data[at + 3]
        elif length == _EIGHT:
            head = 10
            if left < head:
                return False
            length = int.from_bytes(data[at + 2 : at + head], "big")
        elif length & _MASKED:
            self._passing = 2  # enough for websockets to refuse it
            return True
        if first in _WHOLE and length <= PIECE and self._open is None:
            end = at + head + length
            if end > len(data):
                return False
            self._at = end
            self.message(bytes(data[at + head : end]))
        elif first & ~_FIN in _DATA:
            self._at += head
            self._begin(first, length)
        else:
            self._passing = head + length
        return True

    def _begin(self, first: int, length: int) -> None:
        """Begin a frame of a message in several frames, or a long one."""
        self._other(bytes([first, 0]))
        if self._open is None or first & ~_FIN:
            self._open, self._fragments = bytearray(), 0
        if length > MAX_FRAME and first in _WHOLE:
            self._open += SHORTENED + length.to_bytes(8, "big")
            self._dropping = length - KEPT
            length = KEPT
        self._fragments += 1
        if self._fragments > MOST_FRAGMENTS:
            raise self._refusal("too many fragments")
        if len(self._open) + length > MAX_FRAME:
            raise self._refusal(f"a message of more than {MAX_FRAME} bytes")
        self._rest, self._ends = length, bool(first & _FIN)
        if not length:
            self._end_frame(self._open)

    def _refusal(self, reason: str) -> ProtocolError:
        """Return an error after which ``websockets`` gets all bytes, to drop them."""
        self._open, self._passing = None, sys.maxsize
        return ProtocolError(reason)

    def _go_on(self, left: int) -> bool:
        """Read a part of what is longer than one step."""
        at = self._at
        if not self.handshake_done:
            self._at = self._data.find(b"\n", at) + 1 or len(self._data)
            self._other(bytes(self._data[at : self._at]))
        elif self._passing:
            size = min(self._passing, left, PIECE)
            self._passing -= size
            self._at += size
            self._other(bytes(self._data[at : at + size]))
        elif self._rest:
            assert self._open is not None
            size = min(self._rest, left, PIECE)
            self._rest -= size
            self._at += size
            self._open += memoryview(self._data)[at : at + size]
            if not self._rest:
                self._end_frame(self._open)
        else:
            size = min(self._dropping, left)
            self._dropping -= size
            self._at += size
        return True

    def _end_frame(self, message: bytearray) -> None:
        if self._ends:
            self._open, self.came_long = None, len(message)
            self.message(message)


def whole_of(message: bytes | bytearray) -> tuple[int, bytes | bytearray]:
    """Return the length of a message that came shortened, and its first bytes.

    Raises:
        ProtocolError: If it is no such message.

    """
    start = len(SHORTENED) + 8
    size = int.from_bytes(message[len(SHORTENED) : start], "big")
    if size <= MAX_FRAME:
        raise ProtocolError("a frame that begins like a shortened one")
    return size, message[start:]


def ignore(_message: bytes | bytearray) -> None:
    """Drop a message, as long as nobody receives the messages."""
