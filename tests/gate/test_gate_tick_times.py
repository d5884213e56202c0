"""The longest time between two ticks of the gate, as the display sees it."""

import pytest

from webmap.gate.display.client import TickTimes


def test_the_longest_time_between_two_ticks_is_remembered_for_15_to_30_s():
    ticks, now = TickTimes(), 1000.0
    assert ticks.age(now) is None
    assert ticks.gap(now) == 0.0
    for gap in (0.05, 0.4, 0.05):
        ticks.note(now)
        now += gap
    assert ticks.age(now) == pytest.approx(0.05)
    assert ticks.gap(now) == pytest.approx(0.4)
    for _ in range(320):  # 16 s
        ticks.note(now)
        now += 0.05
    assert ticks.gap(now) == pytest.approx(0.4)
    for _ in range(320):
        ticks.note(now)
        now += 0.05
    assert ticks.gap(now) == pytest.approx(0.05)


def test_a_silent_gate_has_a_growing_gap_and_one_that_ended_has_none():
    ticks = TickTimes()
    ticks.note(1000.0)
    assert ticks.gap(1002.0) == 2.0
    ticks.end()
    assert ticks.age(1002.0) is None
    assert ticks.gap(1002.0) == 0.0
    ticks.note(1100.0)  # the next gate: the time between the two does not count
    assert ticks.gap(1100.0) == 0.0
