"""How a standstill is detected."""

from webmap.base.geometry import Twist
from webmap.gate.rules.health import STILL_FOR, Standstill


def test_odometry_without_a_velocity_neither_begins_nor_ends_a_standstill():
    still = Standstill()
    still.observe(None, 0.0)
    assert still.since is None
    still.observe(Twist(), 0.1)
    still.observe(None, 0.2)
    assert (still.since, still.heard_at) == (0.1, 0.1)
    still.observe(Twist(), 0.1 + STILL_FOR)
    assert still.reached
