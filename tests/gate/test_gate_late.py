"""Velocities that a stalled link delivers late, with a running gate."""

import contextlib
import time

import pytest

from equipment.waiting import wait_for
from webmap.base.errors import NoLease
from webmap.base.geometry import Twist

# The gate drives the robot in real time; a delayed process loses control.
pytestmark = pytest.mark.serial


def test_a_fast_program_leaves_only_a_few_velocities_on_a_stalled_link(
    client, robot_spec, fake
):
    client.declare(robot_spec)
    reports = []
    client.on_report(reports.append)
    wait_for(lambda: any(getattr(r, "armable", 0) for r in reports), "a robot")
    client.take("r1").result(5)

    def push():
        with contextlib.suppress(NoLease):  # the lease ends when the stall is noticed
            client.twist("r1", Twist(0.2))

    def under_way():
        try:
            client.twist("r1", Twist(0.2))
        except NoLease:  # a delay of the gate also ends the lease
            client.take("r1").result(5)
        return len(fake.moving) > 20

    wait_for(under_way, "a robot that moves")
    fake.hold()
    held_at = time.monotonic()
    before = len(fake.moving)

    def stalled():
        push()
        return time.monotonic() - held_at > 0.6

    wait_for(stalled, "the time after which the gate notices the stall")
    fake.go_on()

    def stopped():
        late = any(at > held_at + 0.5 for at, _ in fake.velocities)
        return late and fake.last_speed == 0

    wait_for(stopped, "a zero after the stall")
    # One more may have been read while the robot stopped reading.
    assert len(fake.moving) - before <= 6 + 1
