"""The stop test: creep, send nothing more, and measure when the base stops."""

import pytest

from equipment.gate_harness import KEY, ZERO, Bench, spec
from webmap.base.geometry import Twist
from webmap.gate import actions, events, protocol
from webmap.gate.events import StopRecord
from webmap.gate.rules.motion import DEADMAN


class Machine:
    """A simulated base, with or without a command timeout."""

    def __init__(self, bench, timeout=0.3):
        self.bench = bench
        self.timeout = timeout
        self.speaks = True
        self.coarse = 0
        """Every so many odometry messages report zero, as from a coarse encoder."""
        self.sent = 0
        self.every = 1
        """Every so many commands there is an odometry message."""

    @property
    def speed(self):
        last = self.bench.written[-1] if self.bench.written else None
        if last is None or last.twist.is_zero:
            return 0.0
        stopped = self.timeout is not None and self.bench.now - last.at > self.timeout
        return 0.0 if stopped else last.twist.vx

    def run(self, seconds, x=0.0, who="a"):
        def each():
            if self.speaks:
                self.sent += 1
            if self.speaks and self.sent % self.every == 0:
                between = self.coarse and self.sent % self.coarse == 0
                speed = 0.0 if between else self.speed
                self.bench.handle(events.OdometryReceived(KEY, Twist(speed)))
            if x is not None:
                self.bench.drive(who, x=x)

        self.bench.run(seconds, each)


@pytest.fixture
def bench():
    """A bench where A has control and is armed; the robot has no verified stop."""
    bench = Bench().begin(spec(odometry_topic="/odom", stops_within=None))
    bench.take("a")
    Machine(bench).run(0.4)
    return bench


@pytest.fixture
def base(bench):
    return Machine(bench)


def begin(bench, who="a"):
    bench.send(who, op="stop-test", robot="r1")


def state(bench):
    test = bench.report().test
    return None if test is None else test.state


