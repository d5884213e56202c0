"""Turns for the links of one event loop, so that none of them holds up the rest.

What comes on a link waits for the link's turn. All links together have a few
milliseconds, one after the other; then the loop does everything else: in the gate what
the display says, the gate's step and its pings. However much comes, the links get half
of the time.
"""

import asyncio
import time
from collections import deque
from typing import Protocol
from weakref import WeakKeyDictionary

STEP = 0.002
"""Seconds of a processor for all links together, until the rest has its turn."""

SHARE = 0.0005
"""Seconds of a processor that a link has at a time."""


class Taker(Protocol):
    """What takes turns: a socket."""

    def take(self, until: float) -> float | None:
        """Deal with what waits.

        Args:
            until: When to end, by the clock of this thread's own time.

        Returns:
            Seconds until it wants another turn; ``None`` if it will ask for one.

        """


class Turns:
    """Gives turns within one event loop."""

    def __init__(self) -> None:
        self._queue: deque[Taker] = deque()
        self._stepping = False

    def ask(self, taker: Taker) -> None:
        """Give ``taker`` a turn soon; asking again before that does nothing."""
        if taker not in self._queue:
            self._queue.append(taker)
        if not self._stepping:
            self._stepping = True
            asyncio.get_running_loop().call_soon(self._step)

    def _step(self) -> None:
        begun = at = time.thread_time()
        loop = asyncio.get_running_loop()
        while self._queue and at < begun + STEP:
            taker = self._queue.popleft()
            wait = taker.take(min(at + SHARE, begun + STEP))
            if wait == 0:
                self._queue.append(taker)
            elif wait is not None:
                loop.call_later(wait, self.ask, taker)
            at = time.thread_time()
        self._stepping = bool(self._queue)
        if self._stepping:
            loop.call_later(max(STEP, at - begun), self._step)


_turns: WeakKeyDictionary[asyncio.AbstractEventLoop, Turns] = WeakKeyDictionary()


def turns() -> Turns:
    """Return the turns of the running loop, whose time all its links share."""
    return _turns.setdefault(asyncio.get_running_loop(), Turns())
