"""The names of people in reports: shown everywhere, and no decision depends on them."""

import json

import pytest

from equipment.gate_harness import Bench, spec
from webmap.gate import actions, protocol
from webmap.gate.disk import Records, path_of
from webmap.gate.events import Key, Press
from webmap.gate.protocol import PROGRAM, Holder, Identity

ANN = Identity("91c2", "0b7e")
KEY = Key("ws://robot:9090", "/cmd_vel")
RUTH = "\u05e8\u05d5\u05ea"
ISOLATED = f"\u2068{RUTH}\u2069"


@pytest.fixture
def bench():
    """A bench where Ann, at the page "a", has control of a robot."""
    return begun(ANN)


def begun(identity, name="Ann"):
    bench = Bench().begin(spec(odometry_topic="/odom"))
    bench.handle(protocol.Connect("a", name, "operator", identity=identity))
    bench.take("a")
    return bench


def rename(bench, who="a", name="Eva (desk 4)"):
    bench.handle(protocol.Rename(who, name))


def test_a_new_name_is_shown_at_once_on_a_held_robot(bench):
    epoch = bench.report().epoch
    assert bench.report().holder == Holder("a", "Ann", ANN)
    rename(bench)
    assert bench.report().holder == Holder("a", "Eva (desk 4)", ANN)
    assert bench.report().epoch == epoch
    bench.take("b")
    assert bench.refusals("b")[-1].why == "Eva (desk 4) has control"


def test_a_new_name_is_shown_in_a_request_for_control(bench):
    bench.send("b", op="ask", robot="r1")
    rename(bench, "b", "Ben")
    assert bench.report().asker.name == "Ben"
    assert bench.report().holder.name == "Ann"


@pytest.mark.parametrize("who", ["nobody", PROGRAM])
def test_only_a_page_can_have_another_name(bench, who):
    before = bench.report()
    rename(bench, who)
    assert bench.report() == before


def test_a_stop_names_the_person_under_the_name_of_its_press(bench):
    bench.send("a", op="stop", robot="r1")
    rename(bench)
    stop = bench.report().stop
    assert (stop.by, stop.identity) == ("Ann", ANN)


def test_names_change_no_decision():
    def deeds(identity, renames):
        bench = begun(identity)
        bench.hold(0.3)
        for number in range(3):
            if renames:
                rename(bench, name=f"Ann {number}")
            bench.hold(0.2, x=0.5)
        bench.send("b", op="ask", robot="r1")
        if renames:
            rename(bench, "b")
        bench.send("a", op="grant", robot="r1")
        bench.run(1.5)
        bench.send("a", op="stop", robot="*")
        bench.run(0.2)
        sent = [(each.at, each.twist) for each in bench.written]
        return sent, bench.report().epoch is None, len(bench.did(actions.SaveStop))

    assert deeds(ANN, True) == deeds(None, False)


def test_a_name_from_right_to_left_does_not_turn_a_sentence_around():
    bench = begun(ANN, RUTH)
    bench.take("b")
    assert bench.refusals("b")[-1].why == f"{ISOLATED} has control"
    bench.send("a", op="stop", robot="r1")
    assert bench.report().stop.by == RUTH
    assert bench.report().reason.startswith(f"STOP by {ISOLATED} is active")


def test_a_stored_stop_keeps_the_identity_of_the_person(tmp_path):
    records = Records(tmp_path)
    records.keep_latch(KEY, Press("Ann", "a1", ANN), frozenset())
    assert records.latch_of(KEY) == Press("Ann", "a1", ANN)


@pytest.mark.parametrize("identity", ["91c2", {"person": 4}, {"person": "x" * 200}, 7])
def test_an_invalid_identity_in_a_file_does_not_hide_the_stop(tmp_path, identity):
    stored = {"by": "Ann", "id": "a1", "identity": identity}
    path_of(tmp_path, KEY, "stop").write_text(json.dumps(stored))
    assert Records(tmp_path).latch_of(KEY) == Press("Ann", "a1")
