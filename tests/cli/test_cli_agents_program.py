"""A program on a display drives the robot of an agent, without fakes."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from equipment.webmap_process import simulator, webmap

pytest.importorskip("zenoh")
pytestmark = pytest.mark.slow

PROGRAM = Path(__file__).with_name("program_of_agents.py")


@pytest.fixture
def run(tmp_path):
    """Run the program with an agent that has some options."""

    def run(*options):
        with (
            webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
            simulator("--robots", "1", "--seed", "7") as url,
            webmap(
                *("agent", url, "--router", router, "--name", "bay3", *options),
                WEBMAP_STATE_DIR=str(tmp_path / "agent"),
            ),
        ):
            done = subprocess.run(
                [sys.executable, PROGRAM, router],
                capture_output=True,
                text=True,
                timeout=120,
                check=False,
                env={**os.environ, "WEBMAP_STATE_DIR": str(tmp_path / "display")},
            )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return run


@pytest.mark.serial
def test_a_program_on_a_display_drives_an_agents_robot_and_sends_it_a_goal(run):
    came = run("--stops-within", "0.5")
    holder, by = came.pop("holder"), came.pop("goal by")
    assert holder.startswith("program of anyone.")
    assert by == f"{holder.removeprefix('program of ')}/program"
    assert came == {"epoch": True, "afterwards": "NoLease"}


def test_an_agent_that_lets_others_drive_refuses_the_program(run):
    came = run("--operators", "west")
    assert "viewers can only look" in came["refused"]
