"""The gate is not kept waiting for a processor, where it may ask for that."""

import os
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest
from gate_robot import eventually

from webmap.gate import process
from webmap.gate.display.client import GateClient

linux = pytest.mark.skipif(sys.platform != "linux", reason="Linux's way to say it")


def in_a_thread(fn):
    """Call it where what it changes ends with the thread."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(fn).result()


def policies_of_threads(pid):
    return {
        os.sched_getscheduler(int(thread)) for thread in os.listdir(f"/proc/{pid}/task")
    }


@linux
def test_a_thread_that_may_runs_before_what_is_not_urgent_as_do_those_it_starts():
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
def test_one_that_may_not_goes_on_as_one_among_all(monkeypatch):
    def refuse(*_):
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    assert not in_a_thread(process.rise)


def test_another_system_is_not_asked(monkeypatch):
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.delattr(os, "sched_setscheduler", raising=False)
    assert not in_a_thread(process.rise)


@linux
def test_all_of_the_gate_is_urgent_where_it_may_be_and_the_display_is_not():
    may = in_a_thread(process.rise)
    client = GateClient()
    client.start()
    try:
        eventually(lambda: client.ready, "a gate")
        pid = client.pid
        wanted = {os.SCHED_RR if may else os.SCHED_OTHER}
        eventually(lambda: policies_of_threads(pid) == wanted, "its priority")
        assert policies_of_threads(os.getpid()) == {os.SCHED_OTHER}
    finally:
        client.stop()
