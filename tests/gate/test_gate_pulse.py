"""The reports to pages while the display process pauses, and afterwards."""

import pytest

from equipment.gate_harness import Bench


@pytest.mark.parametrize("taken", [False, True])
def test_a_robot_can_be_taken_again_as_soon_as_the_display_is_back(taken):
    bench = Bench().begin()
    if taken:
        bench.drive_off()
    bench.beating = False
    bench.run(2.0)
    assert not bench.report().armable
    assert bench.report().reason == "the display process does not respond"
    bench.beating = True
    bench.run(0.05)
    assert bench.report().armable, "else pages do not request control"
    assert bench.report().reason is None
