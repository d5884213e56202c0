"""When frames are made for the pages, and poses that wait for them."""

import logging
import math
import time
from collections.abc import Callable

from webmap.scene.node import frame_request

log = logging.getLogger("webmap")

SHARE = 0.4
"""The part of a core that poses and the making of frames may take; then frames come
less often."""

LONGEST = 1.0
"""The longest time between frames for that reason, in seconds."""

EACH, SLOW = 0.0025, 0.05
"""Seconds between frames for each page, up to the time of 20 pages: all pages together
get at most 400 frames a second while there are fewer."""


class FramePace:
    """Decides when frames are made: at once after a change, then at a rate.

    A pose is processed when it arrives. While frames come less often than the poses of
    a robot, only the newest is processed, before the next frame: a viewer sees no more.

    All times are in seconds of one monotonic clock.
    """

    def __init__(self) -> None:
        self._begun = -math.inf
        self._cost = self._spent = self._pause = self._period = 0.0
        self._waiting: dict[Callable[[], object], None] = {}

    def due(self, rate: float) -> float:
        """Return the earliest time of the next frames.

        Args:
            rate: Frames a second, at most.

        """
        spent = min((self._cost + self._spent) / SHARE, LONGEST)
        self._period = max(1.0 / rate, self._pause, spent)
        return self._begun + self._period

    def made(self, begun: float, took: float, number: int) -> None:
        """Record frames that were made at the same time.

        Args:
            begun: When that began.
            took: The time to make them.
            number: The number of pages that got one; no frame delays no other.

        """
        if number:
            self._begun = begun
            self._cost = took
            self._pause = min(number * EACH, SLOW)
            self._spent = 0.0

    def end(self) -> None:
        """Set that nobody looks: process what waits, and let nothing wait."""
        self.prepare()
        self._begun, self._spent, self._period = -math.inf, 0.0, 0.0

    def process(
        self, processed_at: float, now: float, fn: Callable[[], object]
    ) -> None:
        """Call a function that processes a pose now, or before the next frames.

        Args:
            processed_at: When this function processed a pose last.
            now: The time.
            fn: The function; it is called once for all poses that wait.

        """
        if 0.0 <= now - processed_at < self._period:
            self._waiting[fn] = None
            frame_request.make()
        else:
            fn()
            if self._period:  # somebody looks
                self._spent += time.monotonic() - now

    def prepare(self) -> None:
        """Process the poses that wait."""
        waiting, self._waiting = self._waiting, {}
        for fn in waiting:
            try:
                fn()
            except Exception:
                log.exception("a pose was not processed")


frame_pace = FramePace()
"""The pace of this process."""
