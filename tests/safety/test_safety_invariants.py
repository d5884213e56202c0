"""Each rule for the log of a robot's velocities reports a log that breaks it."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.base.geometry import Twist
from webmap.testing import Bounds, Quiet, ReceivedTwist, check_invariants


def received(*pairs, start=100.0):
    return [ReceivedTwist(start + at, Twist(vx)) for at, vx in pairs]


def drive(seconds=1.0, vx=0.5, start=0.0, zeros=0.5):
    """Return a correct activity: velocities at 20 Hz, then zeros, then nothing."""
    moving = [(start + n * 0.05, vx) for n in range(round(seconds / 0.05))]
    stop = start + seconds
    return [*moving, *((stop + n * 0.05, 0.0) for n in range(round(zeros / 0.05)))]


def test_a_log_without_velocities_breaks_no_invariant():
    assert check_invariants([]) == []


def test_driving_then_zeros_then_silence_breaks_no_invariant():
    log = received(*drive(), *drive(start=5.0))
    assert check_invariants(log, Bounds(v_max=0.5, a_max=5.0)) == []


def test_a_nonzero_last_velocity_is_reported():
    (found,) = check_invariants(received(*drive(zeros=0.0)))
    assert found == "0.950 s: an activity ended with a velocity that is not zero"


def test_a_missing_zero_is_reported_even_before_a_correct_second_activity():
    found = check_invariants(received(*drive(zeros=0.0), *drive(start=5.0)))
    assert ["an activity ended" in text for text in found] == [True]


def test_a_cut_link_excuses_a_missing_zero_if_the_next_velocity_is_zero():
    cut = [(100.9, 102.0)]
    first = drive(zeros=0.0)
    assert check_invariants(received(*first, (2.1, 0.0)), unreachable=cut) == []
    (found,) = check_invariants(
        received(*first, (2.1, 0.5), (2.15, 0.0)), unreachable=cut
    )
    assert found == "2.100 s: the first velocity after a cut is not zero"


def test_only_the_allowed_number_of_late_velocities_may_follow_a_cut():
    cut = [(100.9, 102.0)]
    log = received(*drive(zeros=0.0), (2.1, 0.5), (2.1, 0.5), (2.1, 0.0))
    assert check_invariants(log, Bounds(late=2), unreachable=cut) == []
    (found,) = check_invariants(log, Bounds(late=1), unreachable=cut)
    assert found == "2.100 s: 2 velocities after a cut come before the first zero"


@pytest.mark.parametrize("vx", [0.6, -0.6, math.nan, math.inf])
def test_a_linear_velocity_above_the_limit_or_not_finite_is_reported(vx):
    found = check_invariants(received((0, vx), (0.05, 0)), Bounds(v_max=0.5))
    assert len(found) == 1
    assert "limit" in found[0] or "finite" in found[0]


def test_an_angular_velocity_above_the_limit_is_reported():
    log = [ReceivedTwist(0.0, Twist(wz=1.0)), ReceivedTwist(0.05, Twist())]
    assert "rad/s is above" in check_invariants(log, Bounds(w_max=0.9))[0]


def test_motion_in_a_quiet_period_is_reported_with_its_time_and_count():
    quiet = Quiet(100.3, 100.8, "the browser was killed")
    (found,) = check_invariants(received(*drive()), quiet=[quiet])
    assert found.startswith("0.350 s: 9 moving velocities came up to 0.450 s after")
    assert found.endswith("the browser was killed")
    assert check_invariants(received(*drive()), quiet=[Quiet(101.0, 199.0, "")]) == []


def test_a_handover_without_a_zero_in_between_is_reported():
    log = received(*drive(seconds=1.0))
    (found,) = check_invariants(log, handovers=[100.48])
    assert "without a zero in between" in found
    assert (
        check_invariants(received(*drive(), *drive(start=2.0)), handovers=[101.8]) == []
    )


def test_endless_zeros_are_reported_once():
    (found,) = check_invariants(received(*drive(zeros=3.0)))
    assert found.startswith("1.650 s: zeros go on")


def test_a_stop_may_start_a_second_run_of_zeros():
    log = received(*drive(zeros=1.0))
    assert check_invariants(log, causes=[101.45]) == []


def test_too_fast_acceleration_is_reported_but_braking_is_not():
    log = received((0, 0.05), (0.05, 0.5), (0.1, 0.0))
    bounds = Bounds(a_max=1.0, slack=0.02)
    (found,) = check_invariants(log, bounds)
    assert "from 0.05 to 0.5 m/s" in found


@given(
    st.lists(st.floats(0.2, 2.0), min_size=1, max_size=4),
    st.integers(min_value=0, max_value=10**6),
)
def test_removing_the_zeros_of_any_activity_is_reported(lengths, choice):
    begin, activities = 0.0, []
    for length in lengths:
        activities.append(drive(seconds=length, start=begin))
        begin += length + 5.0
    assert check_invariants(received(*itertools.chain(*activities))) == []
    broken = choice % len(activities)
    activities[broken] = [(at, v) for at, v in activities[broken] if v]
    assert check_invariants(received(*itertools.chain(*activities)))


@given(
    st.lists(st.tuples(st.floats(0.001, 2.0), st.floats(-1.0, 1.0)), max_size=60),
)
def test_only_nonzero_velocities_in_a_quiet_period_are_reported(steps):
    at, log = 0.0, []
    for gap, vx in steps:
        at += gap
        log.append(ReceivedTwist(at, Twist(vx)))
    found = check_invariants(log, quiet=[Quiet(at / 2, math.inf, "here")])
    expected = any(t.at > at / 2 and not t.is_zero for t in log)
    assert any(text.endswith("here") for text in found) == expected
