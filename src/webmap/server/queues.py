"""What waits to be sent to one page: decisions without I/O."""

from collections import deque
from typing import Protocol

FRAMES = 8
FRAME_BYTES = 1024 * 1024
MESSAGES = 1024
MESSAGE_BYTES = 1024 * 1024

_TICK = '{"op":"tick"'


class Queue(Protocol):
    """A bounded queue of finished messages."""

    def put(self, item: bytes | str) -> bool:
        """Take one; False if there is no room, and the page must go."""

    def pop(self) -> bytes | str | None:
        """Return what is sent next; None if nothing waits."""


class FrameQueue:
    """Frames of the scene, in order: up to 8, and together up to 1 MiB.

    The page acknowledges frames, so that a queue that fills belongs to one that does
    not behave. A frame that waits alone may have any size: the first one holds the
    whole scene.
    """

    def __init__(self) -> None:
        self._waiting: deque[bytes | str] = deque()
        self._size = 0

    def put(self, item: bytes | str) -> bool:
        """Take a frame; False if there is no room."""
        size = self._size + len(item)
        if self._waiting and (len(self._waiting) >= FRAMES or size > FRAME_BYTES):
            return False
        self._waiting.append(item)
        self._size = size
        return True

    def pop(self) -> bytes | str | None:
        """Return the oldest frame; None if nothing waits."""
        if not self._waiting:
            return None
        item = self._waiting.popleft()
        self._size -= len(item)
        return item


class DriveQueue:
    """Messages of the gate: the newest tick before all, the others in order.

    A tick that waits is worth nothing once there is a newer one; what the gate says
    of a robot, or refuses, is never left out.
    """

    def __init__(self) -> None:
        self._tick: bytes | str | None = None
        self._waiting: deque[bytes | str] = deque()
        self._size = 0

    def put(self, item: bytes | str) -> bool:
        """Take a message; False if there is no room."""
        if isinstance(item, str) and item.startswith(_TICK):
            self._tick = item
            return True
        size = self._size + len(item)
        if len(self._waiting) >= MESSAGES or size > MESSAGE_BYTES:
            return False
        self._waiting.append(item)
        self._size = size
        return True

    def pop(self) -> bytes | str | None:
        """Return the tick that waits, else the oldest message, else None."""
        if self._tick is not None:
            item, self._tick = self._tick, None
            return item
        if not self._waiting:
            return None
        item = self._waiting.popleft()
        self._size -= len(item)
        return item
