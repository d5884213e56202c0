"""A lease that its driver has forgotten expires, so that nobody waits for it."""

import pytest
from gate_harness import Bench, spec

from webmap.gate import commands, protocol
from webmap.gate.rules import authority

UNUSED = 15.0
"""Seconds here, since two minutes at 20 Hz take long even on a virtual clock."""


@pytest.fixture(autouse=True)
def soon(monkeypatch):
    monkeypatch.setattr(authority, "UNUSED", UNUSED)


@pytest.fixture
def bench():
    """A has the robot and shows open hands, as a page does as long as it lives."""
    bench = Bench().begin(spec(pose_topic="/initialpose"))
    bench.take("a")
    bench.hold(1.0)
    return bench


def held(bench):
    return bench.report().holder is not None


def test_a_lease_that_nothing_is_done_with_expires_and_its_holder_hears_why(
    bench, monkeypatch
):
    monkeypatch.undo()
    bench.hold(120 - 1.5)
    assert held(bench)
    bench.hold(1.0)
    assert not held(bench)
    assert bench.report().state == "free"
    refused = bench.refusals("a")[-2]
    assert (refused.what, refused.why) == ("lease", "not used for 120 s")


def test_it_expires_also_if_its_holder_hangs_and_says_nothing_at_all(bench):
    bench.run(UNUSED)
    assert not held(bench)


def test_what_its_old_driver_says_after_that_moves_nothing(bench):
    epoch = bench.report().epoch
    bench.hold(UNUSED)
    at = bench.now
    bench.hold(1.0, x=1.0, epoch=epoch)
    assert bench.moving_since(at) == []


@pytest.mark.parametrize("act", ["drives", "goal", "locate", "renew", "deny"])
def test_it_begins_anew_with_whatever_is_done_with_it(bench, act):
    bench.hold(UNUSED - 2.0)
    match act:
        case "drives":
            bench.hold(0.1, x=1.0)
        case "goal":
            bench.goal()
        case "locate":
            bench.goal(op="locate")
        case "renew":
            bench.say("a", op="renew", robot="r1", epoch=bench.report().epoch)
        case "deny":
            bench.say("b", op="ask", robot="r1")
            bench.say("a", op="deny", robot="r1")
    assert bench.refusals("a") == []
    bench.hold(UNUSED - 2.0)
    assert held(bench)
    bench.hold(3.0)
    assert not held(bench)


def test_only_the_lease_of_now_can_be_renewed(bench):
    epoch = bench.report().epoch
    bench.say("b", op="renew", robot="r1", epoch=epoch)
    assert bench.refusals("b")[-1].why == "A has control"
    bench.say("a", op="renew", robot="r1", epoch=epoch - 1)
    assert "expected 1, the epoch of the lease" in bench.refusals("a")[-1].why


def test_who_asks_for_it_gets_it_as_ever(bench):
    bench.hold(UNUSED - 2.0)
    bench.say("b", op="ask", robot="r1")
    bench.hold(12.0)
    assert bench.report().holder.connection == "b"


def test_a_programs_lease_stays_as_any_person_may_take_it():
    bench = Bench().begin()
    bench.tell(protocol.FromProgram(commands.Take("r1"), 1))
    bench.run(2 * UNUSED)
    assert held(bench)
