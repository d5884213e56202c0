"""The disk is waited for by nobody, and tells when it has something."""

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


def test_what_is_kept_is_told_in_order_and_recalled(disk, tmp_path):
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


def test_with_nothing_under_way_it_is_settled_at_once(disk):
    asyncio.run(disk.settle())


def test_what_was_given_up_tells_nothing(disk):
    received = []

    async def scenario():
        disk.keep(SaveStop(KEY, 1, ANN, frozenset()), received.append)
        (work,) = disk._under_way
        work.cancel()
        await disk.settle()
        await asyncio.sleep(0)

    asyncio.run(scenario())
    assert received == []
