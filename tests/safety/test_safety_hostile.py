"""A person drives a good robot on the bench that has room for hostile peers."""

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
