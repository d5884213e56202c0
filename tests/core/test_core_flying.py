"""A program flies a robot through the real gate, and stops it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

# The gate flies the robot in real time.
pytestmark = pytest.mark.serial

PROGRAM = Path(__file__).with_name("program_that_climbs.py")


@pytest.fixture(scope="module")
def received():
    """The results of a program that flew a robot behind a rosbridge of its own."""
    done = subprocess.run(
        [sys.executable, PROGRAM],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_velocity_with_an_axis_without_a_limit_is_refused_as_a_whole(received):
    assert "got z = 0.3 m/s, but no limit of the robot" in received["without a limit"]
    assert received["moved without a limit"] == 0


def test_the_robot_receives_all_six_velocity_components_within_its_limits(received):
    assert received["twists"]
    for x, y, turn, z, rx, ry in received["twists"]:
        # 0.9 m/s upward is too fast, so the whole linear part is reduced. How much
        # depends on how quick this machine is.
        assert 0.1 < z <= 0.5
        assert x / z == pytest.approx(0.05 / 0.9)
        assert (y, turn, rx, ry) == (0.0, 0.2, 0.1, -0.05)
    assert received["wrong"] == []


def test_the_stop_of_a_robot_that_still_climbs_is_not_confirmed(received):
    confirmed, why = received["a robot that climbs on"]
    assert confirmed is False
    assert why.startswith("still moving at 0.")
    assert received["measured"][3] > 0.1
    assert received["last"] == [0.0] * 6


def test_the_stop_is_confirmed_when_the_robot_no_longer_climbs(received):
    assert received["standing"] == [0.0] * 6
