"""Where to cut the bytes of a WebSocket, so that each piece costs little. No I/O.

A quarter of a mebibyte, which is what asyncio reads at once, may be 128,000 frames. So
the bytes are handed on frame by frame, and those of a long frame in parts.
"""

from webmap.ros.limits import MAX_FRAME

PIECE = (1 << 16) - 1
"""The longest piece, in bytes."""

_TWO, _EIGHT = 126, 127
"""Lengths that say in how many further bytes the length stands."""

_FIN = 0x80
"""The bit of a head's first byte that ends a message."""

_MASK = 0x80
"""The bit of a head's second byte that no server sets."""

_CONTINUATION = 0
"""The opcode of each fragment but the first."""


class Pieces:
    """Cuts what one bridge sends."""

    def __init__(self) -> None:
        self._rest = 0
        """Bytes of the frame that was begun that are still to come."""
        self._long = False
        """Whether that frame is handed on as several."""
        self._fin = self._opcode = 0

    def next(self, waiting: bytearray, *, shaken: bool) -> int:
        """Return the length of the next piece; 0 if it has not all come yet.

        Args:
            waiting: The bytes that wait; what is returned is taken out of them.
            shaken: Whether the handshake has ended. Before, each line is a piece.

        """
        if not shaken:
            return waiting.find(b"\n") + 1 or len(waiting)
        if self._rest == 0:
            self._rest = _size_of_frame(waiting)
        size = min(self._rest, len(waiting), PIECE)
        self._rest -= size
        return size

    def take(self, waiting: bytearray, *, shaken: bool) -> bytes:
        """Cut the next piece off ``waiting``; empty if it has not all come yet.

        A long frame becomes several, as a message may come in fragments (RFC 6455,
        section 5.4). Who reads the long one has to copy it at once.

        Args:
            waiting: The bytes that wait.
            shaken: Whether the handshake has ended.

        """
        if shaken and self._rest == 0:
            self._begin(waiting)
        if self._long:
            return self._fragment(waiting)
        return _cut(waiting, self.next(waiting, shaken=shaken))

    def _begin(self, waiting: bytearray) -> None:
        head, length = _head(waiting)
        # What is too long, or masked, is refused by its head.
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
    """Return the length of the frame that begins here; 0 if its head is not whole."""
    return sum(_head(waiting))


def _head(waiting: bytearray) -> tuple[int, int]:
    """Return how long a frame's head and rest are; 0 if the head is not whole."""
    if len(waiting) < 2:
        return 0, 0
    length = waiting[1] & 0x7F
    further = {_TWO: 2, _EIGHT: 8}.get(length, 0)
    head = 2 + further
    if len(waiting) < head:
        return 0, 0
    return head, int.from_bytes(waiting[2:head], "big") if further else length
