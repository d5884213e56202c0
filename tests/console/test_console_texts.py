"""The texts of the console about a robot."""

import math
from datetime import datetime, timedelta

import pytest

from webmap import html
from webmap.console import bar
from webmap.console.bar import summary
from webmap.console.card_parts import cap, linear
from webmap.console.robot_list import BatteryMark
from webmap.console.robot_looks import (
    LOOKS,
    battery_tone,
    heading,
    number,
    sentence,
)
from webmap.core.refusals import Refusals
from webmap.core.robot_state import STATE_TEXTS


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.234, "1.23"),
        (-1.5, "-1.50"),
        (-0.001, "0.00"),
        (math.nan, "\N{EN DASH}"),
        (math.inf, "\N{EN DASH}"),
    ],
)
def test_numbers_have_two_decimals_and_a_dash_if_they_are_not_finite(value, text):
    assert number(value) == text


@pytest.mark.parametrize(
    ("degrees", "text"), [(0, "0"), (92.4, "92"), (-1, "359"), (359.6, "0")]
)
def test_a_heading_is_in_whole_degrees_below_360(degrees, text):
    assert heading(math.radians(degrees)) == text


def test_driving_backwards_is_shown_as_a_negative_speed():
    assert linear((-0.5, 0.0, 0.0)) == "-0.50"
    assert linear((0.3, 0.4, 0.0)) == "0.50"


def test_a_speed_limit_is_shown_with_both_speeds():
    assert cap(0.3, 0.6) == "0.30 m/s, 0.60 rad/s"


def test_a_text_of_the_gate_becomes_a_sentence():
    assert sentence("no link") == "No link."
    assert sentence("No link.") == "No link."
    assert sentence("") == ""


def test_a_lower_case_name_at_the_start_of_a_sentence_is_not_capitalized():
    assert sentence("ws://a:9090 is lost") == "ws://a:9090 is lost."
    assert sentence("robot_0 is free") == "robot_0 is free."
    assert sentence("zero sent, still moving") == "Zero sent, still moving."


def test_every_state_of_a_robot_has_a_look():
    assert set(LOOKS) == {name for name in STATE_TEXTS if not name.endswith("_by_you")}


def test_states_shown_together_in_a_list_have_different_shapes():
    shapes: dict[str, set[str]] = {}
    for look in LOOKS.values():
        shapes.setdefault(look.symbol, set()).add(look.group)
    assert all(len(groups) == 1 for groups in shapes.values())


@pytest.mark.parametrize(
    ("charge", "tone"), [(0.5, ""), (0.2, ""), (0.15, "warn"), (0.05, "bad")]
)
def test_a_low_battery_has_a_warning_tone(charge, tone):
    assert battery_tone(charge, 0.2) == tone


def test_a_battery_above_its_own_limit_has_no_tone():
    assert battery_tone(0.08, 0.05) == ""
    assert battery_tone(0.25, 0.3) == "warn"


def test_an_unknown_charge_is_not_shown():
    mark = BatteryMark()
    mark.show(0.84)
    assert mark.element.text == "battery 84 %"
    mark.show(None)
    assert mark.element.get("hidden") is not None


@pytest.mark.parametrize(
    ("links", "text"),
    [
        (["open"], "Bridge connected"),
        (["lost"], "No connection to the bridge"),
        (["connecting"], "Connecting to the bridge"),
        (["open", "open"], "2 bridges connected"),
        (["open", "lost"], "1 of 2 bridges connected"),
        ([], "No bridge yet"),
    ],
)
def test_the_states_of_the_bridges_are_summarized(links, text):
    assert summary(links) == text


@pytest.mark.parametrize(
    ("links", "routers", "text"),
    [
        ([], ["lost"], "No connection to the router"),
        ([], ["connecting"], "No agent yet"),
        (["lost", "lost"], ["lost"], "No connection to the router"),
        (["lost"], ["open"], "No connection to the bridge"),
        (["open", "open"], ["open", "connecting"], "2 bridges connected"),
        (["open"], ["lost"], "Bridge connected, no connection to a router"),
        (
            ["open", "lost"],
            ["lost"],
            "1 of 2 bridges connected, no connection to a router",
        ),
    ],
)
def test_a_router_that_is_lost_or_without_agents_is_in_the_summary(
    links, routers, text
):
    assert summary(links, routers) == text


def test_refused_messages_are_shown_for_a_minute_after_the_last_one(monkeypatch):
    times = [datetime.now().astimezone()]
    monkeypatch.setattr(bar, "now", lambda: times[-1])
    monkeypatch.setattr(bar, "refusals", counted := Refusals())
    element = html.div()
    refused = bar.RefusedList(element, "operator")
    (details,) = element.children

    def is_shown(later: float) -> bool:
        times.append(times[0] + timedelta(seconds=later))
        refused.poll()
        return details.get("hidden") is None

    assert not is_shown(0)
    counted.note("Ann", 3, "drive: too old", times[0])
    assert is_shown(1)
    assert is_shown(59)
    assert not is_shown(61)
    counted.note("Ann", 1, "drive: too old", times[-1])
    assert is_shown(62)
    assert "4 refused" in details.text
