"""What a page is told of a robot's obedience, and of how late everything is."""

import pytest
from gate_harness import KEY, ZERO, Bench, spec

from webmap.base.geometry import Twist
from webmap.gate import actions, events
from webmap.gate.limits import Speed
from webmap.gate.rules.health import Ages
from webmap.gate.rules.obedience import Obedience
from webmap.gate.rules.speeds import LoopAge, governed, reaction


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
            bench.tell(events.OdometryReceived(KEY, Twist(speed, 0.0, turn)))
            if x is not None:
                bench.drive(x=x)

        bench.run(seconds, each)

    def test_a_robot_that_moves_on_a_second_after_zero_is_said(self, bench):
        self.run(bench, 0.95, 0.31, x=0.0)
        assert bench.report().alarm is None
        self.run(bench, 0.2, 0.31, x=0.0)
        assert bench.report().alarm == "zero sent, still moving at 0.31 m/s"
        self.run(bench, 0.2, 0.05, x=0.0)
        assert bench.report().alarm == "zero sent, still moving at 0.31 m/s"
        self.run(bench, 0.25, 0.05, x=0.0)
        assert bench.report().alarm is None

    def test_a_robot_that_spins_on_is_said_as_well(self, bench):
        self.run(bench, 0.95, 0.0, x=0.0, turn=-0.8)
        assert bench.report().alarm is None
        self.run(bench, 0.2, 0.0, x=0.0, turn=-0.8)
        assert bench.report().alarm == "zero sent, still turning at 0.80 rad/s"
        self.run(bench, 0.45, 0.0, x=0.0, turn=-0.1)
        assert bench.report().alarm is None

    def test_also_when_its_driver_has_gone(self, bench):
        bench.say("a", op="release", robot="r1")
        self.run(bench, 1.1, 0.31)
        assert bench.report().alarm
        self.run(bench, 0.5, 0.0)
        assert bench.report().alarm is None
        assert bench.did(actions.Watch)[-1] == actions.Watch(KEY, False)

    def test_also_under_a_stop(self, bench):
        bench.say("b", op="stop", robot="r1")
        self.run(bench, 1.1, 0.31)
        assert bench.report().alarm

    def test_a_robot_that_stood_and_is_moved_by_others_is_no_alarm(self, bench):
        self.run(bench, 0.45, 0.0, x=0.0)
        self.run(bench, 3.0, 0.4, x=0.0)
        assert bench.report().alarm is None

    def test_a_robot_that_was_sent_somewhere_is_no_alarm(self, bench):
        bench.goal()
        self.run(bench, 3.0, 0.4, x=0.0)
        assert bench.report().alarm is None

    def test_driving_on_is_no_alarm(self, bench):
        self.run(bench, 0.1, 0.5, x=0.0)
        self.run(bench, 3.0, 0.5, x=0.5)
        assert bench.report().alarm is None

    def test_without_odometry_nobody_is_listened_to_for_long(self, bench):
        bench.say("a", op="release", robot="r1")
        bench.run(3.0)
        assert bench.did(actions.Watch)[-1] == actions.Watch(KEY, False)
        assert bench.report().alarm is None

    def test_odometry_after_a_long_silence_tells_nothing_of_that_zero(self):
        obedience = Obedience()
        obedience.on_written(ZERO, Twist(0.5), 0.0)
        obedience.observe(None, 0.5)
        assert obedience.alarm(1.5) is None
        obedience.observe(Twist(0.5), 9.0)
        assert obedience.alarm(9.5) is None
        assert not obedience.watching(9.5)

    def test_a_gap_in_odometry_ends_no_alarm(self, bench):
        self.run(bench, 1.2, 0.31, x=0.0)
        bench.hold(1.5)
        assert bench.report().alarm == (
            "zero sent, still moving at 0.31 m/s, then odometry ended"
        )
        self.run(bench, 0.2, 0.3, x=0.0)
        assert bench.report().alarm == "zero sent, still moving at 0.30 m/s"
        self.run(bench, 0.6, 0.0, x=0.0)
        assert bench.report().alarm is None

    def test_after_a_minute_of_silence_it_ends_and_odometry_brings_it_back(self, bench):
        self.run(bench, 1.2, 0.31, x=0.0)
        bench.hold(59.0)
        assert bench.report().alarm
        bench.hold(3.0)
        assert bench.report().alarm is None
        self.run(bench, 0.2, 0.31, x=0.0)
        assert bench.report().alarm == "zero sent, still moving at 0.31 m/s"

    def test_under_a_stop_a_robot_that_is_seen_late_is_said_as_well(self, bench):
        bench.say("b", op="stop", robot="r1")
        bench.run(9.0)
        assert bench.report().alarm is None
        self.run(bench, 0.2, 0.31)
        assert bench.report().alarm == "zero sent, still moving at 0.31 m/s"

    def test_a_gate_that_was_started_anew_looks_whether_its_zeros_are_obeyed(self):
        bench = Bench(was_driven=True).begin(spec(odometry_topic="/odom"))
        assert bench.written
        self.run(bench, 1.2, 0.31)
        assert bench.report().alarm == "zero sent, still moving at 0.31 m/s"

    def test_what_odometry_said_is_shown_as_long_as_it_comes(self, bench):
        assert bench.report().measured == Twist(0.5).numbers
        bench.hold(0.9, x=0.5)
        assert bench.report().measured == Twist(0.5).numbers
        bench.hold(0.3)
        assert bench.report().measured is None

    def test_the_second_counts_from_the_first_zero(self):
        obedience = Obedience()
        obedience.on_written(ZERO, Twist(0.5), 0.0)
        obedience.on_written(ZERO, ZERO, 0.5)
        obedience.expect(0.6)
        obedience.observe(Twist(0.2), 0.9)
        assert obedience.alarm(0.95) is None
        assert obedience.alarm(1.0) == "zero sent, still moving at 0.20 m/s"

    def test_one_message_that_says_it_stands_in_every_six_excuses_nobody(self):
        obedience = Obedience()
        obedience.on_written(ZERO, Twist(0.5), 0.0)
        for n in range(1, 200):
            now = n * 0.02
            obedience.observe(ZERO if n % 6 == 0 else Twist(0.5), now)
            expected = "zero sent, still moving at 0.50 m/s" if now >= 1.0 else None
            assert obedience.alarm(now) == expected, now

    def test_it_ends_when_the_robot_has_stood_for_a_while(self):
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
        assert obedience.alarm(2.0) is None, "it is somebody else's business"

    def test_one_that_braked_in_time_raises_none_while_it_is_looked_at(self):
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
    def test_is_what_most_commands_of_two_seconds_stay_below(self):
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

    def test_is_told_while_somebody_drives(self):
        bench = Bench().begin()
        bench.take()
        assert bench.report().age is None
        bench.hold(1.0)
        assert 0 <= bench.report().age <= 50
        bench.say("a", op="release", robot="r1")
        assert bench.report().age is None

    @pytest.mark.parametrize("ms", [151, 180, 200, 250, 300])
    @pytest.mark.parametrize("stop", [None, 0.1, 0.25, 0.5])
    def test_over_a_slow_link_a_robot_goes_a_quarter_of_a_metre_blind(self, ms, stop):
        speed = governed(Speed(5.0, 1.0, ()), ms / 1000, stop)
        assert speed.v * (ms / 1000 + 0.2 + (stop or 0.5 * (stop is None))) <= 0.25
        assert speed.w == 1.0
        assert len(speed.why) == 1

    def test_over_a_quick_link_the_robot_has_the_speed_that_was_stated(self):
        bench = Bench().begin(spec(v_max=1.0, stops_within=0.25))
        bench.drive_off()
        assert bench.report().v == 1.0
        assert bench.written[-1].twist.vx == 1.0

    def test_a_link_is_slow_above_150_ms_and_quick_again_below_130(self):
        ages = LoopAge(Ages())
        slow = []
        for n, ms in enumerate((50, 150, 151, 140, 131, 129, 145, 151)):
            ages.add(ms / 1000, 3.0 * n)
            ages.forget_old(3.0 * n)
            slow.append(ages.slow is not None)
        assert slow == [False, False, True, True, True, False, False, True]

    def test_a_slow_link_is_said_even_if_it_takes_nothing(self):
        slow = Speed(0.1, 0.6, ())
        assert governed(slow, None, 0.25) is slow
        assert governed(slow, 0.172, 0.25) == Speed(
            0.1, 0.6, ("slow connection: 180 ms",)
        )

    def test_reaction_counts_the_hand_the_loop_and_the_base(self):
        assert reaction(None, None) == pytest.approx(0.7)
        assert reaction(0.1, 0.25) == pytest.approx(0.55)

    def test_a_late_driver_is_slowed_and_told(self):
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
        bound = 0.25 / (report.age / 1000 + 0.2 + 0.25)
        assert bench.written[-1].twist.vx <= bound
        assert report.reaction == pytest.approx(report.age / 1000 + 0.45, abs=0.001)

    def test_the_way_to_the_robot_and_back_is_part_of_the_loop(self):
        trips = Ages()
        ages = LoopAge(trips)
        trips.add(0.12, 0.0)
        assert ages.p95 is None, "nobody drives"
        ages.add(0.05, 0.0)
        assert ages.p95 == pytest.approx(0.17)
        assert ages.slow == ages.p95
        ages.clear()
        ages.add(0.02, 1.0)
        assert ages.p95 == pytest.approx(0.14), "another driver has the same robot"
        ages.forget_old(2.5)
        assert ages.p95 == 0.02

    @pytest.mark.parametrize("rtt", [0.05, 0.1, 0.15, 0.25])
    def test_a_robot_behind_a_slow_link_is_slowed_and_its_driver_told(self, rtt):
        bench = Bench(rtt=rtt).begin(spec(v_max=2.0, stops_within=0.25))
        bench.drive_off()
        bench.hold(0.5, x=1.0)
        report = bench.report()
        assert rtt * 1000 <= report.age <= rtt * 1000 + 50
        slow = report.age > 150
        assert any(why.startswith("slow connection") for why in report.why) == slow
        bound = 0.25 / (report.age / 1000 + 0.45) if slow else 2.0
        assert bench.written[-1].twist.vx == report.v == pytest.approx(bound, abs=0.01)
        assert report.reaction == pytest.approx(report.age / 1000 + 0.45, abs=0.001)

    def test_a_robot_whose_answers_take_longer_than_300_ms_is_not_driven(self):
        bench = Bench(rtt=0.9).begin()
        bench.drive_off()
        assert bench.moving_since(0.0) == []
        assert "no answer from" in bench.report().reason

    def test_brakes_are_what_was_stated_or_little(self):
        assert Bench().begin().report().brake == 0.5
        assert Bench().begin(spec(a_max=1.5)).report().brake == 1.5
