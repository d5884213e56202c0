"""A check before driving: proved by a STOP, kept on disk, demanded by the gate."""

import json
import time

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from equipment.gate_harness import KEY, URL, Bench, spec
from webmap.base.errors import ConfigError
from webmap.base.geometry import Twist
from webmap.config.motion import StopHook
from webmap.gate import actions, events, protocol
from webmap.gate.disk import Disk, Records, path_of
from webmap.gate.events import CheckRecord, Key
from webmap.gate.rules.check import PROVED_FOR, span
from webmap.gate.specs import checked

HOUR = 3600.0
HOOK = StopHook(topic="/lock", type="std_msgs/Bool")
NOT_CHECKED = "not checked within 12 h"


class Base:
    """Sends odometry at 20 Hz while time passes."""

    def __init__(self, bench):
        self.bench = bench
        self.velocity = Twist()

    def run(self, seconds):
        odometry = events.OdometryReceived
        self.bench.run(seconds, lambda: self.bench.handle(odometry(KEY, self.velocity)))


def demanding(**changes):
    return spec(odometry_topic="/odom", check_every=12 * HOUR, **changes)


@pytest.fixture
def bench():
    return Bench().begin(demanding())


@pytest.fixture
def base(bench):
    return Base(bench)


def stop_and_reset(bench, base, seconds=0.6):
    bench.send("a", op="stop", robot="r1")
    base.run(seconds)
    bench.send("a", op="reset", robot="r1")
    base.run(0.1)


def check(bench, who="a"):
    bench.send(who, op="check", robot="r1")


def pass_check(bench, base):
    stop_and_reset(bench, base)
    check(bench)
    base.run(0.1)


def test_a_robot_that_was_not_checked_drives_slowly_and_the_report_has_the_reason(
    bench,
):
    report = bench.report()
    assert (report.v, report.w, report.why) == (0.3, 0.6, (NOT_CHECKED,))
    assert report.check == protocol.CheckReport(12 * HOUR)
    drive(bench)
    assert max(write.twist.vx for write in bench.written) == pytest.approx(0.3)


def test_a_robot_that_was_checked_drives_at_its_own_limit(bench, base):
    pass_check(bench, base)
    report = bench.report()
    assert (report.v, report.why) == (1.0, ("limit of the robot",))
    assert report.check == protocol.CheckReport(12 * HOUR, "A", 1_790_000_000.0)
    drive(bench)
    assert bench.written[-1].twist.vx == pytest.approx(1.0)


def send(bench, x):
    bench.handle(events.OdometryReceived(KEY, Twist(x / 2)))
    bench.drive("a", x=x)


def drive(bench):
    """Take the robot, send released inputs, then drive, with odometry all the time."""
    bench.take("a")
    bench.run(0.4, lambda: send(bench, 0.0))
    bench.run(0.4, lambda: send(bench, 1.0))


def test_a_check_is_due_again_also_while_the_robot_is_driven(bench, base):
    pass_check(bench, base)
    bench.handle(events.CheckSaved(KEY, CheckRecord("A", 1.0, 12 * HOUR - 1.0)))
    drive(bench)
    assert bench.written[-1].twist.vx == pytest.approx(1.0)
    bench.run(0.5, lambda: send(bench, 1.0))
    assert bench.written[-1].twist.vx == pytest.approx(0.3)
    assert NOT_CHECKED in bench.report().why


def test_a_check_that_is_over_binds_a_program_from_its_first_velocity(bench, base):
    pass_check(bench, base)
    bench.now += 12 * HOUR  # nobody has control, so nothing is due meanwhile
    bench.handle(protocol.Heartbeat())
    bench.handle(events.PingAnswered(URL, bench.now))
    bench.take("a")
    assert NOT_CHECKED in bench.report().why


@pytest.mark.parametrize("age", [12 * HOUR + 1, -5.0])
def test_a_check_on_disk_that_is_old_or_of_the_future_does_not_count(age):
    bench = Bench().begin(demanding())
    bench.handle(events.LockState(KEY, True, checked=CheckRecord("Ann", 1.0, age)))
    bench.run(0.1)
    assert bench.report().why == (NOT_CHECKED,)
    assert bench.report().check.by == "Ann"
    bench.handle(events.LockState(KEY, True, checked=CheckRecord("Ann", 1.0, HOUR)))
    bench.run(0.1)
    assert bench.report().why == ("limit of the robot",)


