"""The reports of motion after a zero, and of the age of the control loop."""

import pytest

from equipment.gate_harness import KEY, ZERO, Bench, spec
from webmap.base.geometry import Twist
from webmap.gate import actions, events
from webmap.gate.protocol import MAY_MOVE
from webmap.gate.rules.health import Ages
from webmap.gate.rules.motion import DEADMAN
from webmap.gate.rules.obedience import Obedience
from webmap.gate.rules.speeds import LoopAge, governed, reaction
from webmap.gate.specs import Speed


class TestAlarm:
    @pytest.fixture
    def bench(self):
        bench = Bench().begin(spec(odometry_topic="/odom"))
        bench.take("a")
        self.run(bench, 0.4, 0.0, x=0.0)
        self.run(bench, 0.3, 0.5, x=0.5)
        return bench

    def run(self, bench, seconds, speed, x=None, turn=0.0):
        def each():
            bench.handle(events.OdometryReceived(KEY, Twist(speed, 0.0, turn)))
            if x is not None:
                bench.drive(x=x)

        bench.run(seconds, each)

    def test_motion_one_second_after_zero_raises_an_alarm(self, bench):
        self.run(bench, 0.95, 0.31, x=0.0)
        assert bench.report().alarm is None
        self.run(bench, 0.2, 0.31, x=0.0)
        assert bench.report().alarm == "zero sent, still moving at 0.31 m/s"
        self.run(bench, 0.2, 0.05, x=0.0)
        assert bench.report().alarm == "zero sent, still moving at 0.31 m/s"
        self.run(bench, 0.25, 0.05, x=0.0)
        assert bench.report().alarm is None

    def test_rotation_one_second_after_zero_raises_an_alarm(self, bench):
        self.run(bench, 0.95, 0.0, x=0.0, turn=-0.8)
        assert bench.report().alarm is None
        self.run(bench, 0.2, 0.0, x=0.0, turn=-0.8)
        assert bench.report().alarm == "zero sent, still turning at 0.80 rad/s"
        self.run(bench, 0.45, 0.0, x=0.0, turn=-0.1)
        assert bench.report().alarm is None

    def test_motion_after_the_release_of_control_raises_an_alarm(self, bench):
        bench.send("a", op="release", robot="r1")
        self.run(bench, 1.1, 0.31)
        assert bench.report().alarm
        self.run(bench, 0.5, 0.0)
        assert bench.report().alarm is None
        assert bench.did(actions.Watch)[-1] == actions.Watch(KEY, False)

    def test_motion_during_a_stop_raises_an_alarm(self, bench):
        bench.send("b", op="stop", robot="r1")
        self.run(bench, 1.1, 0.31)
        assert bench.report().alarm

    def test_motion_after_a_standstill_raises_no_alarm(self, bench):
        self.run(bench, 0.45, 0.0, x=0.0)
        self.run(bench, 3.0, 0.4, x=0.0)
        assert bench.report().alarm is None

    def other(self, bench, seconds, speed, **drives):
        """Let another program write 0.1 m/s, and odometry report a speed."""

        def each():
            bench.handle(events.EchoReceived(KEY, Twist(0.1)))
            bench.handle(events.OdometryReceived(KEY, Twist(speed)))
            if drives:
                bench.drive(**drives)

        bench.run(seconds, each)

    def test_motion_by_another_program_after_the_zeros_raises_an_alarm(self, bench):
        """The zeros of the gate hold the robot back while the other one drives it."""
        self.other(bench, 2.0, 0.5, x=0.5)
        bench.send("a", op="release", robot="r1")
        self.other(bench, 0.45, 0.03)
        assert bench.report().state == "stopping"
        self.other(bench, 0.7, 0.1)
        assert bench.report().alarm == "zero sent, still moving at 0.10 m/s"
        assert "another program publishes" in bench.report().other_writer
        self.other(bench, 0.5, 0.0)
        assert bench.report().alarm is None

    def test_a_standstill_during_a_stop_ends_the_alarm_while_another_program_drives(
        self, bench
    ):
        self.other(bench, 2.0, 0.5, x=0.5)
        bench.send("b", op="stop", robot="r1")
        self.other(bench, 1.2, 0.1)
        assert bench.report().alarm
        self.other(bench, 0.5, 0.0)
        assert bench.report().alarm is None
        self.other(bench, 0.2, 0.1)
        assert bench.report().alarm, "it moves again"

    @pytest.mark.parametrize("timeout", [None, 0.4])
    def test_a_driven_robot_without_a_timeout_may_move_on_when_its_bridge_is_lost(
        self, timeout
    ):
        bench = Bench().begin(spec(odometry_topic="/odom", stops_within=timeout))
        bench.break_links()
        assert bench.report().alarm is None, "it was not driven"
        bench.connect_links()
        bench.take("a")
        self.run(bench, 0.4, 0.0, x=0.0)
        self.run(bench, 0.3, 0.3, x=0.5)
        assert bench.report().state == "driving"
        bench.break_links()
        bench.run(1.0)
        assert bench.report().alarm == (MAY_MOVE if timeout is None else None)
        bench.connect_links()
        assert bench.report().alarm is None
        bench.run(4.0)
        bench.break_links()
        assert bench.report().alarm is None, "the zero has arrived"

    def test_a_motion_of_an_earlier_gate_is_no_reason_for_the_alarm(self):
        bench = Bench(was_driven=True)
        bench.handle(spec(odometry_topic="/odom", stops_within=None))
        bench.run(0.2)
        assert bench.report().link == "down"
        assert bench.report().alarm is None

    def test_motion_after_a_goal_was_sent_raises_no_alarm(self, bench):
        bench.goal()
        self.run(bench, 3.0, 0.4, x=0.0)
        assert bench.report().alarm is None

    def test_driving_again_after_zero_raises_no_alarm(self, bench):
        self.run(bench, 0.1, 0.5, x=0.0)
        self.run(bench, 3.0, 0.5, x=0.5)
        assert bench.report().alarm is None

    def test_watching_ends_soon_for_a_released_robot_without_odometry(self, bench):
        bench.send("a", op="release", robot="r1")
        bench.run(3.0)
        assert bench.did(actions.Watch)[-1] == actions.Watch(KEY, False)
        assert bench.report().alarm is None

    def test_motion_after_a_long_gap_in_odometry_raises_no_alarm(self):
        obedience = Obedience()
        obedience.on_written(ZERO, Twist(0.5), 0.0)
        obedience.observe(None, 0.5)
        assert obedience.alarm(1.5) is None
        obedience.observe(Twist(0.5), 9.0)
        assert obedience.alarm(9.5) is None
        assert not obedience.watching(9.5)

    def test_a_gap_in_odometry_does_not_end_an_alarm(self, bench):
        self.run(bench, 1.2, 0.31, x=0.0)
        bench.hold(1.5)
        assert bench.report().alarm == (
            "zero sent, still moving at 0.31 m/s, then odometry ended"
        )
        self.run(bench, 0.2, 0.3, x=0.0)
        assert bench.report().alarm == "zero sent, still moving at 0.30 m/s"
        self.run(bench, 0.6, 0.0, x=0.0)
        assert bench.report().alarm is None

    @pytest.mark.slow
    def test_an_alarm_ends_after_a_minute_without_odometry_and_returns_with_motion(
        self, bench
    ):
        self.run(bench, 1.2, 0.31, x=0.0)
        bench.hold(59.0, step=0.05)
        assert bench.report().alarm
        bench.hold(3.0)
        assert bench.report().alarm is None
        self.run(bench, 0.2, 0.31, x=0.0)
        assert bench.report().alarm == "zero sent, still moving at 0.31 m/s"

    def test_motion_first_measured_late_during_a_stop_raises_an_alarm(self, bench):
        bench.send("b", op="stop", robot="r1")
        bench.run(9.0)
        assert bench.report().alarm is None
        self.run(bench, 0.2, 0.31)
        assert bench.report().alarm == "zero sent, still moving at 0.31 m/s"

    def test_a_restarted_gate_raises_an_alarm_for_motion_after_its_zeros(self):
        bench = Bench(was_driven=True).begin(spec(odometry_topic="/odom"))
        assert bench.written
        self.run(bench, 1.2, 0.31)
        assert bench.report().alarm == "zero sent, still moving at 0.31 m/s"

    def test_the_measured_velocity_is_reported_only_while_odometry_arrives(self, bench):
        assert bench.report().measured == Twist(0.5).numbers
        bench.hold(0.9, x=0.5)
        assert bench.report().measured == Twist(0.5).numbers
        bench.hold(0.3)
        assert bench.report().measured is None

    def test_the_one_second_delay_of_an_alarm_starts_at_the_first_zero(self):
        obedience = Obedience()
        obedience.on_written(ZERO, Twist(0.5), 0.0)
        obedience.on_written(ZERO, ZERO, 0.5)
        obedience.expect(0.6)
        obedience.observe(Twist(0.2), 0.9)
        assert obedience.alarm(0.95) is None
        assert obedience.alarm(1.0) == "zero sent, still moving at 0.20 m/s"

    def test_single_odometry_messages_of_standstill_do_not_prevent_an_alarm(self):
        obedience = Obedience()
        obedience.on_written(ZERO, Twist(0.5), 0.0)
        for n in range(1, 200):
            now = n * 0.02
            obedience.observe(ZERO if n % 6 == 0 else Twist(0.5), now)
            expected = "zero sent, still moving at 0.50 m/s" if now >= 1.0 else None
            assert obedience.alarm(now) == expected, now

    def test_an_alarm_ends_after_a_lasting_standstill(self):
        obedience = Obedience()
        obedience.on_written(ZERO, Twist(0.5), 0.0)
        obedience.observe(Twist(0.5), 0.9)
        obedience.observe(Twist(0.0, 0.0, 0.4), 1.4)
        assert obedience.alarm(1.4) == "zero sent, still turning at 0.40 rad/s"
        obedience.observe(Twist(0.04), 1.5)
        assert obedience.alarm(1.6) == "zero sent, still turning at 0.40 rad/s"
        obedience.observe(Twist(0.04), 1.85)
        assert obedience.alarm(1.85) is None
        obedience.observe(Twist(0.5), 1.9)
        assert obedience.alarm(2.0) is None, "the motion has another cause"

    def test_a_standstill_in_time_raises_no_alarm_until_the_robot_moves_again(self):
        obedience = Obedience()
        obedience.on_written(ZERO, Twist(0.5), 0.0)
        obedience.observe(Twist(0.3), 0.9)
        obedience.observe(ZERO, 0.98)
        assert obedience.alarm(1.1) is None
        obedience.observe(ZERO, 1.1)
        assert obedience.alarm(1.1) is None
        obedience.observe(Twist(0.3), 1.2)
        assert obedience.alarm(1.2) == "zero sent, still moving at 0.30 m/s"


