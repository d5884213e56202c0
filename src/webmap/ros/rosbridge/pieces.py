"""Cuts the bytes of a WebSocket of the gate into pieces. No I/O.

64 KiB, which are read at once, may be 32,000 frames. So the bytes are passed on
frame by frame, and those of a long frame in parts.
"""

PIECE = (1 << 16) - 1
"""The longest piece, in bytes."""

_TWO, _EIGHT = 126, 127
"""Length values that state how many further bytes hold the length."""


class Pieces:
    """Cuts the bytes of one bridge."""

    def __init__(self) -> None:
        self.head = 0
        """The length of the head, if the newest piece is a whole message; else 0."""
        self._rest = 0
        """Missing bytes of the current frame."""

    def next(self, waiting: bytearray, *, handshake_done: bool) -> int:
        """Return the length of the next piece; 0 if it is incomplete.

        Args:
            waiting: The bytes that wait; the piece is at their beginning.
            handshake_done: Whether the handshake has ended. Before that, each line is a
                piece.

        """
        self.head = head = 0
        if not handshake_done:
            return waiting.find(b"\n") + 1 or len(waiting)
        if self._rest == 0:
            head, length = _head(waiting)
            self._rest = head + length
        size = min(self._rest, len(waiting), PIECE)
        self._rest -= size
        # Text or binary in one frame, without a mask.
        if head and not self._rest and waiting[0] in (0x81, 0x82) and waiting[1] < 0x80:
            self.head = head
        return size


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
