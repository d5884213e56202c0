"""The small parts that decide: ticks, leases, limits, dead-man, zeros, links."""

import itertools
import math

import pytest
from gate_harness import spec
from hypothesis import given
from hypothesis import strategies as st

from webmap.base.geometry import Twist
from webmap.gate.commands import Refusal
from webmap.gate.limits import Cap, Speed, caps_of, fit, ramp, speed_in_force
from webmap.gate.rules.connections import (
    Connection,
    Epochs,
    Lease,
    RateLimit,
    Ticks,
    check_lease,
    check_role,
    check_take,
)
from webmap.gate.rules.health import DisplayPulse, LinkHealth
from webmap.gate.rules.motion import DEADMAN, NEUTRAL, DeadMan, ZeroBurst

axis = st.floats(-1e308, 1e308)
positive = st.floats(0, 1e6)
near = st.floats(-10, 10)


def issue(ticks, *times):
    return [ticks.issue(now) for now in times]


class TestTicks:
    def test_come_at_20_hz(self):
        ticks = Ticks(7)
        assert issue(ticks, 0.0, 0.02, 0.0501, 0.09, 0.1001) == [7, None, 8, None, 9]

    def test_are_not_caught_up_on_after_a_standstill(self):
        ticks = Ticks(7)
        assert issue(ticks, 0.0, 3.0, 3.01, 3.04, 3.05) == [7, 8, None, None, 9]

    def test_know_their_age(self):
        ticks = Ticks(7)
        issue(ticks, 10.0, 10.05)
        assert ticks.age(7, 10.2) == pytest.approx(0.2)
        assert ticks.age(8, 10.2) == pytest.approx(0.15)

    @pytest.mark.parametrize("tick", [6, 9, 0, 2**60])
    def test_that_were_not_issued_here_are_unknown(self, tick):
        ticks = Ticks(7)
        issue(ticks, 10.0, 10.05)
        assert ticks.age(tick, 10.1) is None
        with pytest.raises(Refusal, match="unknown"):
            ticks.check(tick, 10.1)

    def test_are_refused_after_300_ms(self):
        ticks = Ticks(7)
        ticks.issue(0.0)
        ticks.check(7, 0.3)
        with pytest.raises(Refusal, match="over 300 ms"):
            ticks.check(7, 0.3001)

    def test_are_forgotten_in_the_end(self):
        ticks = Ticks(0)
        issue(ticks, *(n * 0.0501 for n in range(100)))
        assert ticks.age(0, 5.0) is None
        assert ticks.age(99, 5.0) is not None

    def test_of_two_sessions_do_not_meet(self):
        assert Ticks().newest != Ticks().newest


class TestLeases:
    lease = Lease("a", "Ann", 3)
    by_program = Lease("program", "program", 4, program=True)

    def test_epochs_only_grow(self):
        epochs = Epochs(5)
        assert [epochs.next() for _ in range(3)] == [6, 7, 8]
        assert Epochs().next() != Epochs().next()

    def test_what_nobody_has_can_be_taken(self):
        check_take(None, "operator", program=False)
        check_take(None, "admin", program=True)

    def test_what_an_operator_has_cannot_be_taken(self):
        for program in (False, True):
            with pytest.raises(Refusal, match="Ann has control"):
                check_take(self.lease, "operator", program)

    def test_an_operator_takes_from_a_program_but_no_program_does(self):
        check_take(self.by_program, "operator", program=False)
        with pytest.raises(Refusal):
            check_take(self.by_program, "operator", program=True)

    def test_viewers_take_nothing(self):
        with pytest.raises(Refusal, match="viewers"):
            check_take(None, "viewer", program=False)
        check_role("operator")

    def test_only_the_holder_passes_and_only_by_its_own_epoch(self):
        check_lease(self.lease, "a", 3)
        for lease, who, epoch in [
            (None, "a", 3),
            (self.lease, "b", 3),
            (self.lease, "a", 2),
            (self.lease, "a", 4),
        ]:
            with pytest.raises(Refusal):
                check_lease(lease, who, epoch)

    def test_a_holder_without_a_name_is_called_by_its_connection(self):
        with pytest.raises(Refusal, match="c5 has control"):
            check_lease(Lease("c5", "", 3), "a", 3)
        with pytest.raises(Refusal, match="c5 has control"):
            check_take(Lease("c5", "", 3), "operator", program=False)


