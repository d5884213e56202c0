"""What the console says of a robot."""

import math
from types import SimpleNamespace

import pytest

from webmap.console.battery import BatteryMark
from webmap.console.bridge_list import summary
from webmap.console.speeds import cap, linear
from webmap.console.words import battery_tone, describe, heading, number, sentence

BRIDGE_OPEN = SimpleNamespace(bridge=SimpleNamespace(state="open"))


def robot(state: str | None = "free", *, holder: str | None = None, **changes):
    report = None
    if state is not None:
        report = SimpleNamespace(
            state=state,
            holder=holder and SimpleNamespace(name=holder),
            **{
                **{"link": "up", "goal": None, "measured": None, "other_writer": None},
                **changes,
            },
        )
    return SimpleNamespace(feed=BRIDGE_OPEN, report=report)


@pytest.mark.parametrize(
    ("state", "holder", "text", "mine", "shape"),
    [
        ("free", None, "Free", "", "state-free"),
        ("held", "Ann", "Ann holds it", "You hold it", "state-held"),
        ("driving", "Ann", "Ann drives", "You drive", "state-driving"),
        ("stopping", "Ann", "Stopping", "", "state-stopping"),
        ("stopped", None, "Stopped", "", "state-stopped"),
    ],
)
def test_every_drive_state_has_a_word_and_a_shape(state, holder, text, mine, shape):
    words = describe(robot(state, holder=holder))
    assert (words.text, words.mine, words.shape) == (text, mine, shape)


@pytest.mark.parametrize(
    ("measured", "text"),
    [
        (None, "Free"),
        ((0.04, 0.0, -0.09), "Free"),
        ((-0.03, 0.05, 0.0), "Still moving"),
        ((0.0, 0.0, -0.1), "Still moving"),
    ],
)
def test_a_robot_that_rolls_is_not_said_to_be_merely_free(measured, text):
    assert describe(robot(measured=measured)).text == text


MOVES = (0.4, 0.0, 0.0)


@pytest.mark.parametrize(
    ("cancels", "measured", "text"),
    [
        (True, MOVES, "On its way"),
        (True, None, "Free"),
        (False, MOVES, "Still moving"),
        (False, None, "Free"),
    ],
)
def test_a_goal_that_nobody_tells_of_is_told_by_motion_alone(cancels, measured, text):
    goal = SimpleNamespace(state="sent", way="topic")
    one = robot(goal=goal, cancels=cancels, measured=measured)
    assert describe(one).text == text


@pytest.mark.parametrize(
    ("state", "text"),
    [("accepted", "On its way"), ("unknown", "On its way"), ("reached", "Free")],
)
def test_a_robot_with_a_goal_that_nobody_drives_is_on_its_way(state, text):
    goal = SimpleNamespace(state=state, way="navigate_to_pose")
    assert describe(robot(goal=goal)).text == text
    assert describe(robot("held", holder="Ann", goal=goal)).text == "Ann holds it"


@pytest.mark.parametrize(
    ("state", "holder", "text", "mine"),
    [
        ("free", None, "Another program drives it", ""),
        ("stopping", "Ann", "Another program drives it", ""),
        (
            "held",
            "Ann",
            "Ann holds it, another publishes",
            "You hold it, another publishes",
        ),
        (
            "driving",
            "Ann",
            "Ann drives, another program too",
            "You drive, another program too",
        ),
        ("stopped", None, "Stopped, another publishes", ""),
    ],
)
def test_another_program_that_drives_a_robot_is_said(state, holder, text, mine):
    said = "another program publishes to /cmd_vel (0.10 m/s, -0.20 rad/s)"
    words = describe(robot(state, holder=holder, other_writer=said))
    assert (words.text, words.mine) == (text, mine)
    assert words.tone in ("warn", "bad")


def test_a_link_that_is_down_is_said_before_another_program():
    words = describe(robot("free", link="down", other_writer="another program"))
    assert words.text == "No way to drive it"


def test_a_robot_that_the_gate_does_not_know_is_only_watched():
    assert describe(robot(None)).text == "Watched only"


def test_a_closed_bridge_is_said_before_anything_else():
    one = robot("driving", holder="Ann")
    one.feed = SimpleNamespace(bridge=SimpleNamespace(state="closed", trouble=None))
    assert describe(one).text == "No bridge"
    assert describe(one).tone == "bad"


def test_a_bridge_that_is_tried_again_in_vain_is_not_merely_connecting():
    one = robot("free")
    one.feed = SimpleNamespace(bridge=SimpleNamespace(state="connecting", trouble=None))
    assert describe(one).text == "Connecting"
    one.feed.bridge.trouble = "the connection was refused"
    assert describe(one).text == "No bridge"


def test_a_robot_that_cannot_be_reached_by_the_gate_is_said():
    assert describe(robot("held", holder="Ann", link="down")).tone == "bad"


def test_states_that_can_stand_together_in_a_list_never_share_a_shape():
    states = ["free", "held", "driving", "stopping", "stopped"]
    shapes = {describe(robot(state, holder="Ann")).shape for state in states}
    assert len(shapes) == len(states)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.234, "1.23"),
        (-1.5, "\N{MINUS SIGN}1.50"),
        (-0.001, "0.00"),
        (math.nan, "\N{EN DASH}"),
        (math.inf, "\N{EN DASH}"),
    ],
)
def test_numbers_are_written_as_people_read_them(value, text):
    assert number(value) == text


@pytest.mark.parametrize(
    ("degrees", "text"), [(0, "0"), (92.4, "92"), (-1, "359"), (359.6, "0")]
)
def test_a_heading_is_in_whole_degrees_below_360(degrees, text):
    assert heading(math.radians(degrees)) == text


def test_driving_backwards_is_a_speed_below_zero():
    assert linear((-0.5, 0.0, 0.0)) == "\N{MINUS SIGN}0.50"
    assert linear((0.3, 0.4, 0.0)) == "0.50"


def test_a_cap_names_both_speeds():
    assert cap(0.3, 0.6) == "0.30 m/s, 0.60 rad/s"


def test_words_of_the_gate_become_a_sentence():
    assert sentence("no link") == "No link."
    assert sentence("No link.") == "No link."
    assert sentence("") == ""


@pytest.mark.parametrize(
    ("charge", "tone"), [(0.5, ""), (0.2, ""), (0.15, "warn"), (0.05, "bad")]
)
def test_a_low_battery_is_more_than_a_number(charge, tone):
    assert battery_tone(charge) == tone


def test_a_charge_that_is_not_known_is_not_shown():
    mark = BatteryMark()
    mark.show(SimpleNamespace(charge=0.84))
    assert mark.element.text == "84 %"
    mark.show(SimpleNamespace(charge=None))
    assert mark.element.get("hidden") is not None


@pytest.mark.parametrize(
    ("links", "text"),
    [
        (["open"], "Bridge open"),
        (["lost"], "No bridge"),
        (["connecting"], "Bridge connecting"),
        (["open", "open"], "2 bridges open"),
        (["open", "lost"], "1 of 2 bridges open"),
        ([], "0 bridges open"),
    ],
)
def test_bridges_are_summed_up(links, text):
    assert summary(links) == text
