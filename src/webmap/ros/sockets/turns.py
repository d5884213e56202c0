"""Turns for the connections of one event loop, so that none of them blocks the rest.

Received data waits for the connection's turn. All connections together have a few
milliseconds, one after the other; then the loop does everything else, in the gate: the
messages of the display, the gate's step and its pings. With any amount of data, the
connections get half of the time.
"""

import asyncio
import math
import time
from typing import Protocol
from weakref import WeakKeyDictionary

STEP = 0.002
"""Seconds of processor time for all connections together, before the rest runs."""

SHARE = 0.0005
"""Seconds of processor time for one connection at a time, if others wait, too."""


class Turn:
    """The time that one connection has for its waiting data.

    Args:
        now: The processor time of this thread, in seconds.
        seconds: How much of it the connection may use.

    """

    __slots__ = ("_end", "_least", "_pause")

    def __init__(self, now: float, seconds: float) -> None:
        self._end = now + seconds
        self._pause = seconds / 4
        """The shortest time between two questions for the processor time."""
        self._least = time.monotonic() + seconds

    @property
    def is_over(self) -> bool:
        """Whether the time is used up.

        Processor time is asked of the system, which may take longer than a frame. It
        never runs faster than the clock, which costs much less to read.
        """
        now = time.monotonic()
        if now < self._least:
            return False
        left = self._end - time.thread_time()
        self._least = now + max(left, self._pause)
        return left <= 0


class Taker(Protocol):
    """An object that takes turns: a socket."""

    def take(self, turn: Turn) -> float | None:
        """Process waiting data.

        Args:
            turn: The turn; no frame is begun when it is over.

        Returns:
            Seconds until it needs another turn; ``None`` if it will ask for one.

        """


class Turns:
    """Gives turns within one event loop."""

    def __init__(self) -> None:
        self.longest_rest = math.inf
        """The longest rest after a step, in seconds; without it, that of the step."""
        self._queue: dict[Taker, None] = {}
        self._stepping = False

    def ask(self, taker: Taker) -> None:
        """Give ``taker`` a turn soon; a second request before that has no effect."""
        self._queue.setdefault(taker)
        if not self._stepping:
            self._stepping = True
            asyncio.get_running_loop().call_soon(self._step)

    def _step(self) -> None:
        begun = at = time.thread_time()
        loop = asyncio.get_running_loop()
        while self._queue and at < begun + STEP:
            taker, left = next(iter(self._queue)), begun + STEP - at
            del self._queue[taker]
            wait = taker.take(Turn(at, min(SHARE, left) if self._queue else left))
            if wait == 0:
                self._queue.setdefault(taker)
            elif wait is not None:
                loop.call_later(wait, self.ask, taker)
            if self._queue:
                at = time.thread_time()
        self._stepping = bool(self._queue)
        if self._stepping:
            rest = max(STEP, at - begun)
            loop.call_later(min(rest, self.longest_rest), self._step)


_turns: WeakKeyDictionary[asyncio.AbstractEventLoop, Turns] = WeakKeyDictionary()


def turns() -> Turns:
    """Return the turns of the running loop; all its connections share them."""
    return _turns.setdefault(asyncio.get_running_loop(), Turns())
