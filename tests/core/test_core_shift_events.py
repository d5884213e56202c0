"""Entries of the shift log that follow from what changes in the reports of a gate."""

import math
from collections import Counter

import pytest

from equipment.gate_reports import robot_report
from webmap.core import shift_events
from webmap.core.shift_events import ShiftWatch, quantile
from webmap.core.shift_log import ShiftLog
from webmap.gate.protocol import (
    AskerReport,
    GateDown,
    GateUp,
    GoalReport,
    Holder,
    Identity,
    LeaseEnded,
    PageAsked,
    RobotGone,
    SentPose,
    StopReport,
)

ANA = Holder("c1", "Ana (desk 4)", Identity("a1", verified=True))
BEN = Holder("c2", "Ben (desk 5)", Identity("b1"))
STILL = (0.0,) * 6


def report(**values):
    return robot_report(**({"v": math.inf, "w": math.inf} | values))


def held(by=ANA, **values):
    usual = {"state": "held", "holder": by, "epoch": 3, "v": 1.0, "w": 1.5}
    return report(**(usual | values))


def goal(state, id="g1", by="c1", why=""):
    return GoalReport(
        id=id, x=1.0, y=2.0, yaw=0.5, by=by, method="topic", state=state, why=why
    )


class Bench:
    def __init__(self, monkeypatch):
        self.now = 100.0
        monkeypatch.setattr(shift_events.time, "monotonic", lambda: self.now)
        self.log = ShiftLog()
        self.watch = ShiftWatch(self.log)

    def texts(self, *reports, wait=0.0):
        """Take reports; return kind, person and text of the new entries."""
        before = self.log.total
        for each in reports:
            self.now += wait
            self.watch.on_report(each)
        return [(e.kind, e.person, e.text) for e in self.log.since(before)]


@pytest.fixture
def bench(monkeypatch):
    return Bench(monkeypatch)


def test_an_unchanged_robot_has_no_entries(bench):
    assert bench.texts(report(), report(), report(sent=(0.1,) * 6)) == []


def test_taking_and_releasing_control_is_noted_with_the_epoch(bench):
    bench.texts(report())
    taken, limits = bench.texts(held())
    assert taken == ("control", "Ana", "took control")
    assert limits == ("limits", "Ana", "limits 1 m/s and 1.5 rad/s")
    entry = bench.log.entries()[0]
    assert (entry.verified, entry.place, entry.facts["epoch"]) == (True, "desk 4", 3)
    assert bench.texts(report()) == [("control", "Ana", "released control")]


def test_the_end_of_control_has_its_cause(bench):
    bench.texts(report(), held())
    ended = LeaseEnded("r1", "the page was closed")
    assert bench.texts(ended, report()) == [
        ("control", "Ana", "lost control: the page was closed")
    ]


def test_a_request_and_the_hand_over_are_noted(bench):
    bench.texts(report(), held())
    asker = AskerReport("c2", BEN.name, 9.0, BEN.identity)
    assert bench.texts(held(asker=asker), held(asker=asker)) == [
        ("request", "Ben", "requested control from Ana (desk 4)")
    ]
    ended = LeaseEnded("r1", "control is handed over to Ben (desk 5)")
    assert bench.texts(ended, report(changing=True), held(BEN, epoch=4)) == [
        ("control", "Ana", "lost control: control is handed over to Ben (desk 5)"),
        ("control", "Ben", "took control"),
    ]


def test_a_drive_has_a_summary_with_distance_speed_and_ages(bench):
    bench.texts(report(), held())
    moving = held(state="driving", measured=(0.5, 0, 0.1, 0, 0, 0), age=42.0)
    assert bench.texts(moving) == [("drive", "Ana", "began to drive")]
    assert bench.texts(*[moving] * 99, wait=0.1) == []
    assert bench.texts(held(measured=STILL), wait=0.1) == []
    # A second press within the same control belongs to the same drive.
    assert bench.texts(moving, held(measured=STILL), wait=0.1) == []
    summary, released = bench.texts(report(), wait=5.0)
    assert released[2] == "released control"
    assert summary[:2] == ("drive", "Ana")
    assert summary[2].endswith("at most 0.50 m/s")
    facts = bench.log.entries()[-2].facts
    assert facts["distance_m"] == pytest.approx(5.0, abs=0.2)
    assert facts["age_p50_ms"] == facts["age_p99_ms"] == 40
    assert facts["top_m_s"] == 0.5
    assert facts["seconds"] == pytest.approx(10.1, abs=0.05)  # not while it rests


