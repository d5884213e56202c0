"""What a display receives of one topic of an agent, as often as it needs it. No I/O."""

import asyncio
import math
import threading
import time
from collections.abc import Callable

RARE = 1.0
"""Seconds between two messages of a topic from which data waits without being read."""


class Heard:
    """A topic to which a connection listens, for all its subscriptions.

    An agent sends each message once to all displays, as often as that display needs it
    that needs it most. What this one needs rarely waits packed here, the newest only.

    Args:
        take: Takes a piece of data; called in the model's thread.
        loop: The model's loop.

    """

    def __init__(
        self, take: Callable[[bytes], None], loop: asyncio.AbstractEventLoop
    ) -> None:
        self.number: int | None = None
        """The number of the listener at the peer."""
        self._take = take
        self._loop = loop
        self._throttles: dict[str | None, float] = {}
        self._waits = 0.0
        self._due = -math.inf
        self._lock = threading.Lock()
        self._newest: bytes | None = None
        self._timer: asyncio.TimerHandle | None = None

    def subscribe(self, id: str | None, throttle: int) -> None:
        """Add a subscription that needs a message each ``throttle`` milliseconds."""
        self._throttles[id] = throttle / 1000
        self._pace()

    def unsubscribe(self, id: str | None) -> bool:
        """Remove a subscription; return whether none is left."""
        self._throttles.pop(id, None)
        if self._throttles:
            self._pace()
        return not self._throttles

    def arrived(self, _key: str, piece: bytes) -> None:
        """Pass data on, or keep it until it is due; called in a thread of Zenoh."""
        if self._loop.is_closed():
            return
        if self._waits < RARE:
            self._loop.call_soon_threadsafe(self._take, piece)
            return
        with self._lock:
            is_first, self._newest = self._newest is None, piece
        if is_first:
            self._loop.call_soon_threadsafe(self._wait)

    def _wait(self) -> None:
        if self._timer is None:
            after = max(0.0, self._due - time.monotonic())
            self._timer = self._loop.call_later(after, self.release)

    def release(self) -> None:
        """Pass on what waits."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        with self._lock:
            piece, self._newest = self._newest, None
        if piece is not None:
            self._due = time.monotonic() + self._waits
            self._take(piece)

    def forget(self) -> None:
        """Drop what waits: the connection or the subscription has ended."""
        with self._lock:
            self._newest = None
        self.release()

    def _pace(self) -> None:
        before, self._waits = self._waits, min(self._throttles.values())
        if self._waits < before:
            self._due = -math.inf
            self.release()
