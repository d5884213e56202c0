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
from webmap.gate.events import Event, LatchKept, LockState, StopRecord, StopTestKept
from webmap.gate.records import Records


class Disk:
    """Does what the decisions ask for on the disk.

    Args:
        records: The files.

    """

    def __init__(self, records: Records) -> None:
        self._records = records
        self._thread = ThreadPoolExecutor(1, "gate-disk")
        self._under_way: set[asyncio.Future[Event]] = set()

    def recall(self, state: LockState) -> LockState:
        """Return ``state`` with what is known of its machine from before."""
        return dataclasses.replace(
            state,
            latched_by=self._records.latch_of(state.key),
            tested=self._records.stop_test_of(state.key),
        )

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
            error = self._records.keep_latch(action.key, action.by)
            return LatchKept(action.key, action.number, error)
        today = datetime.datetime.now().astimezone().date().isoformat()
        record = StopRecord(action.seconds, today)
        self._records.keep_stop_test(action.key, record)
        return StopTestKept(action.key, record)
