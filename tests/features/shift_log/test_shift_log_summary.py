"""What happened in a shift: stops, driving, and how long robots could be reached."""

import pytest

from webmap.core.shift_files import Entry
from webmap.features.shift_log.hand_over import (
    driving_of,
    running,
    stops_of,
    unreachable,
    uptime,
)


def entry(unix, kind, text="", **values):
    facts = {
        key: values.pop(key)
        for key in list(values)
        if key not in Entry.__struct_fields__
    }
    return Entry(time="", unix=unix, kind=kind, text=text, facts=facts, **values)


def test_a_stop_has_its_result_and_its_reset():
    stops = stops_of(
        [
            entry(1, "stop", "pressed STOP", robot="r1", stop="a"),
            entry(2, "stop", "pressed STOP", robot="r2", stop="a"),
            entry(3, "stop", "confirmed", robot="r1", stop="a", confirmed=True),
            entry(4, "reset", "reset STOP", robot="r1", stop="a"),
            entry(5, "stop", "confirmed", robot="r9", stop="b", confirmed=True),
        ]
    )
    assert [(s.entry.robot, s.result, s.reset and s.reset.unix) for s in stops] == [
        ("r1", "confirmed", 4),
        ("r2", "", None),
    ]


def test_the_drives_of_a_person_with_a_robot_are_added_up():
    who = {"robot_name": "Bob", "person": "Ana"}
    drives = driving_of(
        [
            entry(1, "drive", "began to drive", **who),
            entry(2, "drive", **who, distance_m=3.0, seconds=10.0, top_m_s=0.4),
            entry(
                3,
                "drive",
                **who,
                distance_m=2,
                seconds=5.0,
                top_m_s=0.6,
                age_p50_ms=40,
                age_p99_ms=90,
            ),
            entry(4, "drive", **who, distance_m="x", seconds=None),
        ]
    )
    drive = drives["Bob", "Ana"]
    assert (drive.metres, drive.seconds, drive.top) == (5.0, 15.0, 0.6)
    assert drive.ages == [(40.0, 90.0)]


def test_webmap_ran_from_its_start_to_its_end_or_to_its_last_entry():
    started, ended = {"event": "started"}, {"event": "ended"}
    entries = [
        entry(10, "note"),  # an older start is no longer in the log
        entry(20, "webmap", **ended),
        entry(30, "webmap", **started),
        entry(40, "note"),  # killed afterwards
        entry(60, "webmap", **started),
    ]
    assert running(entries, 0, 100) == [(10, 20), (30, 40), (60, 100)]
    assert running(entries, 35, 70) == [(35, 40), (60, 70)]
    assert running([], 0, 100) == []


def alert(unix, kind, event, robot="r1", bridge="hall"):
    return entry(unix, "alert", robot=robot, alert=kind, event=event, bridge=bridge)


def test_a_robot_is_unreachable_by_its_own_alerts_and_those_of_its_bridge():
    entries = [
        alert(10, "lost", "began"),
        alert(15, "commands", "began"),
        alert(20, "lost", "over"),
        alert(25, "commands", "over"),
        alert(30, "lost", "began", robot="r2"),
        alert(40, "bridge", "began", robot="r2"),
        alert(50, "bridge", "over", robot="r2"),
        alert(60, "bridge", "began", robot="r3", bridge="yard"),
        alert(70, "battery", "began"),
        alert(90, "lost", "began"),
        alert(92, "lost", "acknowledged"),
    ]
    down = unreachable(entries, "r1", "hall", 100)
    assert down == [(10, 25), (40, 50), (90, 100)]
    assert uptime([(0, 100)], down) == pytest.approx(0.65)
    assert uptime([(0, 20), (80, 100)], down) == pytest.approx(0.5)
    assert uptime([], down) is None
