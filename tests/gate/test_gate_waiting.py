"""A command that waits to be written while the gate process pauses."""

import pytest

from equipment.gate_harness import Bench


@pytest.mark.parametrize(("seconds", "written"), [(0.03, True), (0.1, False)])
def test_a_waiting_command_is_written_after_30_ms_but_not_after_100_ms(
    seconds, written
):
    bench = Bench().begin()
    bench.drive_off()
    bench.drive(x=0.5)
    last = bench.written[-1]
    assert last.at == bench.now, "a velocity was just written"
    bench.drive(x=0.25)
    assert bench.written[-1] is last, "the next command waits"
    bench.now += seconds
    bench._do(bench.gate.step(bench.now))
    assert bool(bench.moving_since(last.at + 0.001)) is written


def test_a_gate_that_paused_writes_the_next_command():
    bench = Bench().begin()
    bench.drive_off()
    bench.drive(x=0.5)
    bench.drive(x=0.25)
    bench.now += 0.1
    bench.run(0.01)
    bench.drive(x=0.25)
    assert bench.written[-1].twist.vx == pytest.approx(0.25)
