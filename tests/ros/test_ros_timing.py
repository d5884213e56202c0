import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.ros.backoff import Backoff
from webmap.ros.sockets.connection import Liveness
from webmap.ros.subscriptions import Throttle


def test_reconnection_delays_double_up_to_ten_seconds():
    backoff = Backoff(jitter=lambda: 1.0)
    assert [backoff.next() for _ in range(7)] == [0.5, 1, 2, 4, 8, 10, 10]
    backoff = Backoff(jitter=lambda: 0.0)
    assert [backoff.next() for _ in range(3)] == [0.25, 0.5, 1]


def test_a_long_lasting_link_resets_the_reconnection_delay():
    backoff = Backoff(jitter=lambda: 1.0)
    for _ in range(5):
        backoff.next()
    assert backoff.next(lasted=0.1) == 10
    assert backoff.next(lasted=60) == 0.5


def test_the_next_ping_is_due_only_half_a_second_after_the_last_answer():
    liveness = Liveness(0.0)
    assert not liveness.is_ping_due(0.4)
    assert liveness.is_ping_due(0.5)
    liveness.pinged(0.5)
    assert not liveness.is_ping_due(2.0)
    liveness.ponged(0.6)
    assert not liveness.is_ping_due(1.0)
    assert liveness.is_ping_due(1.1)


def test_after_a_slow_answer_the_next_ping_is_due_at_once():
    liveness = Liveness(0.0)
    liveness.pinged(0.5)
    assert not liveness.is_ping_due(2.0)
    liveness.ponged(2.0)
    assert liveness.is_ping_due(2.0)


class TestLag:
    def test_the_lag_is_zero_before_the_first_ping(self):
        assert Liveness(0.0).lag(0.4) == 0.0

    def test_the_lag_is_the_round_trip_of_the_last_ping(self):
        liveness = Liveness(0.0)
        liveness.pinged(0.5)
        liveness.ponged(0.7)
        assert liveness.lag(0.7) == pytest.approx(0.2)
        assert liveness.lag(1.2) == pytest.approx(0.2)

    def test_the_lag_grows_while_a_ping_is_unanswered(self):
        liveness = Liveness(0.0)
        liveness.pinged(0.5)
        liveness.ponged(0.7)
        liveness.pinged(1.2)
        assert liveness.lag(1.3) == pytest.approx(0.2)
        assert liveness.lag(2.2) == pytest.approx(1.0)

    def test_the_lag_falls_when_a_slow_link_is_fast_again(self):
        liveness = Liveness(0.0)
        liveness.pinged(0.5)
        liveness.ponged(2.5)
        liveness.pinged(2.5)
        liveness.ponged(2.51)
        assert liveness.lag(2.6) == pytest.approx(0.01)


def look(liveness, start, end, received=lambda _now: -math.inf):
    """Check four times a second; return when the link counts as dead."""
    now = start
    while now <= end:
        if liveness.is_dead(now, received(now)):
            return now
        now += 0.25
    return None


def test_a_link_is_dead_three_seconds_after_an_unanswered_ping():
    liveness = Liveness(0.0)
    liveness.pinged(0.0)
    assert look(liveness, 0.0, 10.0) == pytest.approx(3.25)


def test_incoming_bytes_keep_a_link_without_ping_answer_alive_for_a_minute():
    liveness = Liveness(0.0)
    liveness.pinged(0.0)
    assert look(liveness, 0.0, 20.0, lambda now: now - 1.0) is None
    liveness = Liveness(0.0)
    liveness.pinged(0.0)
    assert look(liveness, 0.0, 30.0, lambda now: min(now, 10.0)) == pytest.approx(13.25)
    liveness = Liveness(0.0)
    liveness.pinged(0.0)
    assert look(liveness, 0.0, 99.0, lambda now: now) == pytest.approx(60.25)


