"""The commands: one line when ready, clean ends, one sentence for what is wrong."""

import re
import signal
import socket
import subprocess
import sys
import time

import pytest

import webmap


def run(*arguments, within=30):
    return subprocess.run(
        [sys.executable, "-m", "webmap", *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=within,
        check=False,
    )


def start(*arguments):
    return subprocess.Popen(
        [sys.executable, "-m", "webmap", *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def test_help_names_every_command():
    said = run("--help")
    assert said.returncode == 0
    for command in ("demo", "view", "discover", "doctor", "run", "check", "sim"):
        assert re.search(rf"^  {command} ", said.stdout, re.M)
        assert run(command, "--help").returncode == 0


def test_version_is_the_packages():
    assert run("--version").stdout.strip().endswith(webmap.__version__)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("dmeo",), "No such command"),
        (("demo", "--robots", "none"), "not a valid integer"),
        (("demo", "--port", "70000"), "70000"),
        (("view",), "Missing argument"),
        (("view", "http://robot:9090"), "ws://"),
        (("view", "ws://127.0.0.1:1", "--robot", "Bob"), "NAME:ODOM:CMD_VEL:SCAN"),
        (("run", "nowhere.py"), "nowhere.py"),
        (("check", "nowhere.toml"), "nowhere.toml"),
        (("discover",), "Missing argument"),
        (("discover", "http://robot:9090"), "ws://"),
        (("doctor", "http://robot:9090"), "ws://"),
        (("sim", "--map", "nowhere.yaml"), "nowhere.yaml"),
        (("sim", "--flat", "--robots", "2"), "one robot only"),
        (("demo", "--host", "0.0.0.0"), "--insecure-lan"),
    ],
)
def test_a_wrong_argument_is_one_sentence_and_exit_code_2(arguments, said):
    result = run(*arguments)
    assert result.returncode == 2, result.stderr
    assert said in result.stderr
    assert "Traceback" not in result.stderr
    assert result.stdout == ""


@pytest.mark.parametrize("command", ["demo", "sim"])
def test_a_port_in_use_is_one_sentence_and_exit_code_2(command):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        options = () if command == "sim" else ("--no-browser",)
        result = run(command, "--port", port, *options)
    assert result.returncode == 2
    assert str(port) in result.stderr
    assert "Traceback" not in result.stderr
    assert result.stdout == ""


@pytest.mark.parametrize("sig", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    ("command", "line"),
    [
        (("sim", "--port", 0), r"rosbridge is ready at ws://127\.0\.0\.1:\d+\n"),
        (
            ("demo", "--port", 0, "--no-browser"),
            r"WebMap is ready at http://127\.0\.0\.1:\d+/\?token=[\w-]{43,}\n",
        ),
    ],
)
def test_one_line_says_it_is_ready_and_a_signal_ends_it_with_exit_code_0(
    command, line, sig
):
    process = start(*command)
    try:
        assert re.fullmatch(line, process.stdout.readline())
        process.send_signal(sig)
        out, err = process.communicate(timeout=15)
    finally:
        if process.poll() is None:
            process.kill()
    assert process.returncode == 0, err
    assert out == "", "nothing but the one line"
    assert "Traceback" not in err


def test_the_simulator_of_a_demo_that_is_killed_ends_too():
    process = start("demo", "--port", 0, "--no-browser")
    assert process.stdout.readline().startswith("WebMap is ready")
    listed = subprocess.run(
        ["ps", "-o", "pid=", "--ppid", str(process.pid)],
        capture_output=True,
        text=True,
        check=True,
    )
    children = [int(pid) for pid in listed.stdout.split()]
    assert len(children) == 2, "the gate and the simulator"
    process.kill()
    process.communicate(timeout=10)
    for _ in range(100):
        alive = subprocess.run(
            ["ps", "-o", "pid=,stat=", "-p", ",".join(map(str, children))],
            capture_output=True,
            text=True,
            check=False,
        ).stdout.split("\n")
        if not [line for line in alive if line.strip() and "Z" not in line]:
            return
        time.sleep(0.1)
    raise AssertionError(f"still there: {alive}")


def test_a_script_that_fails_says_where():
    import tempfile
    from pathlib import Path

    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "broken.py"
        script.write_text("import webmap\nwebmap.Rbot('Bob')\n")
        result = run("run", script, "--port", 0, "--no-browser")
    assert result.returncode != 0
    assert "broken.py" in result.stderr
    assert "has no attribute 'Rbot'" in result.stderr
