"""The steps of a check before driving, its lines, and what makes it fail."""

from types import SimpleNamespace

import pytest

from webmap.features.check import check_panel
from webmap.features.check.check import (
    ARRIVES,
    CONFIRMS,
    LONGEST,
    Check,
    Facts,
    lines,
    passes,
)
from webmap.features.check.check_panel import (
    is_due,
    keep_result,
    last_result,
    write_result,
)
from webmap.gate.protocol import CheckReport, StopReport


def facts(**changes):
    report = {
        "link": "up",
        "measured": (0.0,) * 6,
        "stop": None,
        "hooks": (),
        "stop_time": 0.25,
        "stop_source": "tested",
        "stop_date": "2026-11-21",
        "check": None,
    }
    known = {"lag": 0.02, "has_odometry": True, "age": 0.1, "cameras": {"Front": 0.3}}
    for name, value in changes.items():
        (report if name in report else known)[name] = value
    return Facts(SimpleNamespace(**report), **known)


def stopped(confirmed=True, id="s1", why=""):
    return StopReport("Ann", confirmed, why, id)


def test_a_check_of_a_good_robot_has_a_good_line_for_each_part():
    found = lines(facts(), 0.4)
    assert [(line.level, line.name, line.text) for line in found] == [
        ("good", "Connection", "OK, 0.02 s late"),
        ("good", "Odometry", "OK, pose 0.1 s old"),
        ("good", "STOP", "OK, confirmed after 0.4 s"),
        ("good", "Command timeout", "OK, 0.25 s, measured on 2026-11-21"),
        ("good", "Front", "OK, picture 0.3 s old"),
    ]
    assert passes(found)


@pytest.mark.parametrize(
    ("changes", "name", "level", "text"),
    [
        ({"link": "down"}, "Connection", "wrong", "no connection for commands"),
        ({"lag": 0.7}, "Connection", "wrong", "0.70 s late"),
        ({"has_odometry": False}, "Odometry", "wrong", "no topic is known"),
        ({"measured": None}, "Odometry", "wrong", "does not arrive"),
        ({"age": None}, "Odometry", "good", "OK"),
        ({"age": 3.0}, "Odometry", "warning", "pose 3.0 s old"),
        ({"stop_time": None, "stop_source": None}, "Command timeout", "warning", "unk"),
        ({"stop_time": None}, "Command timeout", "warning", "the base did not stop"),
        ({"stop_time": 1.0}, "Command timeout", "warning", "1.00 s"),
        ({"stop_source": "stated"}, "Command timeout", "note", "0.25 s, stated"),
        ({"cameras": {"Front": None}}, "Front", "warning", "no picture"),
        ({"cameras": {"Front": 9.0}}, "Front", "warning", "picture 9.0 s old"),
    ],
)
def test_a_line_shows_what_is_wrong_and_what_to_do(changes, name, level, text):
    (line,) = [each for each in lines(facts(**changes), 0.4) if each.name == name]
    assert (line.level, line.text[: len(text)]) == (level, text)
    assert bool(line.advice) == (level != "good")
    assert passes(lines(facts(**changes), 0.4)) == (level != "wrong")


def test_the_line_of_stop_has_the_hooks_that_failed_or_the_reason():
    hooks = facts(stop=stopped(), hooks=("stop hook /lock: no answer",))
    assert lines(hooks, None)[2].text == "stop hook /lock: no answer"
    moving = facts(stop=stopped(False, why="still moving at 0.20 m/s"))
    assert lines(moving, None)[2].text == "not confirmed: still moving at 0.20 m/s"
    assert lines(facts(), None)[2].text == "not confirmed"


def test_a_check_goes_from_stop_to_reset_to_the_gate():
    check = Check(100.0, before="old", kept=5.0)
    assert not check.look(facts(stop=stopped(id="old")), 100.1)
    assert check.step == "stop"
    assert not check.look(facts(stop=stopped(None)), 100.2)
    assert not check.look(facts(stop=stopped()), 100.6)
    assert (check.step, check.lines[2].text) == ("reset", "OK, confirmed after 0.6 s")
    assert not check.look(facts(stop=stopped()), 110.0)
    assert check.look(facts(), 111.0), "the page reports it now"
    assert not check.look(facts(check=CheckReport(None, "Ann", 5.0)), 111.1)
    assert check.step == "report"
    assert not check.look(facts(check=CheckReport(None, "Ann", 9.0)), 111.2)
    assert (check.is_over, check.passed, check.doing) == (True, True, "")
    assert not check.look(facts(), 200.0)
    assert check.passed


