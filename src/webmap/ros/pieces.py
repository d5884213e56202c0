"""Where to cut the bytes of a WebSocket, so that each piece costs little. No I/O.

A quarter of a mebibyte, which is what asyncio reads at once, may be 128,000 frames. So
the bytes are handed on frame by frame, and those of a long frame in parts.
"""

PIECE = 1 << 16
"""The longest piece, in bytes."""

_TWO, _EIGHT = 126, 127
"""Lengths that say in how many further bytes the length stands."""


class Pieces:
    """Cuts what one bridge sends."""

    def __init__(self) -> None:
        self._rest = 0
        """Bytes of the frame that was begun that are still to come."""

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


def _size_of_frame(waiting: bytearray) -> int:
    """Return the length of the frame that begins here; 0 if its head is not whole."""
    if len(waiting) < 2:
        return 0
    length = waiting[1] & 0x7F
    further = {_TWO: 2, _EIGHT: 8}.get(length, 0)
    head = 2 + further
    if len(waiting) < head:
        return 0
    return head + (int.from_bytes(waiting[2:head], "big") if further else length)