class TestLimits:
    def in_force(self, *more, **changes):
        return speed_in_force([*caps_of(spec(**changes)), *more])

    def test_the_least_is_in_force_and_says_why(self):
        page = Cap(0.4, 9.0, "limit of the page")
        assert self.in_force(page) == Speed(
            0.4, 1.5, ("limit of the robot", "limit of the page")
        )

    def test_a_robot_not_known_to_stop_by_itself_is_slow(self):
        speed = self.in_force(stops_within=None)
        assert speed == Speed(0.3, 0.6, ("stop not verified",))

    def test_a_robot_that_stops_late_is_slow(self):
        speed = self.in_force(stops_within=0.8)
        assert (speed.v, speed.w) == (0.3, 0.6)
        assert "0.8 s" in speed.why[0]

    def test_a_robot_without_limits_is_slow(self):
        speed = self.in_force(v_max=None, w_max=None)
        assert speed == Speed(0.3, 0.6, ("no limit stated",))

    def test_one_limit_that_is_missing_is_slow_and_the_other_stands(self):
        speed = self.in_force(v_max=None)
        assert (speed.v, speed.w) == (0.3, 0.6)
        assert set(speed.why) == {"limit of the robot", "no limit stated"}

    def test_nothing_known_at_all_is_slow(self):
        assert speed_in_force([]) == Speed(0.3, 0.6, ("no limit stated",))

    @given(axis, axis, axis, positive, positive, st.booleans())
    def test_no_wish_exceeds_the_speeds_in_force(self, vx, vy, wz, v, w, holonomic):
        twist = fit(Twist(vx, vy, wz), Speed(v, w, ()), holonomic=holonomic)
        assert math.hypot(twist.vx, twist.vy) <= v * (1 + 1e-12) + 1e-300
        assert abs(twist.wz) <= w
        assert holonomic or twist.vy == 0
        parts = (twist.vx, twist.vy, twist.wz)
        assert all(math.copysign(1, part) == 1 for part in parts if part == 0)

    def test_the_direction_is_kept(self):
        twist = fit(Twist(3.0, -4.0, 0.0), Speed(1.0, 1.0, ()), holonomic=True)
        assert (twist.vx, twist.vy) == pytest.approx((0.6, -0.8))
        assert fit(Twist(-3.0), Speed(0.7, 1.0, ()), holonomic=False).vx == -0.7

    @given(near, near, near, near, st.floats(0.01, 10.0), st.floats(0.001, 0.1))
    def test_speeding_up_aslant_is_ramped_as_along_one_axis(self, x, y, vx, vy, a, dt):
        found = ramp(Twist(x, y), Twist(vx, vy), a, dt)
        speed = math.hypot(found.vx, found.vy)
        assert speed <= math.hypot(x, y) + a * dt + 1e-9
        assert abs(found.vx) <= abs(vx) + 1e-9
        assert abs(found.vy) <= abs(vy) + 1e-9

    def test_a_stop_aslant_is_not_ramped(self):
        assert ramp(Twist(0.5, 0.5), Twist(), 1.0, 0.05) == Twist()

    @given(
        st.floats(-10, 10), st.floats(-10, 10), st.floats(0.01, 5), st.floats(0, 0.1)
    )
    def test_speeding_up_is_ramped_and_slowing_down_is_not(self, last, to, a, dt):
        speed = ramp(Twist(last), Twist(to), a, dt).vx
        assert abs(speed) <= abs(to)
        assert speed * to >= 0
        from_ = abs(last) if last * to > 0 else 0.0
        assert abs(speed) <= max(from_, 0) + a * dt + 1e-12 or abs(speed) == abs(to)
        if abs(to) <= from_:
            assert speed == to

    def test_turning_round_begins_at_standstill(self):
        assert ramp(Twist(1.0), Twist(-1.0), 1.0, 0.05).vx == pytest.approx(-0.05)


class TestDeadMan:
    ticks = itertools.count()

    def neutral_for(self, deadman, seconds, since=0.0):
        for n in range(round(seconds / 0.05) + 1):
            deadman.accept(True, next(self.ticks), since + n * 0.05)

    def test_holds_for_200_ms(self):
        deadman = DeadMan()
        assert deadman.expired(0.0)
        deadman.accept(True, next(self.ticks), 1.0)
        assert not deadman.expired(1.0 + DEADMAN - 1e-9)
        assert deadman.expired(1.0 + DEADMAN)

    def test_arms_after_200_ms_of_released_inputs(self):
        deadman = DeadMan()
        self.neutral_for(deadman, NEUTRAL - 0.05)
        assert not deadman.armed
        self.neutral_for(deadman, 0.05, since=NEUTRAL)
        assert deadman.armed

    def test_a_press_begins_the_200_ms_anew(self):
        deadman = DeadMan()
        self.neutral_for(deadman, 0.15)
        deadman.accept(False, next(self.ticks), 0.2)
        deadman.accept(True, next(self.ticks), 0.25)
        assert not deadman.armed

    def test_a_gap_begins_the_200_ms_anew(self):
        deadman = DeadMan()
        deadman.accept(True, next(self.ticks), 0.0)
        deadman.accept(True, next(self.ticks), 0.5)
        assert not deadman.armed

    def test_a_gap_disarms(self):
        deadman = DeadMan()
        self.neutral_for(deadman, 0.3)
        assert deadman.armed
        deadman.accept(False, next(self.ticks), 1.0)
        assert not deadman.armed

    def test_a_program_needs_no_neutral(self):
        deadman = DeadMan(needs_neutral=False)
        deadman.accept(False, next(self.ticks), 0.0)
        assert deadman.armed
        deadman.disarm()
        deadman.accept(False, next(self.ticks), 1.0)
        assert deadman.armed

    def test_a_command_that_echoes_no_newer_tick_holds_no_longer(self):
        deadman, tick = DeadMan(), next(self.ticks)
        deadman.accept(True, tick, 1.0)
        deadman.accept(True, tick, 1.1)
        deadman.accept(True, tick - 1, 1.15)
        assert deadman.expired(1.0 + DEADMAN)

    def test_hands_that_hear_nothing_are_never_seen_to_be_off(self):
        deadman, tick = DeadMan(), next(self.ticks)
        for n in range(40):
            deadman.accept(True, tick, n * 0.05)
        assert not deadman.armed


