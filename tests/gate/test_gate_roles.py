"""Each command of a page, sent by each role: the matrix of the gate."""

from typing import get_args

import msgspec
import pytest

from equipment.gate_harness import Bench, spec
from webmap.base.roles import ROLES, covers
from webmap.gate import actions, commands
from webmap.gate.commands import PageCommand, op_of

LEAST = {
    commands.Take: "operator",
    commands.Release: "operator",
    commands.Renew: "operator",
    commands.Drive: "operator",
    commands.Goal: "operator",
    commands.Locate: "operator",
    commands.Cancel: "operator",
    commands.Stop: "viewer",
    commands.Reset: "operator",
    commands.Ask: "operator",
    commands.Grant: "operator",
    commands.Deny: "operator",
    commands.StopTest: "operator",
    commands.Check: "operator",
}
"""The least role for each command; the test is in the gate's own code."""

HELD = (
    commands.Release,
    commands.Renew,
    commands.Drive,
    commands.Goal,
    commands.Locate,
    commands.Grant,
    commands.Deny,
    commands.StopTest,
)
"""Commands of who has control."""

AFTER = {
    commands.Grant: ["control is handed over to B"],
    commands.StopTest: ["no odometry: the stop test needs odometry"],
    commands.Check: [
        "press STOP, wait until it is confirmed with its stop hooks, and reset it first"
    ],
}
"""What a page gets although it has the rights."""


def prepared(kind, role):
    """Return a gate that accepts the command of a page ``c`` with enough rights."""
    bench = Bench().begin(spec(pose_topic="/initialpose"))
    bench.join("c", role)
    if kind is commands.Reset:
        bench.send("b", op="stop", robot="r1")
    elif kind is commands.Ask:
        bench.take("b")
    elif kind in HELD:
        bench.take("c")
        if covers(role, "operator"):
            bench.hold(0.3, "c")
    if kind in (commands.Grant, commands.Deny):
        bench.send("b", op="ask", robot="r1")
    bench.run(0.06)
    bench.done.clear()
    bench.messages.clear()
    return bench


def command(kind, bench):
    """Return a valid command of the kind, by its fields."""
    bench.seq += 1
    report = bench.report()
    known = {"robot": "r1", "epoch": report.epoch or 0, "seq": bench.seq}
    known |= {"tick": bench.tick, "stop": report.stop.id if report.stop else "none"}
    names = [f.name for f in msgspec.structs.fields(kind)]
    optional = {"video", "clamped"}
    return {name: known.get(name, 0.1) for name in names if name not in optional}


def test_every_command_of_a_page_is_in_the_matrix():
    assert LEAST.keys() == set(get_args(PageCommand))


@pytest.mark.parametrize("role", ROLES)
@pytest.mark.parametrize("kind", LEAST, ids=op_of)
def test_a_role_may_send_a_command_or_it_changes_nothing(kind, role):
    bench = prepared(kind, role)
    before = bench.report()
    bench.send("c", op=op_of(kind), **command(kind, bench))
    if covers(role, LEAST[kind]):
        refused = [each.why for each in bench.refusals("c")]
        assert refused == AFTER.get(kind, [])
        return
    bench.run(0.3)
    assert kind is commands.Release or bench.refusals("c")
    for action in (
        actions.SendGoal,
        actions.SendPose,
        actions.SaveStop,
        actions.SaveCheck,
    ):
        assert bench.did(action) == []
    assert [each for each in bench.written if not each.twist.is_zero] == []
    after = bench.report()
    assert (after.holder, after.epoch, after.asker, after.latched, after.stop) == (
        before.holder,
        before.epoch,
        before.asker,
        before.latched,
        before.stop,
    )
