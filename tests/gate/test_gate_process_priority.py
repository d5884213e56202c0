"""The gate gets realtime priority where the system permits it."""

import math
import os
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import pytest

from equipment.waiting import wait_for
from webmap.gate import process
from webmap.gate.display import supervisor
from webmap.gate.display.client import GateClient

linux = pytest.mark.skipif(
    sys.platform != "linux", reason="needs the scheduler of Linux"
)


def in_a_thread(fn):
    """Call a function in a thread of its own, so that its changes end with it."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(fn).result()


def policies_of_threads(pid):
    policies = set()
    for task in Path(f"/proc/{pid}/task").glob("*"):
        with suppress(ProcessLookupError):  # the thread has just ended
            policies.add(os.sched_getscheduler(int(task.name)))
    return policies


@linux
def test_a_raised_thread_and_its_new_threads_get_realtime_priority():
    def rise():
        risen, policies = process.rise(), []
        thread = threading.Thread(
            target=lambda: policies.append(os.sched_getscheduler(0))
        )
        thread.start()
        thread.join()
        return risen, [os.sched_getscheduler(0), *policies]

    risen, policies = in_a_thread(rise)
    assert policies == [os.SCHED_RR if risen else os.SCHED_OTHER] * 2


@linux
def test_a_thread_with_permission_is_raised(monkeypatch):
    asked = []
    monkeypatch.setattr(os, "sched_setscheduler", lambda *asked_: asked.append(asked_))
    assert in_a_thread(process.rise)
    assert asked == [(0, os.SCHED_RR, os.sched_param(process.REAL_TIME))]


@linux
def test_a_thread_without_permission_keeps_the_normal_priority(monkeypatch):
    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    assert not in_a_thread(process.rise)


def test_the_priority_is_not_changed_on_other_systems_than_linux(monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.delattr(os, "sched_setscheduler", raising=False)
    assert not in_a_thread(process.rise)


@linux
def test_all_gate_threads_have_realtime_priority_but_the_display_does_not(monkeypatch):
    # The gate starts with the priority of the tests, which may be the lowest.
    monkeypatch.setattr(supervisor, "SLOW_START", math.inf)
    monkeypatch.setattr(supervisor, "HUNG", math.inf)
    may = in_a_thread(process.rise)
    usual = os.sched_getscheduler(0)  # the tests may be idle work
    client = GateClient()
    client.start()
    try:
        wait_for(lambda: client.ready, "a gate")
        wanted = {os.SCHED_RR if may else usual}
        wait_for(lambda: policies_of_threads(client.pid) == wanted, "its priority")
        # The thread that was raised above may still be ending.
        wait_for(lambda: os.SCHED_RR not in policies_of_threads(os.getpid()), "its end")
    finally:
        client.stop()
