"""The card shows how a robot stops when commands no longer arrive."""

from types import SimpleNamespace

import pytest

from webmap.console.card_parts import NOBODY_KNOWS, OwnStop, bound
from webmap.gate.protocol import Holder


def report(**changes):
    known = {
        "stop_time": 0.25,
        "stop_source": "stated",
        "stop_date": None,
        "v": 2.0,
        "brake": 0.5,
        "test": None,
        "holder": Holder("c1", "Ann"),
    }
    return SimpleNamespace(report=SimpleNamespace(**(known | changes)))


def text_of(robot) -> str:
    shown = OwnStop(1.0)
    shown.show(robot)
    return f"{shown._bound.text}|{shown._how.text}|{shown._test.text}"


def test_the_bound_is_the_command_timeout_plus_the_braking_time():
    assert bound(0.25, "stated", 0.2, 0.5) == (
        "stops within 0.65 s",
        " 0.25 s command timeout (stated) + 0.40 s of braking from 0.20 m/s",
    )


def test_the_bound_uses_a_lower_speed_limit_of_the_page():
    assert text_of(report()).startswith("stops within 2.25 s|")


def test_the_result_of_a_stop_test_is_shown_with_its_date():
    shown = text_of(
        report(stop_time=0.31, stop_source="tested", stop_date="2026-11-21")
    )
    assert "0.31 s command timeout (tested 2026-11-21)" in shown


@pytest.mark.parametrize(
    ("source", "text"),
    [(None, NOBODY_KNOWS), ("tested", "does not stop")],
)
def test_a_robot_without_a_command_timeout_is_shown_without_a_bound(source, text):
    shown = text_of(report(stop_time=None, stop_source=source, stop_date="2026-11-21"))
    assert shown.startswith(f"{text}|")


def test_a_failed_stop_test_is_shown_with_its_reason():
    failed = SimpleNamespace(state="failed", text="the robot did not move within 1.5 s")
    assert text_of(report(test=failed)).endswith(
        "|Stop test: The robot did not move within 1.5 s."
    )


def test_what_ended_a_stop_test_is_not_shown_after_the_end_of_control():
    stopped = SimpleNamespace(state="failed", text="STOP by Ann")
    assert text_of(report(test=stopped, holder=None)).endswith("|")


def test_a_view_only_robot_has_no_bound_on_the_card():
    shown = OwnStop(1.0)
    shown.show(SimpleNamespace(report=None))
    assert shown.elements[0].get("hidden") is not None