def test_a_robot_that_demands_no_check_can_be_checked_and_is_not_slower(base):
    bench = base.bench = Bench().begin(spec(odometry_topic="/odom"))
    assert bench.report().check is None
    assert bench.report().v == 1.0
    pass_check(bench, base)
    assert bench.report().check == protocol.CheckReport(None, "A", 1_790_000_000.0)
    bench.handle(demanding())
    bench.run(0.1)
    assert bench.report().v == 1.0, "the check from before counts"


def test_a_check_without_a_proved_stop_is_refused(bench, base):
    check(bench)
    assert "press STOP" in bench.refusals()[-1].why
    stop_and_reset(bench, base, seconds=0.1)  # too short: not confirmed yet
    check(bench)
    bench.send("a", op="stop", robot="r1")
    base.run(0.6)
    check(bench)  # not reset yet
    assert bench.did(actions.SaveCheck) == []


def test_the_stop_of_a_robot_that_moves_on_proves_nothing(bench, base):
    base.velocity = Twist(0.2)
    stop_and_reset(bench, base, seconds=3.0)
    check(bench)
    assert bench.did(actions.SaveCheck) == []


def test_a_proof_counts_once_and_for_two_minutes(bench, base):
    stop_and_reset(bench, base)
    check(bench)
    check(bench)
    assert len(bench.did(actions.SaveCheck)) == 1
    stop_and_reset(bench, base)
    base.run(PROVED_FOR + 1)
    check(bench)
    assert len(bench.did(actions.SaveCheck)) == 1
    assert "press STOP" in bench.refusals()[-1].why


@pytest.mark.parametrize(("answer", "saved"), [(None, 1), ("no answer", 0)])
def test_a_stop_proves_something_only_when_its_hooks_were_answered(answer, saved):
    bench = Bench().begin(demanding(stop_hooks=(HOOK,)))
    base = Base(bench)
    bench.send("a", op="stop", robot="r1")
    base.run(0.6)
    run = bench.did(actions.RunHook)[-1]
    bench.handle(events.HookEnded("r1", HOOK, run.number, answer))
    bench.send("a", op="reset", robot="r1")
    check(bench)
    assert len(bench.did(actions.SaveCheck)) == saved


def test_a_stop_whose_hook_has_not_answered_yet_proves_nothing():
    bench = Bench().begin(demanding(stop_hooks=(HOOK,)))
    stop_and_reset(bench, Base(bench))
    check(bench)
    assert bench.did(actions.SaveCheck) == []


def test_viewers_and_programs_of_other_displays_cannot_report_a_check(bench, base):
    bench.join("v", "viewer")
    bench.handle(protocol.Connect("p", "P", "operator", program=True))
    stop_and_reset(bench, base)
    check(bench, "v")
    check(bench, "p")
    assert bench.did(actions.SaveCheck) == []
    assert bench.refusals("v")[-1].what == "check"


def test_a_robot_that_takes_only_goals_has_no_check():
    bench = Bench().begin(spec(twist_topic=None, check_every=HOUR))
    check(bench)
    assert bench.refusals()[-1].why == "the robot has no velocity topic"


def test_a_check_of_a_robot_that_is_gone_changes_nothing(bench):
    bench.handle(events.CheckSaved(Key(URL, "/other"), CheckRecord("A", 1.0, 0.0)))
    bench.run(0.1)
    assert bench.report().why == (NOT_CHECKED,)


def test_the_shortest_demand_of_the_robots_of_a_machine_counts(bench, base):
    pass_check(bench, base)
    bench.handle(spec(id="r2", odometry_topic="/odom", check_every=60.0))
    bench.handle(events.CheckSaved(KEY, CheckRecord("A", 1.0, 61.0)))
    bench.run(0.1)
    assert bench.report().why == ("not checked within 1 min",)


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan"), float("inf")])
def test_a_demand_that_is_no_time_is_refused(seconds):
    with pytest.raises(ConfigError, match="check_every"):
        checked(spec(check_every=seconds))


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(43200.0, "12 h"), (5400.0, "1.5 h"), (600.0, "10 min"), (30.0, "30 s")],
)
def test_a_span_is_in_the_largest_unit(seconds, text):
    assert span(seconds) == text


