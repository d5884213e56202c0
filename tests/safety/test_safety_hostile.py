"""A person drives a good robot while the bridges of others do what they like."""

import pytest
from safety_hostile import beside, drive
from safety_run import grace

pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]


def check(driven):
    """See that nobody noticed the hostile peers."""
    late = grace(driven.driving_jitter)
    assert driven.refused == 0, driven
    assert driven.zeros == 0, driven
    assert driven.velocity_gap < 0.15 + late, driven
    assert driven.tick_gap < 0.15 + late, driven
    assert driven.stop < 0.1 + grace(driven.stop_jitter), driven
    assert driven.moved_after == 0, driven


def test_with_nobody_beside_the_good_robot_is_driven_and_stopped(bench):
    with beside(bench):
        check(drive(bench))


FLOODS = [
    ("tiny_texts", "tiny_texts", "tiny_texts"),
    ("endless_message", "pings", "empty_frames"),
]


@pytest.mark.parametrize("peers", FLOODS, ids=" ".join)
def test_beside_three_that_flood_the_good_robot_is_driven_and_stopped(bench, peers):
    with beside(bench, *(f"safety_hostile_peers:{peer}" for peer in peers)):
        check(drive(bench))