class TestBurst:
    def zeros(self, times, burst=None):
        burst = burst or ZeroBurst()
        burst.start(times[0])
        return [t for t in times if burst.zero_due(t)], burst

    def test_is_20_hz_for_500_ms_then_silence(self):
        times = [n * 0.01 for n in range(100)]
        zeros, burst = self.zeros(times)
        assert len(zeros) == 10
        assert zeros[0] == 0.0
        assert zeros[-1] < 0.5
        assert not burst.running

    def test_does_not_make_up_for_a_standstill(self):
        zeros, _ = self.zeros([0.0, 0.32, 0.33, 0.34, 0.36])
        assert zeros == [0.0, 0.32, 0.36]

    def test_can_be_ended(self):
        burst = ZeroBurst()
        burst.start(0.0)
        burst.end()
        assert not burst.zero_due(0.0)


class TestHealth:
    def test_only_a_link_that_answered_just_now_is_fresh(self):
        link = LinkHealth()
        assert not link.fresh(0.0)
        link.opened(0.0)
        assert not link.fresh(0.0), "nothing was asked yet"
        link.answered(0.0, 0.0)
        assert link.fresh(0.3)
        assert not link.fresh(0.31)
        link.answered(0.3, 0.3)
        assert link.fresh(0.6)
        link.closed()
        assert not link.fresh(0.6)
        assert not link.stalled(9.0)

    def test_an_answer_that_was_long_under_way_does_not_make_a_link_fresh(self):
        link = LinkHealth()
        link.opened(0.0)
        for asked_at in (0.0, 0.05, 0.1):
            link.answered(asked_at, asked_at + 0.4)
            assert not link.fresh(asked_at + 0.4)
        assert link.trips.p95 == pytest.approx(0.4)

    def test_a_link_that_says_nothing_for_a_second_is_stalled(self):
        link = LinkHealth()
        link.opened(0.0)
        assert not link.stalled(1.0)
        assert link.stalled(1.01)
        link.answered(0.1, 1.0)
        assert not link.stalled(2.0)
        assert link.stalled(2.01)

    def test_an_answer_counts_for_what_came_before_its_question(self):
        link = LinkHealth()
        link.opened(1.0)
        assert not link.answered_since(0.9), "a handshake says nothing of when"
        link.answered(2.0, 2.5)
        link.answered(1.0, 2.6)
        assert link.answered_since(1.9)
        assert not link.answered_since(2.0)
        link.closed()
        assert not link.answered_since(1.9)
        link.opened(3.0)
        assert not link.answered_since(1.9), "that was another link"
        assert link.trips.p95 is None

    def test_a_display_is_there_for_250_ms_after_its_heartbeat(self):
        pulse = DisplayPulse()
        assert pulse.fault(0.0)
        pulse.beat(0.0)
        assert pulse.fault(0.25) is None
        assert pulse.fault(0.26) == "the display process does not respond"
        pulse.beat(1.0)
        pulse.ended = "the end"
        assert pulse.fault(1.0) == "the end"


class TestConnection:
    def test_too_often_is_the_limit_within_a_second(self):
        rate = RateLimit(3)
        assert [rate.too_often(t) for t in (0.0, 0.5, 1.1, 1.2)] == [
            False,
            False,
            False,
            True,
        ]

    def test_speeds_that_make_no_sense_mean_standstill(self):
        connection = Connection("c1", "Ann", "operator")
        connection.set_speeds(math.nan, -1.0)
        assert (connection.cap.v, connection.cap.w) == (0.0, 0.0)
        connection.set_speeds(math.inf, 0.5)
        assert (connection.cap.v, connection.cap.w) == (math.inf, 0.5)

    def test_the_same_refusal_is_news_once_a_second(self):
        connection = Connection("c1", "Ann", "operator")
        news = connection.is_new_refusal
        assert news("r1", "drive", "why", 0.0)
        assert not news("r1", "drive", "why", 0.9)
        assert news("r1", "drive", "another", 0.9)
        assert news("r1", "drive", "why", 1.0)


def test_a_burst_that_begins_again_ends_no_earlier_than_it_would_have():
    burst = ZeroBurst(period=0.05, length=0.5)
    burst.start(0.0, 3.0)
    burst.start(1.0)
    assert due_until(burst, 1.0, 5.0) == pytest.approx(3.0, abs=0.06)
    burst.start(6.0)
    assert due_until(burst, 6.0, 9.0) == pytest.approx(6.5, abs=0.06)


def due_until(burst: ZeroBurst, now: float, end: float) -> float:
    """Return when a burst wrote its last zero."""
    last = now
    while now < end:
        if burst.zero_due(now):
            last = now
        now += 0.01
    return last
