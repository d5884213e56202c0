"""The small parts of the rules: ticks, leases, limits, dead-man, zeros, links."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from equipment.gate_harness import spec
from webmap.base.geometry import Twist
from webmap.gate.commands import Refusal
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
from webmap.gate.specs import Cap, Speed, caps_of, fit, ramp, speed_in_force

axis = st.floats(-1e308, 1e308)
positive = st.floats(0, 1e6)
near = st.floats(-10, 10)


def issue(ticks, *times):
    return [ticks.issue(now) for now in times]


class TestTicks:
    def test_ticks_are_issued_at_20_hz(self):
        ticks = Ticks(7)
        assert issue(ticks, 0.0, 0.02, 0.0501, 0.09, 0.1001) == [7, None, 8, None, 9]

    def test_missed_ticks_are_not_issued_after_a_pause(self):
        ticks = Ticks(7)
        assert issue(ticks, 0.0, 3.0, 3.01, 3.04, 3.05) == [7, 8, None, None, 9]

    def test_the_age_of_a_tick_counts_from_its_issue(self):
        ticks = Ticks(7)
        issue(ticks, 10.0, 10.05)
        assert ticks.age(7, 10.2) == pytest.approx(0.2)
        assert ticks.age(8, 10.2) == pytest.approx(0.15)

    @pytest.mark.parametrize("tick", [6, 9, 0, 2**60])
    def test_ticks_that_were_never_issued_are_refused(self, tick):
        ticks = Ticks(7)
        issue(ticks, 10.0, 10.05)
        assert ticks.age(tick, 10.1) is None
        with pytest.raises(Refusal, match="gate restart"):
            ticks.check(tick, 10.1)

    def test_ticks_older_than_300_ms_are_refused(self):
        ticks = Ticks(7)
        ticks.issue(0.0)
        ticks.check(7, 0.3)
        with pytest.raises(Refusal, match="over 300 ms"):
            ticks.check(7, 0.3001)

    def test_old_ticks_are_forgotten(self):
        ticks = Ticks(0)
        issue(ticks, *(n * 0.0501 for n in range(100)))
        assert ticks.age(0, 5.0) is None
        assert ticks.age(99, 5.0) is not None

    def test_two_sessions_begin_with_different_ticks(self):
        assert Ticks().newest != Ticks().newest


class TestLeases:
    lease = Lease("a", "Ann", 3)
    by_program = Lease("program", "program", 4, program=True)

    def test_epochs_only_increase_and_differ_between_sessions(self):
        epochs = Epochs(5)
        assert [epochs.next() for _ in range(3)] == [6, 7, 8]
        assert Epochs().next() != Epochs().next()

    def test_a_free_robot_can_be_taken(self):
        check_take(None, "operator", program=False)
        check_take(None, "admin", program=True)

    def test_a_robot_of_an_operator_cannot_be_taken(self):
        for program in (False, True):
            with pytest.raises(Refusal, match="Ann has control"):
                check_take(self.lease, "operator", program)

    def test_an_operator_can_take_a_robot_from_a_program_but_a_program_cannot(self):
        check_take(self.by_program, "operator", program=False)
        with pytest.raises(Refusal):
            check_take(self.by_program, "operator", program=True)

    def test_a_viewer_cannot_take_a_robot(self):
        with pytest.raises(Refusal, match="viewers"):
            check_take(None, "viewer", program=False)
        check_role("operator")

    def test_the_lease_check_accepts_only_the_holder_with_the_current_epoch(self):
        check_lease(self.lease, "a", 3)
        for lease, who, epoch in [
            (None, "a", 3),
            (self.lease, "b", 3),
            (self.lease, "a", 2),
            (self.lease, "a", 4),
        ]:
            with pytest.raises(Refusal):
                check_lease(lease, who, epoch)

    def test_a_refusal_names_a_holder_without_a_name_by_its_connection(self):
        with pytest.raises(Refusal, match="c5 has control"):
            check_lease(Lease("c5", "", 3), "a", 3)
        with pytest.raises(Refusal, match="c5 has control"):
            check_take(Lease("c5", "", 3), "operator", program=False)


class TestLimits:
    def in_force(self, *more, **changes):
        return speed_in_force([*caps_of(spec(**changes).base), *more])

    def test_the_lowest_limits_are_in_force_with_their_reasons(self):
        page = Cap(0.4, 9.0, "normal limit")
        assert self.in_force(page) == Speed(
            0.4, 1.5, ("limit of the robot", "normal limit")
        )

    def test_a_robot_without_a_verified_stop_gets_the_slow_limits(self):
        speed = self.in_force(stops_within=None)
        assert speed == Speed(0.3, 0.6, ("stop not verified",))

    def test_a_robot_with_a_long_command_timeout_gets_the_slow_limits(self):
        speed = self.in_force(stops_within=0.8)
        assert (speed.v, speed.w) == (0.3, 0.6)
        assert "0.8 s" in speed.why[0]

    def test_a_robot_without_stated_limits_gets_the_slow_limits(self):
        speed = self.in_force(v_max=None, w_max=None)
        assert speed == Speed(0.3, 0.6, ("no limit stated",))

    def test_a_missing_limit_is_replaced_by_the_slow_limit(self):
        speed = self.in_force(v_max=None)
        assert (speed.v, speed.w) == (0.3, 0.6)
        assert set(speed.why) == {"limit of the robot", "no limit stated"}

    def test_no_limits_at_all_give_the_slow_limits(self):
        assert speed_in_force([]) == Speed(0.3, 0.6, ("no limit stated",))

    @given(axis, axis, axis, positive, positive, st.booleans())
    def test_no_velocity_exceeds_the_speed_limits_in_force(
        self, vx, vy, wz, v, w, holonomic
    ):
        twist = fit(Twist(vx, vy, wz), Speed(v, w, ()), holonomic=holonomic)
        assert math.hypot(twist.vx, twist.vy) <= v * (1 + 1e-12) + 1e-300
        assert abs(twist.wz) <= w
        assert holonomic or twist.vy == 0
        parts = (twist.vx, twist.vy, twist.wz)
        assert all(math.copysign(1, part) == 1 for part in parts if part == 0)

    def test_the_speed_limit_keeps_the_direction_of_the_velocity(self):
        twist = fit(Twist(3.0, -4.0, 0.0), Speed(1.0, 1.0, ()), holonomic=True)
        assert (twist.vx, twist.vy) == pytest.approx((0.6, -0.8))
        assert fit(Twist(-3.0), Speed(0.7, 1.0, ()), holonomic=False).vx == -0.7

    @given(near, near, near, near, st.floats(0.01, 10.0), st.floats(0.001, 0.1))
    def test_diagonal_acceleration_is_limited_like_acceleration_on_one_axis(
        self, x, y, vx, vy, a, dt
    ):
        found = ramp(Twist(x, y), Twist(vx, vy), a, dt)
        speed = math.hypot(found.vx, found.vy)
        assert speed <= math.hypot(x, y) + a * dt + 1e-9
        assert abs(found.vx) <= abs(vx) + 1e-9
        assert abs(found.vy) <= abs(vy) + 1e-9

    def test_braking_from_diagonal_motion_to_zero_is_not_ramped(self):
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

    def test_a_reversed_velocity_ramps_up_from_zero(self):
        assert ramp(Twist(1.0), Twist(-1.0), 1.0, 0.05).vx == pytest.approx(-0.05)


class TestDeadMan:
    ticks = itertools.count()

    def neutral_for(self, deadman, seconds, since=0.0):
        for n in range(round(seconds / 0.05) + 1):
            deadman.accept(True, next(self.ticks), since + n * 0.05)

    def test_the_dead_man_expires_after_its_timeout(self):
        deadman = DeadMan()
        assert deadman.expired(0.0)
        deadman.accept(True, next(self.ticks), 1.0)
        assert not deadman.expired(1.0 + DEADMAN - 1e-9)
        assert deadman.expired(1.0 + DEADMAN)

    def test_the_dead_man_arms_after_200_ms_of_released_inputs(self):
        deadman = DeadMan()
        self.neutral_for(deadman, NEUTRAL - 0.05)
        assert not deadman.armed
        self.neutral_for(deadman, 0.05, since=NEUTRAL)
        assert deadman.armed

    def test_a_press_restarts_the_200_ms(self):
        deadman = DeadMan()
        self.neutral_for(deadman, 0.15)
        deadman.accept(False, next(self.ticks), 0.2)
        deadman.accept(True, next(self.ticks), 0.25)
        assert not deadman.armed

    def test_a_gap_in_commands_restarts_the_200_ms(self):
        deadman = DeadMan()
        deadman.accept(True, next(self.ticks), 0.0)
        deadman.accept(True, next(self.ticks), 0.5)
        assert not deadman.armed

    def test_a_gap_in_commands_disarms_the_dead_man(self):
        deadman = DeadMan()
        self.neutral_for(deadman, 0.3)
        assert deadman.armed
        deadman.accept(False, next(self.ticks), 1.0)
        assert not deadman.armed

    def test_a_program_is_armed_without_released_inputs(self):
        deadman = DeadMan(needs_neutral=False)
        deadman.accept(False, next(self.ticks), 0.0)
        assert deadman.armed
        deadman.disarm()
        deadman.accept(False, next(self.ticks), 1.0)
        assert deadman.armed

    def test_commands_without_a_newer_tick_do_not_extend_the_dead_man(self):
        deadman, tick = DeadMan(), next(self.ticks)
        deadman.accept(True, tick, 1.0)
        deadman.accept(True, tick, 1.1)
        deadman.accept(True, tick - 1, 1.15)
        assert deadman.expired(1.0 + DEADMAN)

    def test_released_inputs_without_newer_ticks_never_arm_the_dead_man(self):
        deadman, tick = DeadMan(), next(self.ticks)
        for n in range(40):
            deadman.accept(True, tick, n * 0.05)
        assert not deadman.armed


class TestBurst:
    def zeros(self, times, burst=None):
        burst = burst or ZeroBurst()
        burst.start(times[0])
        return [t for t in times if burst.zero_due(t)], burst

    def test_a_burst_sends_zeros_at_20_hz_for_500_ms(self):
        times = [n * 0.01 for n in range(100)]
        zeros, burst = self.zeros(times)
        assert len(zeros) == 10
        assert zeros[0] == 0.0
        assert zeros[-1] < 0.5
        assert not burst.running

    def test_missed_zeros_are_not_sent_after_a_pause(self):
        zeros, _ = self.zeros([0.0, 0.32, 0.33, 0.34, 0.36])
        assert zeros == [0.0, 0.32, 0.36]

    def test_an_ended_burst_sends_no_zeros(self):
        burst = ZeroBurst()
        burst.start(0.0)
        burst.end()
        assert not burst.zero_due(0.0)


class TestHealth:
    def test_a_link_is_fresh_for_300_ms_after_an_answer(self):
        link = LinkHealth()
        assert not link.fresh(0.0)
        link.opened(0.0)
        assert not link.fresh(0.0), "no ping was sent yet"
        link.answered(0.0, 0.0)
        assert link.fresh(0.3)
        assert not link.fresh(0.31)
        link.answered(0.3, 0.3)
        assert link.fresh(0.6)
        link.closed()
        assert not link.fresh(0.6)
        assert not link.stalled(9.0)

    def test_a_late_answer_does_not_make_a_link_fresh(self):
        link = LinkHealth()
        link.opened(0.0)
        for asked_at in (0.0, 0.05, 0.1):
            link.answered(asked_at, asked_at + 0.4)
            assert not link.fresh(asked_at + 0.4)
        assert link.trips.p95 == pytest.approx(0.4)

    def test_a_link_without_answers_for_one_second_is_stalled(self):
        link = LinkHealth()
        link.opened(0.0)
        assert not link.stalled(1.0)
        assert link.stalled(1.01)
        link.answered(0.1, 1.0)
        assert not link.stalled(2.0)
        assert link.stalled(2.01)

    def test_a_ping_answer_confirms_only_what_was_sent_before_the_ping(self):
        link = LinkHealth()
        link.opened(1.0)
        assert not link.answered_since(0.9), "a handshake is no answer to a ping"
        link.answered(2.0, 2.5)
        link.answered(1.0, 2.6)
        assert link.answered_since(1.9)
        assert not link.answered_since(2.0)
        link.closed()
        assert not link.answered_since(1.9)
        link.opened(3.0)
        assert not link.answered_since(1.9), "the answer came over another link"
        assert link.trips.p95 is None

    def test_the_display_counts_as_alive_for_250_ms_after_a_heartbeat(self):
        pulse = DisplayPulse()
        assert pulse.fault(0.0)
        pulse.beat(0.0)
        assert pulse.fault(0.25) is None
        assert pulse.fault(0.26) == "the display process does not respond"
        pulse.beat(1.0)
        pulse.ended = "the end"
        assert pulse.fault(1.0) == "the end"


class TestConnection:
    def test_the_rate_limit_counts_events_within_one_second(self):
        rate = RateLimit(3)
        assert [rate.too_often(t) for t in (0.0, 0.5, 1.1, 1.2)] == [
            False,
            False,
            False,
            True,
        ]

    def test_invalid_page_speeds_set_a_limit_of_zero(self):
        connection = Connection("c1", "Ann", "operator")
        connection.set_speeds(math.nan, -1.0)
        assert (connection.cap.v, connection.cap.w) == (0.0, 0.0)
        connection.set_speeds(math.inf, 0.5)
        assert (connection.cap.v, connection.cap.w) == (math.inf, 0.5)

    def test_an_equal_refusal_is_reported_at_most_once_a_second(self):
        connection = Connection("c1", "Ann", "operator")
        is_new = connection.is_new_refusal
        assert is_new("r1", "drive", "why", 0.0)
        assert not is_new("r1", "drive", "why", 0.9)
        assert is_new("r1", "drive", "another", 0.9)
        assert is_new("r1", "drive", "why", 1.0)


def test_restarting_a_burst_of_zeros_never_shortens_the_burst():
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