class TestRunning:
    def test_a_measured_command_timeout_raises_the_speed_limit(self, bench, base):
        assert bench.report().v == 0.3
        assert bench.report().stop_source is None
        begin(bench)
        base.run(0.1)
        crept = len(bench.written)
        assert state(bench) == "waiting"
        assert {w.twist for w in bench.written} == {Twist(0.1)}
        base.run(0.15)
        assert len(bench.written) == crept, "not even a zero is sent"
        base.run(0.6)
        report = bench.report()
        assert report.test.state == "done"
        assert "the base stopped after 0.3" in report.test.text
        assert report.stop_time == pytest.approx(0.35, abs=0.05)
        assert (report.stop_source, report.stop_date) == ("tested", "2026-11-21")
        assert report.v > 0.3
        assert "stop not verified" not in report.why
        assert bench.written[-1].twist == ZERO

    def test_every_slow_velocity_of_the_stop_test_answers_one_command_of_the_page(
        self, bench, base
    ):
        begin(bench)
        at = bench.now
        base.run(DEADMAN - 0.05, x=None)
        assert bench.since(at) == []
        bench.drive(x=0.0)
        assert len(bench.since(at - 0.01)) == 1

    def test_a_base_that_keeps_moving_fails_the_stop_test_and_gets_zero(self, bench):
        base = Machine(bench, timeout=None)
        begin(bench)
        base.run(0.2)
        left = bench.written[-1].at
        base.run(2.7)
        assert bench.written[-1].at == left
        assert state(bench) == "waiting"
        base.run(0.3)
        assert bench.written[-1].twist == ZERO
        report = bench.report()
        assert report.test == protocol.TestReport(
            "failed", "the base did not stop within 3 s"
        )
        assert (report.stop_time, report.stop_source) == (None, "tested")
        assert report.v == 0.3
        assert report.why == ("stop test failed on 2026-11-21",)

    def test_single_zeros_of_a_coarse_encoder_do_not_count_as_standstill(self, bench):
        base = Machine(bench, timeout=None)
        base.coarse = 6
        begin(bench)
        base.run(3.5)
        assert bench.report().test.text == "the base did not stop within 3 s"
        assert bench.report().stop_time is None

    def test_the_command_timeout_ends_where_the_lasting_standstill_begins(self, bench):
        base = Machine(bench, timeout=0.8)
        base.coarse = 6
        begin(bench)
        base.run(1.6)
        assert bench.report().stop_time == pytest.approx(0.85, abs=0.05)

    def test_a_base_that_stops_just_before_3_s_is_watched_until_standstill(self, bench):
        base = Machine(bench, timeout=2.8)
        begin(bench)
        base.run(3.1)
        assert state(bench) == "waiting"
        base.run(0.3)
        assert bench.report().test.text.startswith("the base stopped after 2.8")

    @pytest.mark.parametrize("foreign", [ZERO, Twist(0.2), Twist(0.1)])
    def test_a_velocity_of_another_program_fails_a_waiting_stop_test(
        self, bench, base, foreign
    ):
        begin(bench)
        base.run(0.1)
        assert state(bench) == "waiting"
        for write in bench.written:
            bench.handle(events.EchoReceived(KEY, write.twist))
        assert state(bench) == "waiting", "these echoes are the gate's own"
        bench.handle(events.EchoReceived(KEY, foreign))
        assert "another program sent commands" in bench.report().test.text
        assert state(bench) == "failed"
        assert bench.written[-1].twist == ZERO
        assert bench.did(actions.SaveStopTest) == []

    def test_a_zero_of_another_program_does_not_end_a_creeping_stop_test(
        self, bench, base
    ):
        begin(bench)
        bench.handle(events.EchoReceived(KEY, ZERO))
        assert state(bench) == "creeping"

    def test_a_base_with_a_long_command_timeout_keeps_the_low_speed_limit(self, bench):
        base = Machine(bench, timeout=1.0)
        begin(bench)
        base.run(1.5)
        assert state(bench) == "done"
        assert bench.report().v <= 0.3
        assert "command timeout of the base over 0.5 s: 1" in bench.report().why[0]

    def test_the_error_of_the_measurement_is_stated_and_fails_no_base(self, bench):
        """Odometry at 10 Hz and 40 ms to the base and back: 0.13 s too long."""
        bench.rtt = 0.04
        base = Machine(bench, timeout=0.48)
        base.every = 2
        begin(bench)
        base.run(1.6)
        report = bench.report()
        assert 0.5 < report.stop_time < 0.65
        (saved,) = bench.did(actions.SaveStopTest)
        assert saved.error == pytest.approx(0.14, abs=0.015)
        assert report.test.text == (
            f"the base stopped after {report.stop_time:.2f} s, or up to "
            f"{saved.error:.2f} s sooner (error of the measurement)"
        )
        assert not [why for why in report.why if "timeout" in why], report.why
        bench.handle(events.StopTestSaved(KEY, StopRecord(0.8, "2026-11-21", 0.4)))
        bench.run(0.1)
        assert bench.report().why[0].startswith("command timeout of the base over"), (
            "slow odometry excuses no long timeout"
        )

    def test_a_stop_test_of_a_base_that_does_not_move_saves_no_result(self, bench):
        base = Machine(bench, timeout=0.0)
        begin(bench)
        base.run(1.6)
        assert bench.report().test.text == "the robot did not move within 1.5 s"
        assert bench.did(actions.SaveStopTest) == []
        assert bench.written[-1].twist == ZERO
        assert bench.report().stop_source is None

    def test_a_stop_test_cancels_goals_when_it_begins(self, bench, base):
        bench.handle(protocol.Forget("r1"))
        begin(bench)
        assert bench.did(actions.CancelGoals) == []
        bench.handle(spec(odometry_topic="/odom", stops_within=None))
        bench.take("a")
        base.run(0.4)
        begin(bench)
        base.run(0.2)
        assert len(bench.did(actions.CancelGoals)) == 1

    def test_a_stop_test_can_be_repeated(self, bench, base):
        begin(bench)
        base.run(1.5)
        begin(bench)
        base.run(1.5)
        assert len(bench.did(actions.SaveStopTest)) == 2

    def test_a_machine_stays_marked_as_driven_while_the_stop_test_waits(
        self, bench, base
    ):
        begin(bench)
        base.run(0.25)
        assert state(bench) == "waiting"
        assert bench.did(actions.MarkDriven) == [actions.MarkDriven(KEY, True)]
        base.run(2.0)
        assert bench.did(actions.MarkDriven)[-1] == actions.MarkDriven(KEY, False)

    def test_odometry_without_a_velocity_does_not_end_the_stop_test(self, bench, base):
        begin(bench)
        base.run(0.2)
        bench.handle(events.OdometryReceived(KEY, None))
        assert state(bench) == "waiting"


