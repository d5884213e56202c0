"""The state of a robot as a text."""

import itertools
from datetime import datetime, timedelta
from types import SimpleNamespace
from typing import get_args

import pytest

from webmap.base.geometry import Twist
from webmap.console.robot_looks import GROUPS, LOOKS
from webmap.core.robot_state import STATE_TEXTS, Facts, state_of
from webmap.gate.protocol import MAY_MOVE, Activity, Holder

MOVES = (0.4, 0.0, 0.0)
ANN = Holder("c2", "Ann")


REPORT = {
    "holder": None,
    "goal": None,
    "measured": None,
    "alarm": None,
    "link": "up",
    "other_writer": None,
}


def robot(doing="free", *, seen=None, age=0.1, silent=0.1, over=None, **changes):
    """Return the known data of a robot: the gate's report and the display's data."""
    report = None
    if doing is not None:
        report = SimpleNamespace(doing=doing, **{**REPORT, **changes})
    return Facts(
        report=report,
        bridge=SimpleNamespace(state="open", lost=False, replays=False),
        period=0.0,
        silent_for=silent,
        pose_age=age,
        twist=None if seen is None else Twist(*seen),
        goal_over_for=over,
    )


def test_every_state_of_the_gate_has_a_text_and_a_look():
    for doing in get_args(Activity):
        found = state_of(robot(doing, holder=ANN))
        assert found.name == doing
        assert "{" not in found.text + found.mine
    assert set(LOOKS) == {name for name in STATE_TEXTS if not name.endswith("_by_you")}


@pytest.mark.parametrize(
    ("doing", "text", "mine"),
    [
        ("free", "Free", "Free"),
        ("held", "Ann has control", "You have control"),
        ("driven", "Ann is driving", "You are driving"),
        (
            "navigating_held",
            "Autonomous (Ann has control)",
            "Autonomous (you have control)",
        ),
        (
            "blocked",
            "Ann is driving · not moving: blocked?",
            "You are driving · not moving: blocked?",
        ),
        ("stopped", "STOP active", "STOP active"),
    ],
)
def test_the_text_of_a_state_names_the_operator(doing, text, mine):
    found = state_of(robot(doing, holder=ANN))
    assert (found.text, found.mine) == (text, mine)


def test_an_operator_without_a_name_is_named_after_the_connection():
    holder = Holder("c7", "")
    assert state_of(robot("driven", holder=holder)).text == "C7 is driving"


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"seen": MOVES}, "Moved by another program"),
        ({"seen": (0.04, 0.0, -0.09)}, "Free"),
        ({"seen": (0.0, 0.0, -0.11)}, "Moved by another program"),
        ({"seen": MOVES, "age": 1.1}, "Free"),
        ({"seen": MOVES, "age": None}, "Free"),
        ({"seen": MOVES, "measured": (0.0,) * 6}, "Free"),
        ({"seen": MOVES, "doing": "barred"}, "Moved by another program"),
        ({"seen": MOVES, "link": "down"}, "No connection for commands"),
        ({"seen": MOVES, "doing": "held", "holder": ANN}, "Ann has control"),
        ({"seen": MOVES, "goal": SimpleNamespace(state="sent")}, "Autonomous"),
        ({"seen": MOVES, "goal": SimpleNamespace(state="reached")}, "Moved by another"),
        ({"seen": MOVES, "over": 1.0}, "Still moving"),
        ({"seen": MOVES, "over": 3.0}, "Moved by another program"),
    ],
)
def test_the_display_shows_motion_that_the_gate_does_not_measure(changes, text):
    assert state_of(robot(**changes)).text.startswith(text)


def test_a_robot_unknown_to_the_gate_is_view_only():
    assert state_of(robot(None)).text == "View only"
    assert state_of(robot(None, seen=MOVES)).text == "View only"


