"""Queues of messages to a page, and how other threads fill them.

The only I/O here is to wake the event loop of the sockets.
"""

import asyncio
import logging
import time
import weakref
from collections import deque
from collections.abc import Callable
from functools import partial
from typing import ClassVar

from webmap.core.pictures import KEY, MOST_PACKET_BYTES, MOST_PACKETS

log = logging.getLogger("webmap.server")

FRAMES = 8
FRAME_BYTES = 1024 * 1024
MESSAGES = 1024
MESSAGE_BYTES = 1024 * 1024

LATE_S = 0.5
"""The age in seconds of an unanswered picture of a video at which no more are sent."""

_TICK = '{"op":"tick"'


class FrameQueue:
    """Frames of the scene, in order: up to 8, and together up to 1 MiB.

    The page acknowledges frames, so a full queue means that the page misbehaves. A
    single waiting frame may have any size: the first one holds the whole scene.
    """

    most: ClassVar = FRAMES
    most_bytes: ClassVar = FRAME_BYTES

    def __init__(self) -> None:
        self._waiting: deque[bytes | str] = deque()
        self._size = 0

    def put(self, item: bytes | str) -> bool:
        """Add an item; return False if the queue is full."""
        size = self._size + len(item)
        full = len(self._waiting) >= self.most or size > self.most_bytes
        if self._waiting and full:
            return False
        self._waiting.append(item)
        self._size = size
        return True

    def pop(self) -> bytes | str | None:
        """Return the oldest item; None if the queue is empty."""
        if not self._waiting:
            return None
        item = self._waiting.popleft()
        self._size -= len(item)
        return item


class DriveQueue(FrameQueue):
    """Messages of the gate: the newest tick before all others, which are in order.

    A newer tick replaces a waiting one. The gate's reports and refusals are never left
    out.
    """

    most = MESSAGES
    most_bytes = MESSAGE_BYTES

    _tick: str | None = None

    def put(self, item: bytes | str) -> bool:
        """Add a message; return False if the queue is full."""
        if isinstance(item, str) and item.startswith(_TICK):
            self._tick = item
            return True
        return super().put(item)

    def pop(self) -> bytes | str | None:
        """Return the waiting tick, otherwise the oldest message, otherwise None."""
        tick, self._tick = self._tick, None
        return super().pop() if tick is None else tick


class VideoQueue:
    """The pictures of one video for one page, which answers how many it has received.

    A page with an old unanswered picture is late: its pictures wait. The next key
    picture replaces all that wait. If too many wait, they are dropped, and all until
    the next key picture.

    Args:
        now: Returns monotonic seconds.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self._now = now
        self._note: str | None = None
        self._waiting: deque[bytes] = deque()
        self._size = 0
        self._skips = False
        self._answered = 0
        self._sent: deque[float] = deque()
        """When each unanswered picture was sent."""

    def put(self, item: bytes | str) -> bool:
        """Add a picture, or a note in place of the one that waits; return True."""
        if isinstance(item, str):
            self._note = item
            return True
        size = self._size + len(item)
        starts = item[0] == KEY
        full = len(self._waiting) > MOST_PACKETS or size > 2 * MOST_PACKET_BYTES
        if starts or full:
            self._waiting.clear()
            self._size, self._skips = 0, not starts
        if not self._skips:
            self._waiting.append(item)
            self._size += len(item)
        return True

    def pop(self) -> bytes | str | None:
        """Return the note, otherwise the oldest picture unless the page is late."""
        if self._note is not None:
            note, self._note = self._note, None
            return note
        now = self._now()
        late = self._sent and now - self._sent[0] > LATE_S
        if not self._waiting or late:
            return None
        item = self._waiting.popleft()
        self._size -= len(item)
        self._sent.append(now)
        return item

    def answer(self, text: str) -> None:
        """Note how many pictures the page has received in all."""
        number = int(text) if text.isdecimal() and len(text) < 16 else 0
        while self._answered < number and self._sent:
            self._sent.popleft()
            self._answered += 1


class BatchedCalls:
    """Calls functions in one event loop, in order, waking it once for many.

    A tick of the model offers frames to every viewer: fifty wake-ups would cost more
    than the frames.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = weakref.ref(loop)
        self._calls: deque[Callable[[], object]] = deque()
        self._woken = False

    def call(self, fn: Callable[..., object], /, *args: object) -> None:
        """Schedule a call from any thread; does nothing if the loop has ended."""
        self._calls.append(partial(fn, *args))
        # Set after appending and cleared before draining, so no call is left behind.
        if self._woken:
            return
        self._woken = True
        loop = self._loop()
        try:
            if loop is None:
                raise RuntimeError("the loop is gone")
            loop.call_soon_threadsafe(self._drain)
        except RuntimeError:
            self._calls.clear()
            self._woken = False

    def _drain(self) -> None:
        self._woken = False
        for _ in range(len(self._calls)):
            try:
                self._calls.popleft()()
            except Exception:
                log.exception("a message to a page failed")


class BatchedCallsByLoop:
    """One :class:`BatchedCalls` for each event loop that serves."""

    def __init__(self) -> None:
        self._by_loop: weakref.WeakKeyDictionary[
            asyncio.AbstractEventLoop, BatchedCalls
        ] = weakref.WeakKeyDictionary()

    def of_this_loop(self) -> BatchedCalls:
        """Return the object for the running loop."""
        loop = asyncio.get_running_loop()
        if loop not in self._by_loop:
            self._by_loop[loop] = BatchedCalls(loop)
        return self._by_loop[loop]