class TestLoopAge:
    def test_the_loop_age_is_the_95th_percentile_of_the_last_two_seconds(self):
        ages = LoopAge(Ages())
        assert ages.p95 is None
        for n in range(40):
            ages.add(0.05 if n else 0.25, n * 0.05)
        assert ages.p95 == 0.05
        for n in range(4):
            ages.add(0.2, 2.0 + n * 0.05)
        ages.forget_old(2.2)
        assert ages.p95 == 0.2
        ages.forget_old(9.0)
        assert ages.p95 is None
        ages.add(0.1, 9.0)
        ages.clear()
        assert ages.p95 is None

    def test_the_loop_age_is_reported_only_while_the_holder_sends_commands(self):
        bench = Bench().begin()
        bench.take()
        assert bench.report().age is None
        bench.hold(1.0)
        assert 0 <= bench.report().age <= 50
        bench.send("a", op="release", robot="r1")
        assert bench.report().age is None

    @pytest.mark.parametrize("ms", [151, 180, 200, 250, 300])
    @pytest.mark.parametrize("stop", [None, 0.1, 0.25, 0.5])
    def test_a_slow_link_limits_the_distance_before_a_reaction_to_25_cm(self, ms, stop):
        speed = governed(Speed(5.0, 1.0, ()), ms / 1000, stop)
        assert speed.v * (ms / 1000 + DEADMAN + (stop or 0.5 * (stop is None))) <= 0.25
        assert speed.w == 1.0
        assert len(speed.why) == 1

    def test_a_fast_link_does_not_reduce_the_stated_speed_limit(self):
        bench = Bench().begin(spec(v_max=1.0, stops_within=0.25))
        bench.drive_off()
        assert bench.report().v == 1.0
        assert bench.written[-1].twist.vx == 1.0

    def test_a_link_is_slow_above_150_ms_and_fast_again_below_130_ms(self):
        ages = LoopAge(Ages())
        slow = []
        for n, ms in enumerate((50, 150, 151, 140, 131, 129, 145, 151)):
            ages.add(ms / 1000, 3.0 * n)
            ages.forget_old(3.0 * n)
            slow.append(ages.slow is not None)
        assert slow == [False, False, True, True, True, False, False, True]

    def test_a_slow_link_is_reported_even_if_it_does_not_reduce_the_speed(self):
        slow = Speed(0.1, 0.6, ())
        assert governed(slow, None, 0.25) is slow
        assert governed(slow, 0.172, 0.25) == Speed(
            0.1, 0.6, ("slow connection: 180 ms",)
        )

    def test_the_reaction_time_adds_loop_age_dead_man_and_command_timeout(self):
        assert reaction(None, None) == pytest.approx(DEADMAN + 0.5)
        assert reaction(0.1, 0.25) == pytest.approx(0.1 + DEADMAN + 0.25)

    def test_commands_with_old_ticks_reduce_the_speed_and_report_the_reason(self):
        bench = Bench().begin(spec(v_max=2.0, stops_within=0.25))
        assert bench.report().v == 2.0
        bench.take()
        late = []

        def each(x):
            late.append(bench.tick)
            bench.drive(x=x, tick=late[-5] if len(late) > 4 else late[0])

        bench.run(0.8, lambda: each(0.0))
        bench.run(0.5, lambda: each(1.0))
        report = bench.report()
        assert 200 <= report.age <= 250
        assert any(why.startswith("slow connection: 2") for why in report.why)
        reacted = report.age / 1000 + DEADMAN + 0.25
        assert bench.written[-1].twist.vx <= 0.25 / reacted
        assert report.reaction == pytest.approx(reacted, abs=0.001)

    def test_the_loop_age_includes_the_round_trip_to_the_robot(self):
        trips = Ages()
        ages = LoopAge(trips)
        trips.add(0.12, 0.0)
        assert ages.p95 is None, "no commands arrive"
        ages.add(0.05, 0.0)
        assert ages.p95 == pytest.approx(0.17)
        assert ages.slow == ages.p95
        ages.clear()
        ages.add(0.02, 1.0)
        assert ages.p95 == pytest.approx(0.14), (
            "the round trip does not depend on the driver"
        )
        ages.forget_old(2.5)
        assert ages.p95 == 0.02

    @pytest.mark.parametrize("rtt", [0.05, 0.1, 0.15, 0.25])
    def test_a_slow_link_to_the_robot_reduces_the_speed_and_reports_the_reason(
        self, rtt
    ):
        bench = Bench(rtt=rtt).begin(spec(v_max=2.0, stops_within=0.25))
        bench.drive_off()
        bench.hold(0.5, x=1.0)
        report = bench.report()
        assert rtt * 1000 <= report.age <= rtt * 1000 + 50
        slow = report.age > 150
        assert any(why.startswith("slow connection") for why in report.why) == slow
        reacted = report.age / 1000 + DEADMAN + 0.25
        bound = 0.25 / reacted if slow else 2.0
        assert bench.written[-1].twist.vx == report.v == pytest.approx(bound, abs=0.01)
        assert report.reaction == pytest.approx(reacted, abs=0.001)

    def test_a_robot_whose_bridge_answers_after_more_than_300_ms_is_not_driven(self):
        bench = Bench(rtt=0.9).begin()
        bench.drive_off()
        assert bench.moving_since(0.0) == []
        assert "no answer from" in bench.report().reason

    def test_the_reported_brake_is_the_stated_limit_or_a_low_default(self):
        assert Bench().begin().report().brake == 0.5
        assert Bench().begin(spec(a_max=1.5)).report().brake == 1.5
