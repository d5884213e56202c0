"""Playing of a recording at a given rate, from its beginning or any other time."""

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable

from webmap.bags.recording import Recorded, Recording
from webmap.bags.replay import Replay
from webmap.bags.times import SECOND, Pace
from webmap.base.errors import ConfigError

log = logging.getLogger("webmap.bags")

STATUS_PERIOD = 0.5
"""Seconds between two status messages with the position in the recording."""

SLOWEST, FASTEST = 0.001, 1000.0
"""The least and the greatest rate."""

ROUND = 1.0
"""Least seconds from one round to the next; a recording may be one message."""

SOON = 1_000_000
"""Nanoseconds that are too short to wait for."""


def steady_clock() -> Callable[[], int]:
    """Return a clock in nanoseconds since 1970 that ignores changes of the time."""
    since = time.time_ns() - time.monotonic_ns()
    return lambda: since + time.monotonic_ns()


class Player:
    """Plays a recording for all subscribers.

    Args:
        recording: The recording.
        rate: Seconds of the recording that are played per second, from 0.001 to 1000.
        start: The position where the playing begins, in seconds.
        loop: Whether to play again from the beginning after the end.
        now: Returns the time in nanoseconds since 1970.

    Raises:
        ConfigError: If the recording is shorter than ``start``, or the rate is invalid.

    """

    def __init__(
        self,
        recording: Recording,
        *,
        rate: float = 1.0,
        start: float = 0.0,
        loop: bool = False,
        now: Callable[[], int] | None = None,
    ) -> None:
        if not SLOWEST <= rate <= FASTEST:
            raise ConfigError(
                f"a rate is a number from {SLOWEST:g} to {FASTEST:g}, got {rate:g}"
            )
        if not 0 <= start < recording.seconds:
            raise ConfigError(
                f"{recording.name} is {recording.seconds:.1f} s long, so it cannot be "
                f"played from {start:g} s on"
            )
        self._now = now or steady_clock()
        self.replay = Replay(recording, clock=lambda: self._now() / SECOND)
        self._recording = recording
        self._rate = rate
        self._loop = loop
        self._first = recording.begin + round(start * SECOND)
        self._pace = Pace(self._first, self._now(), rate)
        self._kept: list[Recorded] | None = None
        self._over = False
        self._ended = False
        self._late = False
        self._again = False
        self._woken = asyncio.Event()

    @property
    def status(self) -> str:
        """The name, position and rate of the recording, for people."""
        recording = self._recording
        at = (self._pace.at(self._now()) - recording.begin) / SECOND
        at = min(max(at, 0.0), recording.seconds)
        speed = "" if self._rate == 1 else f", {self._rate:g} times as fast"
        if self._ended:
            return f"Recording {recording.name}: ended after {recording.seconds:.1f} s"
        length = f"{recording.seconds:.1f} s"
        return f"Recording {recording.name}: {at:.1f} of {length}{speed}"

    def begin_anew(self) -> None:
        """Go back to where the playing began."""
        self._again = True
        self._woken.set()

    async def run(self) -> None:
        """Play until cancelled; playing begins with the first subscription."""
        await self.replay.graph.subscribed.wait()
        async with asyncio.TaskGroup() as group:
            group.create_task(self._publish_status())
            group.create_task(self._play_rounds())

    async def _play_rounds(self) -> None:
        while True:
            self._again, self._ended = False, False
            self._woken.clear()
            self._pace = Pace(self._first, self._now(), self._rate)
            self.replay.publish_status(
                self.status
            )  # first, as poses jump in a new round
            soonest = self._now() + round(ROUND * SECOND)
            try:
                await self._once()
            except ConfigError as error:
                log.error("%s; the rest of the recording is not played", error)
            if self._again:
                continue
            if self._loop:
                end = self._pace.due(self._recording.end)
                if await self._until(max(end, soonest)):
                    continue
            if not self._again:
                self._ended = True
                await self._woken.wait()

    async def _once(self) -> None:
        if self._kept is None:
            self._kept = await self._read_kept()
            self._pace = Pace(self._first, self._now(), self._rate)
        for recorded in self._kept:
            self.replay.publish(recorded, self._pace)
        for recorded in self._recording.messages(self._first):
            if not await self._until(self._pace.due(recorded.time)):
                return
            self.replay.publish(recorded, self._pace)

    async def _read_kept(self) -> list[Recorded]:
        """Read the earlier messages to keep, in a thread, since it may take long."""
        reading = asyncio.create_task(asyncio.to_thread(self._kept_of_before))
        try:
            return await asyncio.shield(reading)
        except asyncio.CancelledError:
            self._over = True
            await asyncio.wait([reading])  # the file is closed afterwards
            raise

    def _kept_of_before(self) -> list[Recorded]:
        kept = self._recording.kept_until(self._first, lambda: not self._over)
        return list(kept)

    async def _until(self, due: int) -> bool:
        """Wait until a message is due; return whether it is still to be played."""
        wait = due - self._now()
        if wait < -SECOND:
            self._pace.put_off(-wait)
            if not self._late:
                self._late = True
                log.warning(
                    "this computer is too slow for this rate: messages are played late"
                )
        if wait < SOON:
            await asyncio.sleep(0)  # let the subscribers run
            return not self._again
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(wait / SECOND):
                await self._woken.wait()
        return not self._again

    async def _publish_status(self) -> None:
        while True:
            self.replay.publish_status(self.status)
            await asyncio.sleep(STATUS_PERIOD)