def test_a_busy_bridge_has_one_minute_to_answer_a_ping():
    liveness = Liveness(0.0)
    liveness.pinged(0.0)
    looks = [n / 4 for n in range(1, 400)]
    dead = [now for now in looks if liveness.is_dead(now, busy=lambda: True)]
    assert dead[0] == pytest.approx(60.25)


def test_whether_a_bridge_is_busy_is_asked_only_when_a_link_seems_dead():
    liveness, asked = Liveness(0.0), []
    liveness.pinged(0.0)

    def busy():
        asked.append(None)
        return True

    for number in range(12):
        liveness.is_dead(number / 4, busy=busy)
    assert asked == []
    liveness.is_dead(3.1, 3.0, busy=busy)
    assert asked == []
    liveness.is_dead(3.2, busy=busy)
    assert asked == [None]


def test_an_answered_ping_keeps_the_link_alive():
    liveness = Liveness(0.0)
    liveness.pinged(0.0)
    assert look(liveness, 0.0, 2.75) is None
    liveness.ponged(2.75)
    assert look(liveness, 3.0, 60.0) is None


def test_a_late_check_declares_no_link_dead_but_the_next_check_does():
    liveness = Liveness(0.0)
    liveness.pinged(0.1)
    assert not liveness.is_dead(20.0)
    assert liveness.is_dead(20.25)


def test_a_throttle_without_a_period_passes_every_message():
    throttle = Throttle(0.0)
    assert [throttle.offer(n, 0.0) for n in range(1, 4)] == [1, 2, 3]
    assert throttle.due is None


def test_a_throttle_delivers_only_the_newest_held_message_when_due():
    throttle = Throttle(0.1)
    assert throttle.offer("a", 1.0) == "a"
    assert throttle.offer("b", 1.01) is None
    assert throttle.offer("c", 1.02) is None
    assert throttle.due == pytest.approx(1.05)
    assert throttle.take(1.04) is None
    assert throttle.take(1.05) == "c"
    assert throttle.take(1.3) is None
    throttle.offer("d", 1.31)
    throttle.offer("e", 1.32)
    throttle.drop()
    assert throttle.due is None


def test_a_jittering_topic_at_the_throttle_rate_passes_almost_completely():
    throttle = Throttle(0.1)
    jitter = [0.0, -0.004, 0.003, -0.002, 0.004, -0.003]
    times = [0.1 * n + jitter[n % 6] for n in range(60)]
    passed = [n for n, now in enumerate(times, 1) if throttle.offer(n, now)]
    assert len(passed) >= 58


@given(st.lists(st.floats(0.001, 0.5), min_size=50, max_size=200), st.floats(0.02, 0.5))
def test_the_mean_rate_never_exceeds_the_throttle_rate(gaps, period):
    throttle, now, passed = Throttle(period), 0.0, 0
    for gap in gaps:
        now += gap
        passed += throttle.offer("x", now) is not None
    assert passed <= now / period + 2


def played(throttle, times):
    """Offer messages at given times; return when each listener received a message."""
    passed, waited = [], 0
    for now in times:
        due = throttle.due
        if due is not None and due <= now:
            assert throttle.take(due) is not None
            passed.append(due)
            waited += 1
        if throttle.offer("x", now) is not None:
            passed.append(now)
    return passed, waited


@pytest.mark.parametrize("phase", [0.05, 0.3, 0.9, 1.4, 1.9])
def test_a_topic_at_the_throttle_rate_soon_waits_for_no_timer(phase):
    times = [0.0, 0.5, *(2.0 * n + phase for n in range(1, 40))]
    passed, waited = played(Throttle(2.0), times)
    assert waited <= 3
    assert len(passed) >= 38


@given(st.lists(st.floats(0.001, 0.5), min_size=50, max_size=200), st.floats(0.02, 0.5))
def test_the_mean_rate_of_all_messages_is_at_most_a_tenth_above_the_rate(gaps, period):
    times = list(itertools.accumulate(gaps))
    passed, _ = played(Throttle(period), times)
    assert len(passed) <= times[-1] / (0.9 * period) + 3
