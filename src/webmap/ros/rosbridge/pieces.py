"""Cuts the bytes of a WebSocket into pieces that are cheap to process. No I/O.

256 KiB, which asyncio reads at once, may be 128,000 frames. So the bytes are passed on
frame by frame, and those of a long frame in parts.

Of a frame that is longer than any message may be, only the beginning is passed on. A
map that is too large would otherwise end the connection, and, since it is sent again on
the next one, take the robot's odometry away for good.
"""

from webmap.ros.limits import MAX_FRAME

PIECE = (1 << 16) - 1
"""The longest piece, in bytes."""

_TWO, _EIGHT = 126, 127
"""Length values that state how many further bytes hold the length."""

SHORTENED = b"\0shortened\0"
"""The start of a message that replaces a longer one: its length in 8 bytes and its
first bytes follow. No message of rosbridge begins like this.
"""

KEPT = 1024
"""Bytes of a message that is too long that are passed on; the topic is among them."""

_WHOLE = (0x81, 0x82)
"""The first byte of a frame that is a whole message, as text or binary."""

_FIN = 0x80
"""The bit of a head's first byte that ends a message."""

_MASK = 0x80
"""The bit of a head's second byte that no server sets."""

_CONTINUATION = 0
"""The opcode of each fragment but the first."""


class Pieces:
    """Cuts the bytes of one bridge."""

    def __init__(self) -> None:
        self._rest = 0
        """Missing bytes of the current frame."""
        self._long = False
        """Whether the current frame is passed on as several."""
        self._fin = self._opcode = 0
        self._unwanted = 0
        """Bytes to drop: the rest of a frame that is too long."""

    def next(self, waiting: bytearray, *, shaken: bool) -> int:
        """Return the length of the next piece; 0 if it is incomplete.

        Args:
            waiting: The bytes that wait; the piece is at their beginning.
            shaken: Whether the handshake has ended. Before that, each line is a piece.

        """
        if not shaken:
            return waiting.find(b"\n") + 1 or len(waiting)
        if self._rest == 0:
            self._rest = _size_of_frame(waiting)
        size = min(self._rest, len(waiting), PIECE)
        self._rest -= size
        return size

    def take(self, waiting: bytearray, *, shaken: bool) -> bytes:
        """Remove the next piece from ``waiting`` and return it; empty if incomplete.

        A long frame becomes several, since a message may come in fragments (RFC 6455,
        section 5.4). A reader of one long frame would have to copy it at once.

        Args:
            waiting: The bytes that wait.
            shaken: Whether the handshake has ended.

        """
        if self._unwanted:
            dropped = min(self._unwanted, len(waiting))
            del waiting[:dropped]
            self._unwanted -= dropped
        if shaken and self._rest == 0:
            short = self._shorten(waiting)
            if short is not None:
                return short
            self._begin(waiting)
        if self._long:
            return self._fragment(waiting)
        return _cut(waiting, self.next(waiting, shaken=shaken))

    def _shorten(self, waiting: bytearray) -> bytes | None:
        """Return a short frame for one that is too long, empty if it is incomplete.

        None for every other frame.
        """
        head, length = _head(waiting)
        if length <= MAX_FRAME or waiting[0] not in _WHOLE or waiting[1] & _MASK:
            return None
        if len(waiting) < head + KEPT:
            return b""
        first = waiting[0]
        del waiting[:head]
        message = SHORTENED + length.to_bytes(8, "big") + _cut(waiting, KEPT)
        self._unwanted = length - KEPT
        return bytes([first, _TWO]) + len(message).to_bytes(2, "big") + message

    def _begin(self, waiting: bytearray) -> None:
        head, length = _head(waiting)
        # The receiver refuses a frame that is too long or masked by its head.
        if PIECE < length <= MAX_FRAME and not waiting[1] & _MASK:
            self._long, self._rest = True, length
            self._fin, self._opcode = waiting[0] & _FIN, waiting[0] & ~_FIN
            del waiting[:head]

    def _fragment(self, waiting: bytearray) -> bytes:
        size = min(self._rest, PIECE)
        if len(waiting) < size:
            return b""
        self._rest -= size
        self._long = self._rest > 0
        first = self._opcode | (0 if self._long else self._fin)
        self._opcode = _CONTINUATION
        length = bytes([size]) if size < _TWO else bytes([_TWO, size >> 8, size & 0xFF])
        return bytes([first]) + length + _cut(waiting, size)


def _cut(waiting: bytearray, size: int) -> bytes:
    piece = bytes(waiting[:size])
    del waiting[:size]
    return piece


def _size_of_frame(waiting: bytearray) -> int:
    """Return the length of the frame that begins here; 0 if its head is incomplete."""
    return sum(_head(waiting))


def _head(waiting: bytearray) -> tuple[int, int]:
    """Return the lengths of a frame's head and payload; 0 if the head is incomplete."""
    if len(waiting) < 2:
        return 0, 0
    length = waiting[1] & 0x7F
    further = {_TWO: 2, _EIGHT: 8}.get(length, 0)
    head = 2 + further
    if len(waiting) < head:
        return 0, 0
    return head, int.from_bytes(waiting[2:head], "big") if further else length
