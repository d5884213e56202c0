import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from webmap.ros.backoff import Backoff
from webmap.ros.rosbridge.connection import Liveness
from webmap.ros.subscriptions import Throttle


def test_delays_grow_and_end_at_ten_seconds():
    backoff = Backoff(jitter=lambda: 1.0)
    assert [backoff.next() for _ in range(7)] == [0.5, 1, 2, 4, 8, 10, 10]
    backoff = Backoff(jitter=lambda: 0.0)
    assert [backoff.next() for _ in range(3)] == [0.25, 0.5, 1]


def test_a_link_that_held_starts_the_growth_anew():
    backoff = Backoff(jitter=lambda: 1.0)
    for _ in range(5):
        backoff.next()
    assert backoff.next(lasted=0.1) == 10
    assert backoff.next(lasted=60) == 0.5


def test_a_ping_is_due_after_each_answer_and_only_then():
    liveness = Liveness(0.0)
    assert not liveness.is_ping_due(0.4)
    assert liveness.is_ping_due(0.5)
    liveness.pinged(0.5)
    assert not liveness.is_ping_due(2.0)
    liveness.ponged(0.6)
    assert not liveness.is_ping_due(1.0)
    assert liveness.is_ping_due(1.1)


def test_after_an_answer_that_took_long_the_next_ping_is_due_at_once():
    liveness = Liveness(0.0)
    liveness.pinged(0.5)
    assert not liveness.is_ping_due(2.0)
    liveness.ponged(2.0)
    assert liveness.is_ping_due(2.0)


class TestLag:
    def test_before_the_first_answer_nothing_is_said(self):
        assert Liveness(0.0).lag(0.4) == 0.0

    def test_it_is_what_the_last_answer_took_however_long_ago_that_was(self):
        liveness = Liveness(0.0)
        liveness.pinged(0.5)
        liveness.ponged(0.7)
        assert liveness.lag(0.7) == pytest.approx(0.2)
        assert liveness.lag(1.2) == pytest.approx(0.2)

    def test_it_grows_while_an_answer_is_waited_for(self):
        liveness = Liveness(0.0)
        liveness.pinged(0.5)
        liveness.ponged(0.7)
        liveness.pinged(1.2)
        assert liveness.lag(1.3) == pytest.approx(0.2)
        assert liveness.lag(2.2) == pytest.approx(1.0)

    def test_a_link_that_is_quick_again_is_not_called_slow(self):
        liveness = Liveness(0.0)
        liveness.pinged(0.5)
        liveness.ponged(2.5)
        liveness.pinged(2.5)
        liveness.ponged(2.51)
        assert liveness.lag(2.6) == pytest.approx(0.01)


def look(liveness, start, end, received=lambda _now: -math.inf):
    """Look four times a second; return when the link was found dead."""
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


def test_a_link_on_which_a_large_message_comes_is_not_dead():
    liveness = Liveness(0.0)
    liveness.pinged(0.0)
    assert look(liveness, 0.0, 20.0, lambda now: now - 1.0) is None
    liveness = Liveness(0.0)
    liveness.pinged(0.0)
    assert look(liveness, 0.0, 30.0, lambda now: min(now, 10.0)) == pytest.approx(13.25)
    liveness = Liveness(0.0)
    liveness.pinged(0.0)
    assert look(liveness, 0.0, 99.0, lambda now: now) == pytest.approx(60.25)


def test_a_bridge_that_is_known_to_be_busy_is_given_time():
    liveness = Liveness(0.0)
    liveness.pinged(0.0)
    looks = [n / 4 for n in range(1, 400)]
    dead = [now for now in looks if liveness.is_dead(now, busy=True)]
    assert dead[0] == pytest.approx(60.25)


def test_an_answered_ping_keeps_the_link_alive():
    liveness = Liveness(0.0)
    liveness.pinged(0.0)
    assert look(liveness, 0.0, 2.75) is None
    liveness.ponged(2.75)
    assert look(liveness, 3.0, 60.0) is None


def test_a_process_that_stood_still_judges_only_at_the_next_look():
    liveness = Liveness(0.0)
    liveness.pinged(0.1)
    assert not liveness.is_dead(20.0)
    assert liveness.is_dead(20.25)


def test_without_a_period_everything_passes():
    throttle = Throttle(0.0)
    assert [throttle.offer(n, 0.0) for n in range(1, 4)] == [1, 2, 3]
    assert throttle.due is None


def test_the_newest_of_what_was_held_comes_when_its_time_has_come():
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


def test_a_topic_of_just_this_rate_passes_whole_though_it_jitters():
    throttle = Throttle(0.1)
    jitter = [0.0, -0.004, 0.003, -0.002, 0.004, -0.003]
    times = [0.1 * n + jitter[n % 6] for n in range(60)]
    passed = [n for n, now in enumerate(times, 1) if throttle.offer(n, now)]
    assert len(passed) >= 58


@given(st.lists(st.floats(0.001, 0.5), min_size=50, max_size=200), st.floats(0.02, 0.5))
def test_the_mean_rate_is_never_above_what_was_asked(gaps, period):
    throttle, now, passed = Throttle(period), 0.0, 0
    for gap in gaps:
        now += gap
        passed += throttle.offer("x", now) is not None
    assert passed <= now / period + 2
