"""Keeps what must outlive the process, without anything waiting for the disk.

A disk may take a second to say that it has something; a robot that is to be stopped
meanwhile cannot wait for that. So a thread does it, one thing after the other, and an
event tells when it is done.
"""

import asyncio
import dataclasses
import datetime
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from webmap.gate.actions import KeepLatch, KeepStopTest
from webmap.gate.events import (
    Event,
    Key,
    LatchKept,
    LatchSeen,
    LockState,
    StopRecord,
    StopTestKept,
)
from webmap.gate.kept.records import Records


class Disk:
    """Does what the decisions ask for on the disk.

    Args:
        records: The files.

    """

    def __init__(self, records: Records) -> None:
        self._records = records
        self._thread = ThreadPoolExecutor(1, "gate-disk")
        self._under_way: set[asyncio.Future[Event]] = set()
        self._stamps: dict[Key, tuple[int, int] | None] = {}

    def recall(self, state: LockState) -> LockState:
        """Return ``state`` with what is known of its machine from before."""
        # Asked for again and again while another gate has the machine.
        if state.key not in self._stamps:
            self._stamps[state.key] = self._records.stamp_of(state.key)
        return dataclasses.replace(
            state,
            latched=self._records.latch_of(state.key),
            tested=self._records.stop_test_of(state.key),
        )

    def forget(self, key: Key) -> None:
        """Look at the files of a machine no longer."""
        self._stamps.pop(key, None)

    async def look(self) -> list[LatchSeen]:
        """Return the STOPs whose files are others than when they were looked at last.

        In the same thread as :meth:`keep`, so that what was kept before is seen, and
        what is kept after is not.
        """
        loop = asyncio.get_running_loop()
        return await loop.run_in_executor(self._thread, self._look)

    def _look(self) -> list[LatchSeen]:
        seen = []
        for key, before in list(self._stamps.items()):
            stamp = self._records.stamp_of(key)
            if stamp != before and key in self._stamps:
                self._stamps[key] = stamp
                seen.append(LatchSeen(key, self._records.latch_of(key)))
        return seen

    def keep(
        self, action: KeepLatch | KeepStopTest, tell: Callable[[Event], None]
    ) -> None:
        """Keep something; ``tell`` hears of it when the disk has it."""
        loop = asyncio.get_running_loop()
        work = loop.run_in_executor(self._thread, self._do, action)
        self._under_way.add(work)

        def done(work: asyncio.Future[Event]) -> None:
            self._under_way.discard(work)
            if not work.cancelled():
                tell(work.result())

        work.add_done_callback(done)

    async def settle(self) -> None:
        """Wait until the disk has everything."""
        if self._under_way:
            await asyncio.wait(self._under_way)

    def _do(self, action: KeepLatch | KeepStopTest) -> Event:
        if isinstance(action, KeepLatch):
            error = self._records.keep_latch(action.key, action.press, action.ids)
            if action.key in self._stamps:
                # What another gate does from here on is news, also what it did while
                # the disk took its time to take the file away.
                stands = action.press is not None
                kept = self._records.stamp_of(action.key) if stands else None
                self._stamps[action.key] = kept
            return LatchKept(action.key, action.number, error)
        today = datetime.datetime.now().astimezone().date().isoformat()
        record = StopRecord(action.seconds, today)
        self._records.keep_stop_test(action.key, record)
        return StopTestKept(action.key, record)
