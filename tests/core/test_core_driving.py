"""A program takes control of a robot, drives it, sends a goal and gives up control."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from equipment.webmap_process import simulator

PROGRAM = Path(__file__).with_name("program_that_drives.py")
SCRIPT = Path(__file__).parents[2] / "examples" / "script" / "script.py"


@pytest.fixture(scope="module")
def received():
    """The results of a program that drove a simulated robot through the real gate."""
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
def test_a_program_that_takes_control_gets_the_epoch_of_its_lease(received, epoch):
    assert received[epoch] > 0


def test_on_send_twist_receives_the_velocity_that_the_gate_sent(received):
    assert [0.1, 0.5] in received["twists"]


def test_on_send_move_receives_the_goal_in_the_common_map(received):
    assert received["sent goal"] == pytest.approx(received["asked"])


def test_the_robot_receives_the_goal_in_its_own_map_and_frame(received):
    # Its map lies 10 m along x, turned by 90 degrees.
    x, y = received["asked"]
    assert received["published goal"] == pytest.approx([y, 10.0 - x])
    assert received["frame"] == "map"


@pytest.mark.parametrize("command", ["twist", "move"])
def test_a_program_that_released_control_cannot_move_the_robot(received, command):
    assert received[f"{command} afterwards"] == "NoLease"


@pytest.mark.serial
def test_the_script_of_the_guide_drives_a_robot_and_waits_for_its_goal(tmp_path):
    text = SCRIPT.read_text("utf-8")
    assert text.count("ws://localhost:9090") == 1
    script = tmp_path / "script.py"
    with simulator("--flat", "--no-extras", "--seed", "7") as url:
        script.write_text(text.replace("ws://localhost:9090", url), "utf-8")
        done = subprocess.run(
            [sys.executable, script],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    assert (done.stdout, done.returncode) == ("The goal is reached\n", 0), done.stderr
