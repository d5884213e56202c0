"""Regular looks at the states of all robots, with one timer for many robots."""

import asyncio
import logging
from collections import deque
from collections.abc import Callable

from webmap.base.looking import RARELY, looking

log = logging.getLogger("webmap.robot")

EVERY = 0.5
"""Seconds between two looks at a robot while somebody looks at the pages."""

AT_ONCE = 50
"""Most robots at which it looks at once: more would delay a frame."""


class StateRounds:
    """Looks at all robots in turn.

    A lost robot sends no message, so its state is found by looking. With a timer for
    each of a thousand robots, waking up would cost more than the looks.
    """

    def __init__(self) -> None:
        self._loop: asyncio.AbstractEventLoop
        self._looks: deque[Callable[[], None]] = deque()
        """A function that looks at a robot, for each; the next one first."""
        self._timer: asyncio.TimerHandle | None = None
        looking.follow(self)

    def join(self, look: Callable[[], None]) -> bool:
        """Call ``look`` regularly in the running event loop.

        Returns:
            Whether a loop runs; without one, nothing is done.

        """
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:
            return False
        if self._looks and loop is not self._loop:  # WebMap was started again
            self._looks.clear()
            self._timer = None
        self._loop = loop
        self._looks.append(look)
        if self._timer is None:
            self._wait(loop, 1)
        return True

    def leave(self, look: Callable[[], None]) -> None:
        """Call ``look`` no more; does nothing if it is not called."""
        if look in self._looks:
            self._looks.remove(look)
        if not self._looks and self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def looking_changed(self) -> None:
        """Look more often for who begins to look."""
        timer = self._timer
        if looking.somebody and timer is not None and not self._loop.is_closed():
            timer.cancel()
            self._wait(self._loop, AT_ONCE)

    def _wait(self, loop: asyncio.AbstractEventLoop, count: int) -> None:
        """Set the timer, after the looks at some robots."""
        every = EVERY if looking.somebody else RARELY / 1000
        part = min(1.0, count / len(self._looks))
        self._timer = loop.call_later(every * part, self._look, loop)

    def _look(self, loop: asyncio.AbstractEventLoop) -> None:
        self._timer = None
        count = min(AT_ONCE, len(self._looks))
        for _ in range(count):
            if self._looks:  # a module may have destroyed robots
                look = self._looks.popleft()
                self._looks.append(look)
                try:
                    look()
                except Exception:
                    log.exception("the state of a robot was not updated")
        if self._looks and self._timer is None:
            self._wait(loop, count)


state_rounds = StateRounds()
"""The rounds of this process."""
