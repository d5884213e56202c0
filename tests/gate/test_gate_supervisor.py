"""When a gate is restarted, and which STOPs are then sent to it."""

import pytest

from webmap.gate.display.client import CONFIRMED_AFTER, PendingStops
from webmap.gate.display.supervisor import LIVED, LONGEST_PAUSE, Restarts, in_words


def pauses(restarts, count, now=100.0):
    found = []
    for _ in range(count):
        restarts.started(now)
        now += 0.1
        restarts.ended(now)
        ended, steps = now, 0
        while not restarts.due(now):
            steps += 1
            now = ended + steps * 0.01
        found.append(round(now - ended, 2))
    return found


class TestRestarts:
    def test_the_first_gate_is_started_at_once(self):
        assert Restarts().due(0.0)

    def test_an_ended_gate_is_restarted_at_once_and_then_after_longer_pauses(self):
        assert pauses(Restarts(), 8) == [0, 0.25, 0.5, 1, 2, 4, 4, 4]
        assert LONGEST_PAUSE == 4

    def test_two_early_ends_in_a_row_count_as_failing(self):
        restarts = Restarts()
        pauses(restarts, 1)
        assert not restarts.failing
        pauses(restarts, 1)
        assert restarts.failing

    def test_a_gate_that_ran_for_10_s_is_restarted_at_once(self):
        restarts = Restarts()
        pauses(restarts, 5)
        restarts.started(200.0)
        restarts.ended(200.0 + LIVED)
        assert restarts.due(200.0 + LIVED)
        assert not restarts.failing
        assert pauses(restarts, 2, now=300.0) == [0.25, 0.5]

    def test_a_gate_that_runs_for_10_s_no_longer_counts_as_failing(self):
        restarts = Restarts()
        pauses(restarts, 3)
        restarts.started(200.0)
        restarts.lives(200.0 + LIVED - 1)
        assert restarts.failing
        restarts.lives(200.0 + LIVED)
        assert not restarts.failing
        restarts.lives(200.0 + LIVED + 1)
        assert not restarts.failing

    def test_the_failure_message_depends_on_whether_a_gate_ever_ran(self):
        assert in_words("no disk", spoke=False).startswith(
            "The gate does not start: no disk. "
        )
        assert "ended repeatedly: no disk" in in_words("no disk", spoke=True)


class TestSilence:
    @pytest.fixture
    def pending(self):
        pending = PendingStops()
        pending.add(None, "r1", 10.0)
        pending.add("c1", None, 10.5)
        return pending

    def test_a_pending_stop_is_kept_until_a_later_gate_tick_confirms_it(self, pending):
        pending.on_tick(10.0 + CONFIRMED_AFTER - 0.1)
        assert list(pending) == [(None, "r1"), ("c1", None)]
        pending.on_tick(10.0 + CONFIRMED_AFTER)
        assert list(pending) == [("c1", None)]
        pending.on_tick(10.5 + CONFIRMED_AFTER)
        assert list(pending) == []
        pending.on_tick(99.0)

    def test_a_new_gate_restarts_the_confirmation_time_of_pending_stops(self, pending):
        pending.on_gate_ready(50.0)
        pending.on_tick(50.0 + CONFIRMED_AFTER - 0.1)
        assert len(list(pending)) == 2
