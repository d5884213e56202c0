"""Work on the disk blocks no caller; its end is reported."""

import asyncio
import datetime

import pytest

from webmap.gate.actions import SaveStop, SaveStopTest
from webmap.gate.disk import Disk, Records
from webmap.gate.events import Key, LockState, Press, StopSaved, StopTestSaved

KEY = Key("ws://robot:9090", "/cmd_vel")
ANN = Press("Ann", "a1")


@pytest.fixture
def disk(tmp_path):
    return Disk(Records(tmp_path))


def test_saved_records_are_confirmed_in_order_and_can_be_recalled(disk, tmp_path):
    received = []

    async def scenario():
        disk.keep(SaveStop(KEY, 1, ANN, frozenset()), received.append)
        disk.keep(SaveStopTest(KEY, 0.4), received.append)
        assert received == []
        await disk.settle()
        await asyncio.sleep(0)

    asyncio.run(scenario())
    latched, tested = received
    assert latched == StopSaved(KEY, 1, None)
    assert isinstance(tested, StopTestSaved)
    assert tested.record.seconds == 0.4
    assert datetime.date.fromisoformat(tested.record.date)
    again = Disk(Records(tmp_path)).recall(LockState(KEY, held=True))
    assert (again.latched, again.tested) == (ANN, tested.record)


def test_settle_returns_at_once_without_pending_work(disk):
    asyncio.run(disk.settle())


def test_cancelled_work_reports_nothing(disk):
    received = []

    async def scenario():
        disk.keep(SaveStop(KEY, 1, ANN, frozenset()), received.append)
        (work,) = disk._under_way
        work.cancel()
        await disk.settle()
        await asyncio.sleep(0)

    asyncio.run(scenario())
    assert received == []
