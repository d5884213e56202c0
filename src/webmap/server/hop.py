"""The way from other threads into the web thread's event loop."""

import asyncio
import logging
import weakref
from collections import deque
from collections.abc import Callable
from functools import partial

log = logging.getLogger("webmap.server")


class Hop:
    """Calls functions in one event loop, in order, waking it once for many.

    A tick of the model offers frames to every viewer: fifty wake-ups would cost more
    than the frames.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = weakref.ref(loop)
        self._calls: deque[Callable[[], object]] = deque()
        self._woken = False

    def call(self, fn: Callable[..., object], /, *args: object) -> None:
        """Call ``fn`` soon; callable from any thread, nothing if the loop has ended."""
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


class Hops:
    """The one hop of each event loop that serves."""

    def __init__(self) -> None:
        self._hops: weakref.WeakKeyDictionary[asyncio.AbstractEventLoop, Hop] = (
            weakref.WeakKeyDictionary()
        )

    def here(self) -> Hop:
        """Return the hop into the running loop."""
        loop = asyncio.get_running_loop()
        if loop not in self._hops:
            self._hops[loop] = Hop(loop)
        return self._hops[loop]
