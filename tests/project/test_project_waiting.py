"""The waits of the tests: their value, their patience, and the message of a failure."""

import asyncio
import itertools
import time

import pytest

from equipment import waiting
from equipment.waiting import until, wait_for


def counted(polls: int):
    """Return a check that is true in the poll with this number."""
    numbers = itertools.count(1)
    return lambda: (number := next(numbers)) >= polls and f"poll {number}"


def test_a_wait_returns_the_true_value():
    assert wait_for(counted(3)) == "poll 3"
    assert asyncio.run(until(counted(3))) == "poll 3"


@pytest.mark.parametrize("wait", [wait_for, lambda *a: asyncio.run(until(*a))])
def test_a_failed_wait_names_the_condition_the_polls_and_the_time(wait):
    with pytest.raises(
        AssertionError, match=r"timed out waiting for a zero: 5 polls in [\d.]+ s"
    ):
        wait(lambda: False, "a zero", 5 * waiting.PAUSE)
    with pytest.raises(AssertionError, match="waiting for 1 of 2: 1 polls"):
        wait(lambda: False, lambda: "1 of 2", waiting.PAUSE)


def test_a_process_that_runs_late_polls_as_often(monkeypatch):
    now = time.monotonic()

    def oversleep(seconds):
        nonlocal now
        now += 100 * seconds

    monkeypatch.setattr(waiting.time, "sleep", oversleep)
    monkeypatch.setattr(waiting.time, "monotonic", lambda: now)
    assert wait_for(counted(100), seconds=1.0) == "poll 100"
    with pytest.raises(AssertionError, match=r"100 polls in 100\.0 s"):
        wait_for(counted(101), seconds=1.0)
