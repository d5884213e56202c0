"""An unused lease expires, so that other operators can take control."""

import pytest

from equipment.gate_harness import Bench, spec
from webmap.gate import commands, protocol
from webmap.gate.rules import authority

pytestmark = pytest.mark.slow

UNUSED = 15.0
"""Seconds here: two minutes at 20 Hz take long even on a virtual clock."""

LONG = {"step": 0.05}
"""The gate acts as often as the page sends, since nothing else happens meanwhile."""


@pytest.fixture(autouse=True)
def soon(monkeypatch):
    monkeypatch.setattr(authority, "UNUSED", UNUSED)


@pytest.fixture
def bench():
    """A bench where A has control and sends released inputs, as an open page does."""
    bench = Bench().begin(spec(pose_topic="/initialpose"))
    bench.take("a")
    bench.hold(1.0)
    return bench


def held(bench):
    return bench.report().holder is not None


@pytest.mark.slow
def test_an_unused_lease_expires_after_120_s_with_a_reason_for_its_holder(
    bench, monkeypatch
):
    monkeypatch.undo()
    bench.hold(120 - 1.5, **LONG)
    assert held(bench)
    bench.hold(1.0)
    assert not held(bench)
    assert bench.report().state == "free"
    refused = bench.refusals("a")[-2]
    assert (refused.what, refused.why) == ("lease", "not used for 120 s")


def test_a_lease_expires_when_the_page_of_its_holder_sends_nothing(bench):
    bench.run(UNUSED, **LONG)
    assert not held(bench)


def test_commands_with_an_expired_lease_do_not_move_the_robot(bench):
    epoch = bench.report().epoch
    bench.hold(UNUSED, **LONG)
    at = bench.now
    bench.hold(1.0, x=1.0, epoch=epoch)
    assert bench.moving_since(at) == []


@pytest.mark.slow
@pytest.mark.parametrize("act", ["drives", "goal", "locate", "renew", "deny"])
def test_every_use_of_the_lease_restarts_its_expiry_time(bench, act):
    bench.hold(UNUSED - 2.0, **LONG)
    match act:
        case "drives":
            bench.hold(0.1, x=1.0)
        case "goal":
            bench.goal()
        case "locate":
            bench.goal(op="locate")
        case "renew":
            bench.send("a", op="renew", robot="r1", epoch=bench.report().epoch)
        case "deny":
            bench.send("b", op="ask", robot="r1")
            bench.send("a", op="deny", robot="r1")
    assert bench.refusals("a") == []
    bench.hold(UNUSED - 2.0, **LONG)
    assert held(bench)
    bench.hold(3.0)
    assert not held(bench)


def test_only_the_holder_can_renew_the_lease_and_only_with_the_current_epoch(bench):
    epoch = bench.report().epoch
    bench.send("b", op="renew", robot="r1", epoch=epoch)
    assert bench.refusals("b")[-1].why == "A has control"
    bench.send("a", op="renew", robot="r1", epoch=epoch - 1)
    assert "changed: got epoch 0, expected 1" in bench.refusals("a")[-1].why


def test_an_operator_who_requests_control_gets_an_unused_lease(bench):
    bench.hold(UNUSED - 2.0, **LONG)
    bench.send("b", op="ask", robot="r1")
    bench.hold(12.0, **LONG)
    assert bench.report().holder.connection == "b"


def test_the_lease_of_a_program_does_not_expire():
    bench = Bench().begin()
    bench.handle(protocol.FromProgram(commands.Take("r1"), 1))
    bench.run(2 * UNUSED, **LONG)
    assert held(bench)