@pytest.mark.parametrize("doing", [None, "free", "barred", "down"])
def test_a_connecting_or_lost_bridge_has_its_own_text(doing):
    one = robot(doing)
    one.bridge.state = "connecting"
    assert state_of(one).text == "Connecting"
    one.bridge.lost = True
    assert state_of(one).text == "No connection to the bridge"


def test_a_robot_without_new_poses_is_gone_since_its_last_pose():
    one = robot(silent=31.0)
    then = datetime.now() - timedelta(seconds=31)
    assert state_of(one).text in {
        f"No pose since {then + timedelta(seconds=s):%H:%M}" for s in (0, 1)
    }
    assert state_of(robot(None, silent=31.0)).name == "gone"


def test_a_robot_without_new_poses_is_lost_after_three_seconds_and_later_gone():
    found = [state_of(robot(silent=silent)).name for silent in (2.9, 3.1, 29.0, 31.0)]
    assert found == ["free", "lost", "lost", "gone"]


def test_a_robot_that_sends_poses_rarely_or_only_in_motion_is_not_gone():
    assert state_of(robot(silent=None)).text == "Free"
    one = robot(silent=100.0)
    assert state_of(one._replace(period=60.0)).text == "Free"
    assert state_of(one._replace(period=30.0)).name == "gone"


def test_a_robot_of_a_recording_that_ended_is_not_gone():
    one = robot(None, silent=100.0)
    one.bridge.replays = True
    assert state_of(one).text == "View only"


@pytest.mark.parametrize("doing", ["held", "driven", "stopping", "stopped"])
def test_a_robot_with_an_operator_or_an_active_stop_is_lost_but_never_gone(doing):
    assert state_of(robot(doing, holder=ANN, silent=31.0)).name == "lost"


@pytest.mark.parametrize("doing", ["stopped", "unconfirmed"])
def test_a_condition_does_not_hide_an_active_stop(doing):
    found = state_of(robot(doing, link="down"))
    assert found.text == f"{STATE_TEXTS[doing]} · no connection for commands"
    assert state_of(robot(doing, link="down", silent=4.0)).mine == (
        f"{STATE_TEXTS[doing]} · lost: no new pose"
    )


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"charge": 0.1}, "Autonomous · battery low"),
        (
            {"charge": 0.1, "goal_failed": True},
            "Autonomous · goal failed · battery low",
        ),
        ({"silent_for": 4.0}, "Autonomous · lost: no new pose"),
    ],
)
def test_a_condition_is_beside_the_activity_and_does_not_hide_it(change, text):
    found = state_of(robot("navigating")._replace(**change))
    assert (found.text, found.activity) == (text, "navigating")


def test_a_robot_that_nobody_moves_has_only_the_worst_reason_why_its_state_is_unknown():
    assert state_of(robot("down", link="down", silent=4.0)).text == "Lost: no new pose"
    found = state_of(
        no_link(robot("free", silent=4.0, link="down"))._replace(charge=0.1)
    )
    assert found.text == "No connection to the bridge · battery low"
    alarm = robot("settling", alarm="zero sent, still moving at 0.30 m/s")
    assert state_of(alarm).text == "Does not obey: still moving"


@pytest.mark.parametrize("doing", ["moving", "other"])
def test_a_robot_that_moves_by_its_own_goal_or_plan_is_autonomous(doing):
    writer = {"other_writer": "another program publishes" if doing == "other" else None}
    one = robot(doing, **writer)
    assert state_of(one).text == "Moved by another program"
    assert LOOKS[state_of(one).name].tone == "warn"
    assert state_of(one._replace(has_own_goal=True)).text == "Autonomous"
    held = robot(doing, holder=ANN, **writer)._replace(has_own_goal=True)
    assert state_of(held).text == "Autonomous (Ann has control)"
    quiet = robot(seen=MOVES)._replace(has_own_goal=True)
    assert state_of(quiet).text == "Autonomous"
    assert state_of(robot()._replace(has_own_goal=True)).text == "Free"


