"""A program takes a robot, drives it, sends it somewhere and lets it go: for real."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from webmap_process import simulator

PROGRAM = Path(__file__).with_name("program_that_drives.py")


@pytest.fixture(scope="module")
def received():
    """What came of a program that drove a simulated robot, through the real gate."""
    with simulator("--flat", "--no-extras", "--seed", "7") as url:
        done = subprocess.run(
            [sys.executable, PROGRAM, url],
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.parametrize("epoch", ["epoch", "epoch of goals alone"])
def test_a_program_that_takes_a_robot_gets_the_epoch_of_its_lease(received, epoch):
    assert received[epoch] > 0


def test_each_velocity_that_the_gate_wrote_is_told_as_it_was_written(received):
    assert [0.1, 0.5] in received["twists"]


def test_a_goal_is_told_on_the_common_map_as_the_program_gave_it(received):
    assert received["said"] == pytest.approx(received["asked"])


def test_the_robot_hears_the_goal_in_its_own_map_and_frame(received):
    # Its map lies 10 m along x, turned by 90 degrees.
    x, y = received["asked"]
    assert received["heard"] == pytest.approx([y, 10.0 - x])
    assert received["frame"] == "map"


@pytest.mark.parametrize("command", ["twist", "move"])
def test_a_program_that_let_go_may_not_move_the_robot(received, command):
    assert received[f"{command} afterwards"] == "NoLease"
