"""When recorded messages are due, and the stamps that they then have."""

import pytest
from hypothesis import given
from hypothesis import strategies as some

from webmap.bags.times import LAST, SECOND, Pace

THEN, NOW = 1_500_000_000 * SECOND, 1_700_000_000 * SECOND


def test_at_rate_one_time_intervals_are_unchanged():
    pace = Pace(THEN, NOW)
    assert pace.due(THEN) == NOW
    assert pace.due(THEN + 12_345_678_901) == NOW + 12_345_678_901
    assert pace.moved(THEN - 40_000_001) == NOW - 40_000_001


def test_at_rate_four_time_intervals_are_a_quarter_as_long():
    pace = Pace(THEN, NOW, 4.0)
    assert pace.due(THEN + 8 * SECOND) == NOW + 2 * SECOND
    assert pace.moved(THEN + 8 * SECOND) == NOW + 2 * SECOND


def test_a_zero_stamp_stays_zero():
    assert Pace(THEN, NOW).moved(0) == 0


@pytest.mark.parametrize("stamp", [5 * SECOND, LAST - 1])
def test_a_stamp_that_would_leave_the_valid_range_is_unchanged(stamp):
    assert Pace(THEN, NOW, 0.1).moved(stamp) == stamp


def test_a_pause_of_three_seconds_delays_playing_by_three_seconds():
    pace = Pace(THEN, NOW, 2.0)
    pace.put_off(3 * SECOND)
    assert pace.at(NOW + 3 * SECOND) == THEN


@given(some.floats(0.01, 100.0), some.integers(0, 10**14))
def test_the_due_time_converts_back_to_the_time_of_the_recording(rate, after):
    pace = Pace(THEN, NOW, rate)
    assert pace.at(pace.due(THEN + after)) == pytest.approx(THEN + after, abs=1000)


@given(some.floats(0.01, 100.0), some.lists(some.integers(0, 10**14)))
def test_stamps_keep_their_order_at_every_rate(rate, stamps):
    pace = Pace(THEN, NOW, rate)
    moved = [pace.moved(THEN + stamp) for stamp in sorted(stamps)]
    assert moved == sorted(moved)
