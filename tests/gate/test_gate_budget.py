"""The budget of a link, when a link is dropped, and when it connects again."""

import pytest

from webmap.gate.lanes import budget as limits
from webmap.gate.lanes import lane as waits
from webmap.gate.lanes.budget import Budget
from webmap.gate.lanes.lane import ReconnectWaits


def send(budget, seconds, rate, *, size=100, work=0.00005, begin=1000.0, kept=0):
    """Send kept frames, then frames at a rate; return the time of the drop, or None.

    Each frame is read as soon as the budget allows it, as by the socket.
    """
    now, sent, end = begin, -kept, begin + seconds
    while now < end:
        if budget.flood(now):
            return now - begin
        waiting = int((now - begin) * rate) - sent
        while waiting > 0 and budget.wait(now) == 0:
            budget.spend(1, size, work, now)
            waiting, sent = waiting - 1, sent + 1
        now += 0.01
    return None


class TestBudget:
    def test_odometry_at_1_khz_and_dense_scans_stay_within_the_budget(self):
        budget = Budget()
        for each in range(60_000):
            now = 1000 + each / 1000
            budget.spend(1, 1000, 0.0001, now)
            if each % 100 == 0:  # 3,600 beams with intensities, ten times a second
                budget.spend(2, 65_000, 0.002, now)
            assert budget.wait(now) == 0
            assert budget.flood(now) is None

    def test_ten_messages_of_maximum_size_a_second_stay_within_the_budget(self):
        budget = Budget()
        for each in range(300):
            budget.spend(18, 1 << 20, 0.012, 1000 + each / 10)
            assert budget.wait(1000 + each / 10) == 0

    def test_the_backlog_of_a_3_s_stall_is_read_without_a_pause(self):
        budget = Budget()
        for _ in range(3000):
            assert budget.wait(1000.0) == 0
            budget.spend(1, 1000, 0.00008, 1000.0)

    @pytest.mark.parametrize(
        ("frames", "size", "work"),
        [(1, 4, 0.000004), (1, 1 << 20, 0.001), (1, 100, 0.05)],
        ids=["many frames", "many bytes", "much work"],
    )
    def test_a_link_over_budget_is_read_at_no_more_than_the_budgeted_rate(
        self, frames, size, work
    ):
        budget, taken, now = Budget(), 0, 1000.0
        for _ in range(10_000):
            now += 0.001
            while budget.wait(now) == 0:
                budget.spend(frames, size, work, now)
                taken += 1
        most = min(limits.FRAMES, limits.BYTES / size, limits.WORK / work)
        assert taken <= 1 + most * (10 + limits.BURST)

    def test_reading_from_a_link_over_budget_pauses_for_a_fixed_time(self):
        budget = Budget()
        while budget.wait(1000.0) == 0:
            budget.spend(100, 400, 0.0004, 1000.0)
        assert budget.wait(1000.0) == pytest.approx(limits.PAUSE)
        assert budget.wait(1000.0 + limits.PAUSE + 0.001) == 0

    def test_a_link_that_stays_over_budget_is_dropped_after_about_a_second(self):
        budget = Budget()
        dropped = send(budget, 60, 20_000, size=4, work=0.000004)
        assert dropped == pytest.approx(limits.PATIENCE + 0.2, abs=0.2)
        why = budget.flood(1000 + dropped)
        assert "frames" in why
        assert "at most 4000 frames, 16777216 bytes and 0.25 s of work a second" in why

    def test_a_link_that_floods_again_after_a_drop_is_dropped_at_least_as_soon(self):
        budget = Budget()
        first = send(budget, 60, 20_000, begin=1000.0)
        again = send(budget, 60, 20_000, begin=1000.0 + first + 0.5)
        assert again <= first

    def test_a_single_burst_over_budget_is_no_flood(self):
        assert send(Budget(), 60, 1000, kept=5000) is None

    def test_a_link_that_is_always_behind_is_dropped_after_2_s_at_any_rate(self):
        budget = Budget()
        for each in range(20):
            budget.spend(1, 100, 0.0001, 1000 + each / 10)
            budget.note(1000 + each / 10, behind=True)
        assert budget.flood(1001.9) is None
        assert "the bridge sends too much: data was waiting for 2 s" in budget.flood(
            1002.1
        )

    def test_a_link_that_sometimes_catches_up_is_not_dropped(self):
        budget = Budget()
        for each in range(100):
            budget.note(1000 + each / 10, behind=each % 15 != 0)
            assert budget.flood(1000 + each / 10) is None


class TestAttempts:
    def test_the_wait_doubles_after_each_failed_attempt_up_to_3_s(self):
        attempts = ReconnectWaits()
        assert [attempts.failed() for _ in range(7)] == [
            0.1, 0.2, 0.4, 0.8, 1.6, 3.0, 3.0,
        ]  # fmt: skip

    def test_a_short_connection_does_not_reset_the_wait(self):
        attempts = ReconnectWaits()
        lasted = waits.STEADY - 0.01
        waited = [attempts.ended(lasted, flooded=False) for _ in range(3)]
        assert waited == [0.1, 0.2, 0.4]

    def test_a_lasting_connection_resets_the_wait(self):
        attempts = ReconnectWaits()
        attempts.failed()
        attempts.failed()
        assert attempts.ended(waits.STEADY, flooded=False) == waits.FIRST_WAIT

    def test_the_wait_doubles_after_each_flood_up_to_a_minute(self):
        attempts = ReconnectWaits()
        waited = [attempts.ended(3.0, flooded=True) for _ in range(8)]
        assert waited == [1, 2, 4, 8, 16, 32, 60, 60]
        attempts.ended(waits.TAME, flooded=False)
        assert attempts.ended(3.0, flooded=True) == 1

    def test_an_error_is_new_only_once_until_a_connection_has_lasted(self):
        attempts = ReconnectWaits()
        assert attempts.is_new("refused")
        assert not attempts.is_new("refused")
        attempts.ended(0.1, flooded=False)
        assert not attempts.is_new("refused")
        attempts.ended(waits.STEADY, flooded=False)
        assert attempts.is_new("refused")

    def test_a_bridge_with_many_different_errors_does_not_fill_the_log(self):
        attempts = ReconnectWaits()
        new = sum(attempts.is_new(f"trouble {n}") for n in range(1000))
        assert new == waits.MOST_TROUBLES


def test_a_link_with_many_topics_may_send_more_frames_and_bytes():
    def dropped(topics, frames, size):
        budget = Budget()
        budget.topics = topics
        for each in range(3000):
            at = 1000 + each / 1000
            if budget.flood(at):
                return True
            if budget.wait(at) == 0:
                budget.spend(frames // 1000, size // 1000, 0.00001, at)
        return False

    for frames, size in ((2 * limits.FRAMES, 0), (0, 2 * limits.BYTES)):
        assert dropped(limits.TOPICS, frames, size)
        assert not dropped(10 * limits.TOPICS, frames, size)
