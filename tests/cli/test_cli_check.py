"""``webmap check`` and ``webmap run`` with a fleet file."""

import os
import re
import signal
import subprocess
import sys

import pytest

from equipment.command_line import run_inside

pytestmark = pytest.mark.slow


def webmap(*arguments):
    return subprocess.run(
        [sys.executable, "-m", "webmap", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )


def test_the_fleet_file_of_discover_passes_the_check_and_runs(ros1, ros2, tmp_path):
    file = tmp_path / "fleet.toml"
    file.write_text(webmap("discover", "--toml", ros1, ros2).stdout)
    result = webmap("check", file)
    assert result.returncode == 0, result.stderr
    assert result.stdout == f"{file}: 3 robots behind 2 bridges, no mistakes\n"
    with subprocess.Popen(
        [sys.executable, "-m", "webmap", "run", file, "--port", "0", "--no-browser"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        try:
            assert re.match("WebMap is ready at http://", process.stdout.readline())
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=15)
        finally:
            process.kill()
    assert process.returncode == 0, err
    assert out == ""


def test_check_and_run_refuse_an_invalid_fleet_file_with_exit_code_2(tmp_path):
    file = tmp_path / "fleet.toml"
    file.write_text('[bridges]\na = "ws://a"\n[[robots]]\nnmae = "Bob"\n')
    for command in ("check", "run"):
        result = run_inside(command, file)
        assert result.returncode == 2
        assert f'{file}:4: robots[0].nmae: there is no key "nmae" here' in result.stderr
        assert result.stdout == ""
        assert "Traceback" not in result.stderr


def test_check_refuses_a_pipe_instead_of_a_file(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    result = run_inside("check", tmp_path / "pipe")
    assert result.returncode == 2
    assert f"{tmp_path / 'pipe'}: expected a file, got a pipe" in result.stderr


@pytest.mark.parametrize(
    ("robots", "counted"),
    [
        ("", "0 robots and the robots of agents behind 1 bridge"),
        (
            '\nhall = "ws://a"\n[[robots]]\nname = "Bob"\nodometry = "/odom"\n',
            "1 robot and the robots of agents behind 2 bridges",
        ),
    ],
)
def test_check_counts_the_bridges_of_agents(tmp_path, robots, counted):
    file = tmp_path / "fleet.toml"
    file.write_text(f'[bridges]\nyard = "zenoh://hall:7447"{robots}')
    result = run_inside("check", file)
    assert (result.returncode, result.stdout) == (
        0,
        f"{file}: {counted}, no mistakes\n",
    )