def test_a_long_drive_and_one_that_webmap_ends_have_summaries(bench):
    moving = held(state="driving", measured=(1.0, 0, 0, 0, 0, 0))
    bench.texts(report(), moving)
    found = bench.texts(*[moving] * 61, wait=10.0)
    assert [text for kind, _, text in found if kind == "drive"] == [
        "drove 610.0 m in 610 s, at most 1.00 m/s"
    ]
    bench.now += 2.0
    before = bench.log.total
    bench.watch.end()
    (last,) = bench.log.since(before)
    assert last.text.startswith("drove ")


def test_stop_its_confirmation_and_its_reset_have_names(bench):
    bench.texts(report(), held(state="driving"))
    stop = StopReport("Ben (desk 5)", None, "", "5f0c", BEN.identity)
    sure = StopReport("Ben (desk 5)", True, "stopped", "5f0c", BEN.identity)
    stopped = report(state="stopped", latched=True, stop=stop)
    found = bench.texts(stopped, report(state="stopped", latched=True, stop=sure))
    assert [entry for entry in found if entry[0] == "stop"] == [
        ("stop", "Ben", "pressed STOP"),
        ("stop", "", "stopped"),
    ]
    asked = PageAsked("r1", "reset", ANA.name, ANA.identity)
    assert bench.texts(asked, report()) == [("reset", "Ana", "reset STOP")]


def test_a_reset_has_no_name_of_a_person_whose_reset_was_refused(bench):
    bench.texts(report(), report(stop=StopReport("Ana", None, "", "1")))
    asked = PageAsked("r1", "reset", BEN.name, BEN.identity)
    refused = PageAsked("r1", "reset", "", None)
    assert bench.texts(asked, refused, report()) == [("reset", "", "reset STOP")]


def test_a_second_press_of_stop_is_another_entry(bench):
    one = StopReport("Ana", None, "", "1")
    two = StopReport("Ben", None, "", "2")
    assert bench.texts(report(), report(stop=one), report(stop=two)) == [
        ("stop", "Ana", "pressed STOP"),
        ("stop", "Ben", "pressed STOP"),
    ]


def test_a_stop_from_before_the_start_is_noted_as_such(bench):
    stop = StopReport("Ana", True, "stopped", "1")
    found = bench.texts(report(stop=stop))
    assert found[0] == ("stop", "Ana", "STOP is active from before")


def test_goals_have_who_sent_them_and_their_end(bench):
    bench.texts(report(), held())
    assert bench.texts(
        held(goal=goal("sent")),
        held(goal=goal("under way")),
        held(goal=goal("failed", why="no path")),
    ) == [
        ("goal", "Ana", "goal at 1.00, 2.00"),
        ("goal", "", "goal failed: no path"),
    ]
    asked = PageAsked("r1", "cancel", BEN.name, BEN.identity)
    found = bench.texts(
        held(goal=goal("sent", "g2")), asked, held(goal=goal("cancelled", "g2"))
    )
    assert found[-1] == ("goal", "Ben", "goal cancelled")
    # A cancel that ended nothing is not the cause of a later end.
    found = bench.texts(
        asked, held(goal=goal("sent", "g3")), held(goal=goal("cancelled", "g3"))
    )
    assert found[-1] == ("goal", "", "goal cancelled")


def test_a_goal_that_ended_before_the_start_is_not_noted(bench):
    assert bench.texts(report(goal=goal("reached"))) == []


def test_limits_that_follow_the_network_are_noted_every_ten_seconds(bench):
    bench.texts(report(), held())
    changing = [
        held(v=round(0.9 - i / 100, 2), why=("slow network",)) for i in range(50)
    ]
    found = bench.texts(*changing, wait=1.0)
    assert 4 <= len(found) <= 6
    assert found[0][2].endswith("rad/s: slow network")


def test_a_pose_has_who_set_it(bench):
    bench.texts(report(), held())
    assert bench.texts(SentPose("r1", 1.0, 2.0, 0.0, "c1")) == [
        ("pose", "Ana", "set the pose to 1.00, 2.00")
    ]


def test_the_end_of_the_gate_is_noted_once_with_its_drives(bench):
    bench.texts(GateUp(), report(), held(state="driving"))
    down = GateDown("killed")
    found = bench.texts(down, down, GateUp())
    assert [kind for kind, _, _ in found] == ["drive", "link", "link"]
    assert found[1][2] == "the gate ended: killed"


def test_a_robot_that_is_removed_while_it_is_driven_has_a_summary(bench):
    bench.texts(report(), held(state="driving"))
    assert [kind for kind, _, _ in bench.texts(RobotGone("r1"))] == ["drive"]


def test_quantiles_of_counted_values():
    counts = Counter({40: 98, 100: 1, 250: 1})
    assert quantile(counts, 0.5) == 40
    assert quantile(counts, 0.99) == 100
    assert quantile(Counter(), 0.5) is None
