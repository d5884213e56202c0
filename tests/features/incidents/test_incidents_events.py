"""What happened between two reports of a robot, and when a recording is kept."""

import msgspec
import pytest

from equipment.gate_reports import robot_report
from webmap.features.incidents.incidents import AFTER, APART, Keeping
from webmap.features.incidents.observer import events_between
from webmap.gate.protocol import GoalReport, Holder, StopReport

FREE = robot_report()


def with_stop(confirmed=None, id="s1", why="", doing="stopped"):
    stop = StopReport("Ann", confirmed, why, id)
    return msgspec.structs.replace(FREE, stop=stop, latched=True, doing=doing)


def goal(state, id="g1", why=""):
    found = GoalReport(
        id=id, x=1.0, y=2.0, yaw=0.0, by="c1", method="topic", state=state, why=why
    )
    return msgspec.structs.replace(FREE, goal=found)


def changed(**changes):
    return msgspec.structs.replace(FREE, **changes)


STOPPED = ("stop", "STOP by Ann", "stop")


@pytest.mark.parametrize(
    ("before", "now", "expected"),
    [
        (FREE, FREE, []),
        (FREE, with_stop(), [STOPPED]),
        (with_stop(), with_stop(), []),
        (with_stop(), with_stop(id="s2"), [STOPPED]),
        (
            with_stop(),
            with_stop(True, why="the robot stands"),
            [("note", "STOP confirmed: the robot stands", "")],
        ),
        (with_stop(True), with_stop(True, why="again"), []),
        (
            with_stop(),
            with_stop(False, why="no odometry", doing="unconfirmed"),
            [("alarm", "STOP not confirmed: no odometry", "stop not confirmed")],
        ),
        (with_stop(True), FREE, [("note", "STOP was reset", "")]),
        (
            FREE,
            changed(alarm="still moves"),
            [("alarm", "Not obeying: still moves", "not obeying")],
        ),
        (changed(alarm="still moves"), changed(alarm="still moves, 1 s"), []),
        (
            FREE,
            changed(holder=Holder("c1", "Ann")),
            [("note", "Controlled by Ann", "")],
        ),
        (changed(holder=Holder("c1", "Ann")), FREE, [("note", "Control released", "")]),
        (
            FREE,
            changed(link="down"),
            [("note", "The connection for commands is lost", "")],
        ),
        (FREE, goal("sent"), [("goal", "Goal at 1.00, 2.00 m", "")]),
        (goal("sent"), goal("under way"), []),
        (
            goal("under way"),
            goal("failed", why="blocked"),
            [("result", "Goal failed: blocked", "")],
        ),
        (goal("failed"), goal("failed"), []),
        (goal("reached"), goal("sent", "g2"), [("goal", "Goal at 1.00, 2.00 m", "")]),
    ],
)
def test_the_events_between_two_reports(before, now, expected):
    assert list(events_between(before, now)) == expected


def test_the_first_report_keeps_no_recording():
    states = (with_stop(False, doing="unconfirmed"), changed(alarm="moves"))
    for first in states:
        assert not any(why for _, _, why in events_between(None, first))
    events = [text for _, text, _ in events_between(None, with_stop())]
    assert "STOP is active, by Ann" in events


def test_many_stops_in_a_short_time_are_one_recording():
    keeping = Keeping()
    keeping.trigger("stop of Bob", 100.0)
    keeping.trigger("stop of Eve", 103.0)
    keeping.trigger("stop of Bob", 104.0)
    assert keeping.due == 100.0 + AFTER
    assert keeping.reasons == ["stop of Bob", "stop of Eve"]


def test_the_next_recording_by_itself_waits_and_one_asked_for_does_not():
    keeping = Keeping()
    keeping.trigger("stop of Bob", 100.0)
    keeping.take(110.0)
    assert not keeping.reasons
    keeping.trigger("stop of Bob", 120.0)
    assert keeping.due == 110.0 + APART
    keeping.trigger("asked for by Ann", 121.0, asked=True)
    assert keeping.due == 121.0 + AFTER
    assert keeping.asked
    keeping.take(131.0)
    assert not keeping.asked
    keeping.trigger("asked for by Ann", 132.0, asked=True)
    assert keeping.due == 132.0 + AFTER