EVERY = 10.0
"""Seconds for which a check counts in the schedules below."""


@given(
    st.lists(
        st.sampled_from(["drive", "drive", "stop", "still", "moves", "silence"])
        | st.sampled_from(["reset", "check", "answer", "reset and check", "wait"]),
        max_size=14,
    )
)
@example(["stop", "still", "answer", "reset and check", "drive", "wait", "drive"])
@settings(max_examples=25, deadline=None)
def test_no_schedule_drives_fast_without_a_check_that_was_proved_and_is_recent(todo):
    bench = Bench().begin(
        spec(odometry_topic="/odom", check_every=EVERY, stop_hooks=(HOOK,))
    )
    base = Base(bench)
    stood, answered, proved, saves = 0.0, False, False, []
    for each in todo:
        before = len(bench.did(actions.SaveCheck))
        match each:
            case "drive":
                drive(bench)
            case "stop":
                bench.send("a", op="stop", robot="r1")
                stood, answered = 0.0, False
            case "still" | "moves":
                base.velocity = Twist(0.3 if each == "moves" else 0.0)
                base.run(0.5)
                stood = stood + 0.5 if each == "still" else 0.0
            case "silence":
                bench.run(2.5)
                stood = 0.0
            case "answer":
                for run in bench.did(actions.RunHook)[-1:]:
                    ended = events.HookEnded("r1", HOOK, run.number, None)
                    bench.handle(ended)
                    answered = answered or run.stopped
            case "wait":
                bench.run(EVERY)
                stood = 0.0
        if each in ("reset", "reset and check") and bench.report().stop is not None:
            bench.send("a", op="reset", robot="r1")
            proved = stood > 0.3 and answered
        if each in ("check", "reset and check"):
            check(bench)
        if len(bench.did(actions.SaveCheck)) > before:
            assert proved, todo
            proved = False
            saves.append(bench.now)
    for write in bench.written:
        recent = any(0 <= write.at - at <= EVERY + 0.03 for at in saves)
        assert write.twist.vx <= (1.0 if recent else 0.3) + 1e-9, todo


# On disk.


def test_a_check_is_kept_with_its_name_and_its_time(tmp_path):
    records = Records(tmp_path)
    assert records.check_of(KEY) is None
    records.keep_check(KEY, "Ann", time.time() - 100.0)
    found = Records(tmp_path).check_of(KEY)
    assert found.by == "Ann"
    assert found.age == pytest.approx(100.0, abs=30.0)
    assert records.check_of(Key(URL, "/other")) is None


@pytest.mark.parametrize(
    "content",
    [
        "",
        "null",
        "[]",
        '{"by": "Ann"}',
        '{"by": 7, "at": 1}',
        '{"by": "A", "at": -1}',
        '{"by": "A", "at": NaN}',
        '{"by": "A", "at": "now"}',
        "[" * 5000,
    ],
)
def test_a_file_of_a_check_that_is_not_valid_is_no_check(tmp_path, content):
    path_of(tmp_path, KEY, "check").write_text(content)
    assert Records(tmp_path).check_of(KEY) is None


def test_a_check_that_cannot_be_written_is_logged_and_nothing_fails(tmp_path, caplog):
    (tmp_path / "file").write_text("")
    Records(tmp_path / "file" / "state").keep_check(KEY, "Ann", 1.0)
    assert "file" in caplog.text


def test_the_disk_keeps_and_recalls_a_check(tmp_path):
    disk = Disk(Records(tmp_path))
    saved = disk._do(actions.SaveCheck(KEY, "Ann"))
    assert isinstance(saved, events.CheckSaved)
    state = Disk(Records(tmp_path)).recall(events.LockState(KEY, held=True))
    assert state.checked.by == "Ann"
    assert state.checked.at == saved.record.at
    content = json.loads(path_of(tmp_path, KEY, "check").read_text())
    assert content["topic"] == "/cmd_vel"