def test_a_check_with_something_wrong_fails_at_the_reset_and_is_not_reported():
    check = Check(100.0)
    check.look(facts(stop=stopped(), lag=0.9), 101.0)
    assert not check.look(facts(), 102.0)
    assert (check.is_over, check.passed) == (True, False)


@pytest.mark.parametrize(
    ("found", "waits", "why"),
    [
        (facts(), ARRIVES, "STOP did not reach the gate"),
        (facts(stop=stopped(False, why="no odometry")), CONFIRMS, ""),
        (facts(stop=stopped(), hooks=("stop hook /lock: no answer",)), CONFIRMS, ""),
    ],
)
def test_a_check_whose_stop_is_not_confirmed_fails(found, waits, why):
    check = Check(100.0)
    check.look(found, 100.0 + waits)
    assert not check.is_over
    check.look(found, 100.1 + waits)
    assert (check.is_over, check.passed, check.why) == (True, False, why)


def test_a_check_fails_that_the_gate_does_not_keep_or_nobody_finishes():
    check = Check(100.0)
    check.look(facts(stop=stopped()), 101.0)
    check.look(facts(), 102.0)
    check.look(facts(), 102.1 + ARRIVES)
    assert (check.passed, check.why[:8]) == (False, "the gate")
    check = Check(100.0)
    check.look(facts(stop=stopped()), 101.0)
    check.look(facts(stop=stopped()), 100.1 + LONGEST)
    assert check.why == "it was not finished within two minutes"


def test_a_check_is_due_only_where_one_is_demanded(monkeypatch):
    monkeypatch.setattr("time.time", lambda: 1000.0)
    due = [
        is_due(SimpleNamespace(check=each))
        for each in (
            None,
            CheckReport(None, "Ann", 1.0),
            CheckReport(60.0),
            CheckReport(60.0, "Ann", 950.0),
            CheckReport(60.0, "Ann", 930.0),
        )
    ]
    assert due == [False, False, True, False, True]


@pytest.fixture
def robot(tmp_path, monkeypatch):
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))
    monkeypatch.setattr(check_panel, "_known", {})
    bridge = SimpleNamespace(url="ws://user:secret@robot:9090")
    source = SimpleNamespace(bridge=bridge)
    return SimpleNamespace(name="Bob", id="r1", pose_source=source)


def test_the_last_check_is_kept_with_the_person_and_its_lines(
    robot, tmp_path, monkeypatch
):
    assert last_result(robot) is None
    check = Check(1.0)
    check.look(facts(stop=stopped(), lag=0.9), 2.0)
    check.look(facts(), 3.0)
    result = keep_result(robot, check, "Ann (desk 4)")
    assert last_result(robot) == result
    write_result(robot, result)
    monkeypatch.setattr(check_panel, "_known", {})
    again = last_result(robot)
    assert again == result
    assert (again.by, again.passed, again.lines[0].level) == (
        "Ann (desk 4)",
        False,
        "wrong",
    )
    (file,) = (tmp_path / "checks").iterdir()
    assert b"secret" not in file.read_bytes()
    assert file.stat().st_mode & 0o777 == 0o600


@pytest.mark.parametrize("content", [b"", b"{}", b'{"robot": 1}', b"[" * 10000])
def test_a_file_of_a_check_that_cannot_be_read_is_no_check(robot, content):
    file = check_panel._file_of(robot)
    file.parent.mkdir(parents=True)
    file.write_bytes(content)
    assert last_result(robot) is None


def test_a_check_that_cannot_be_written_is_logged(robot, tmp_path, caplog):
    (tmp_path / "checks").write_text("a file")
    write_result(robot, keep_result(robot, Check(1.0), "Ann"))
    assert "the check of Bob is not kept" in caplog.text
