"""A person drives a good robot while the bridges of others do what they like."""

import pytest
from safety_hostile import beside, drive
from safety_run import FULL, grace

pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]


TRIALS = 5
"""How often the good robot is driven at most, where the computer cannot tell."""

LENT = 0.1
"""Seconds of the machine's processors, in a quarter second, that its host may take."""

LATE = 0.1
"""Seconds that the machine may keep a thread waiting that sleeps most of the time."""


def check(bench):
    """Assert that the peers do not disturb the good robot, and never its STOP.

    A trial that was disturbed while the host of a virtual machine took its processors
    says nothing of the peers, and another one follows; not so in a full run.
    """
    trials = []
    for _ in range(1 if FULL else TRIALS):
        driven = drive(bench)
        trials.append(driven)
        assert driven.stop < 0.1 + grace(driven.stop_jitter), driven
        assert driven.moved_after == 0, driven
        late = grace(driven.driving_jitter)
        if (
            driven.refused == 0
            and driven.zeros == 0
            and driven.velocity_gap < 0.15 + late
            and driven.tick_gap < 0.15 + late
        ):
            return
        taken = driven.stolen > LENT or driven.driving_jitter > LATE
        assert taken, f"disturbed on a machine that had its processors: {driven}"
    raise AssertionError(f"disturbed in each trial: {trials}")


def test_with_nobody_beside_the_good_robot_is_driven_and_stopped(bench):
    with beside(bench):
        check(bench)


FLOODS = [
    ("tiny_texts", "tiny_texts", "tiny_texts"),
    ("endless_message", "pings", "empty_frames"),
]


@pytest.mark.parametrize("peers", FLOODS, ids=" ".join)
def test_beside_three_that_flood_the_good_robot_is_driven_and_stopped(bench, peers):
    with beside(bench, *(f"safety_hostile_peers:{peer}" for peer in peers)):
        check(bench)