class TestAbort:
    @pytest.mark.parametrize("phase", ["creeping", "waiting"])
    @pytest.mark.parametrize(
        ("doubt", "text"),
        [
            ("key", "an input was used"),
            ("silence", "the page stopped sending commands"),
            ("stop", "STOP by B"),
            ("release", "control was released"),
            ("page", "control was released"),
            ("blind", "no odometry for 1 s"),
            ("goal", "a goal was sent"),
            ("display", "the display process does not respond"),
            ("link", "no connection to ws://robot:9090"),
        ],
    )
    def test_an_interruption_fails_the_stop_test_and_sends_zero(
        self, bench, phase, doubt, text
    ):
        base = Machine(bench, timeout=None)
        begin(bench)
        base.run(0.05)
        if phase == "creeping":
            base.speaks = False
            base.run(0.05)
        else:
            base.run(0.2)
        assert state(bench) == phase
        at = bench.now
        match doubt:
            case "key":
                bench.drive(x=1.0)
            case "silence":
                base.run(0.25, x=None)
            case "stop":
                bench.send("b", op="stop", robot="r1")
            case "release":
                bench.send("a", op="release", robot="r1")
            case "page":
                bench.handle(protocol.Disconnect("a"))
            case "blind":
                base.speaks = False
                base.run(1.2)
            case "goal":
                bench.goal()
            case "display":
                bench.beating = False
                base.run(0.3)
            case "link":
                bench.break_links()
                bench.connect_links()
        assert bench.report().test == protocol.TestReport("failed", text)
        assert bench.written[-1].twist == ZERO
        assert bench.did(actions.SaveStopTest) == []
        base.run(0.5, x=1.0)
        pressed = [w for w in bench.moving_since(at) if w.twist != Twist(0.1)]
        assert pressed == []

    def test_the_first_command_after_a_pause_of_the_gate_fails_the_stop_test(
        self, bench, base
    ):
        begin(bench)
        base.run(0.05)
        bench.now += 0.25
        bench.handle(protocol.Heartbeat())
        bench.handle(events.PingAnswered(KEY.url, bench.now))
        bench.drive(x=0.0)
        assert bench.report().test.text == "the page stopped sending commands"
        assert bench.written[-1].twist == ZERO

    def test_after_a_press_during_the_stop_test_inputs_must_be_released_first(
        self, bench, base
    ):
        begin(bench)
        base.run(0.1)
        base.run(0.5, x=1.0)
        assert "release all inputs first" in bench.refusals()[-1].why
        assert bench.written[-1].twist == ZERO
        base.run(0.4)
        base.run(0.1, x=1.0)
        assert bench.written[-1].twist.vx == 0.3


class TestRefused:
    def why(self, bench, who="a"):
        begin(bench, who)
        assert state(bench) is None
        refused = bench.refusals(who)[-1]
        assert refused.what == "stop-test"
        return refused.why

    def test_a_stop_test_is_refused_without_control(self, bench):
        assert self.why(bench, "b") == "take control first"

    def test_a_stop_test_is_refused_without_recent_commands_with_released_inputs(
        self, bench, base
    ):
        base.run(0.3, x=None)
        assert self.why(bench) == "release all inputs first"

    def test_a_stop_test_is_refused_while_the_robot_is_driven(self, bench, base):
        base.run(0.2, x=1.0)
        assert self.why(bench) == "release all inputs first"

    @pytest.mark.parametrize("motion", [Twist(0.2), Twist(0.0, 0.0, 0.3)])
    def test_a_stop_test_is_refused_while_the_robot_is_already_moving(
        self, bench, motion
    ):
        bench.handle(events.OdometryReceived(KEY, motion))
        assert self.why(bench) == "the robot is already moving"

    def test_a_stop_test_is_refused_without_odometry(self):
        bench = Bench().begin(spec(stops_within=None))
        bench.take()
        bench.hold(0.4)
        assert "odometry" in self.why(bench)

    def test_a_stop_test_is_refused_without_a_link(self, bench):
        bench.break_links()
        assert "no connection" in self.why(bench)

    def test_a_stop_test_is_refused_while_another_stop_test_is_running(
        self, bench, base
    ):
        begin(bench)
        base.run(0.05)
        begin(bench)
        assert bench.refusals()[-1].why == "a stop test is running"


class TestSavedResult:
    def test_a_saved_stop_test_overrides_the_stated_command_timeout(self):
        tests = {KEY: StopRecord(0.8, "2026-11-20")}
        bench = Bench(tests=tests).begin(spec(stops_within=0.1))
        report = bench.report()
        assert (report.stop_time, report.stop_date) == (0.8, "2026-11-20")
        assert report.v <= 0.3

    def test_a_stop_test_result_for_a_removed_machine_is_ignored(self, bench):
        bench.handle(protocol.Forget("r1"))
        bench.run(1.0)
        bench.handle(events.StopTestSaved(KEY, StopRecord(0.2, "2026-11-20")))

    def test_a_stated_command_timeout_is_reported_as_stated(self):
        bench = Bench().begin(spec(stops_within=0.25))
        report = bench.report()
        assert (report.stop_time, report.stop_source) == (0.25, "stated")
        assert report.stop_date is None

    def test_the_worse_command_timeout_of_two_robots_on_one_machine_applies(self):
        bench = Bench().begin(spec(stops_within=0.25), spec(id="r2", stops_within=0.4))
        assert bench.report().stop_time == 0.4
        bench.handle(spec(id="r2", stops_within=None))
        assert bench.report().stop_time is None