def test_another_program_is_named_as_far_as_its_nodes_are_known():
    writer = "another program publishes to /cmd_vel (0.30 m/s, 0.00 rad/s)"
    one = robot("other", other_writer=writer)._replace(writers=("/joy", "/tele"))
    assert state_of(one).text == "Moved by another program: /joy, /tele"
    driven = robot("driven", holder=ANN, other_writer=writer)._replace(
        writers=("/joy",)
    )
    assert state_of(driven).mine == "You are driving · moved by another program: /joy"


def test_the_battery_is_low_below_its_limit():
    one = robot()._replace(charge=0.25)
    assert state_of(one).name == "free"
    assert state_of(one._replace(charge=0.19)).name == "battery_low"
    assert state_of(one._replace(battery_low=0.3)).name == "battery_low"
    assert state_of(one._replace(charge=0.0, battery_low=0.0)).name == "free"


def no_link(facts):
    return facts._replace(
        bridge=SimpleNamespace(state="closed", lost=True, replays=False)
    )


def report(**changes):
    """Return a change of the gate's report on a robot."""

    def change(facts):
        seen = SimpleNamespace(**{**vars(facts.report), **changes})
        return facts._replace(report=seen)

    return change


def seen(**changes):
    """Return a change of the display's data about a robot."""
    return lambda facts: facts._replace(**changes)


BY_PRECEDENCE = {
    "disobeying": report(alarm="zero sent, still moving at 0.30 m/s"),
    "unreachable": report(alarm=MAY_MOVE),
    "no_bridge": no_link,
    "lost": seen(silent_for=4.0),
    "down": report(link="down"),
    "unconfirmed": report(doing="unconfirmed"),
    "stopped": report(doing="stopped"),
    "blocked": report(doing="blocked"),
    "goal_failed": seen(goal_failed=True),
    "battery_low": seen(charge=0.1),
    "other": report(other_writer="another program publishes"),
    "moving": report(doing="moving"),
    "changing": report(doing="changing"),
    "stopping": report(doing="stopping"),
    "driven": report(doing="driven", holder=ANN),
    "settling": report(doing="settling"),
    "navigating": report(doing="navigating"),
    "navigating_held": report(doing="navigating_held", holder=ANN),
    "barred": report(doing="barred"),
    "barred_held": report(doing="barred_held", holder=ANN),
    "held": report(doing="held", holder=ANN),
    "free": report(doing="free"),
}
"""A fact for each state, the state with the highest precedence first."""

OF_THE_GATE = set(get_args(Activity)) - {"down", "other"}
"""States of which the gate reports only one at a time."""

ALARMS = {"disobeying", "unreachable"}
"""Alarms, of which a report has one."""


@pytest.mark.parametrize(
    ("first", "second"), list(itertools.combinations(BY_PRECEDENCE, 2))
)
def test_the_name_is_that_of_the_state_with_the_higher_precedence(first, second):
    if {first, second} <= OF_THE_GATE or {first, second} <= ALARMS:
        assert list(STATE_TEXTS).index(first) < list(STATE_TEXTS).index(second)
        return
    one = BY_PRECEDENCE[first](BY_PRECEDENCE[second](robot()))
    other = BY_PRECEDENCE[second](BY_PRECEDENCE[first](robot()))
    assert (state_of(one).name, state_of(other).name) == (first, first)


def test_the_looks_and_their_groups_have_the_order_of_the_states():
    states = [name for name in STATE_TEXTS if not name.endswith("_by_you")]
    assert list(LOOKS) == states
    assert GROUPS[:3] == ("not obeying", "lost", "connecting")
    assert GROUPS[3:7] == ("stopped", "blocked", "goal failed", "battery low")
    assert GROUPS[7:10] == ("moved by another program", "driven", "autonomous")
    assert GROUPS[-1] == "free"
