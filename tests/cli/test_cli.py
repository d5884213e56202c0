"""Commands print one line when ready, end cleanly, and report errors in one line."""

import re
import signal
import socket
import subprocess
import sys
import time

import pytest

import webmap
from equipment.command_line import run_inside

pytestmark = pytest.mark.slow

WEB = r"WebMap is ready at http://127\.0\.0\.1:\d+/\?token=[\w-]{43,}\n"
ROBOT = ("--robot", "Bob:/odom::")


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


def is_logged(line):
    """Return whether a line on standard error is a log line with a time."""
    return re.match(r"\d{4}-\d\d-\d\d ", line) is not None


@pytest.fixture
def page(tmp_path):
    """The file of a program with a page."""
    file = tmp_path / "page.py"
    file.write_text("import webmap\n\n@webmap.page('/')\ndef main(page): pass\n")
    return file


def test_help_names_every_command():
    help_text = run("--help")
    assert help_text.returncode == 0
    commands = ("demo", "view", "discover", "doctor", "play", "record", "run", "check")
    for command in (*commands, "sim"):
        assert re.search(rf"^  {command} ", help_text.stdout, re.M)
        assert run_inside(command, "--help").returncode == 0


def test_version_prints_the_version_of_the_package():
    assert run("--version").stdout.strip().endswith(webmap.__version__)


@pytest.mark.parametrize(
    ("arguments", "message"),
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
        (("sim", "--quirks", "polite,odd"), "no quirk is called 'odd'; there are"),
        (("sim", "--quirks", "real", "--polite"), "give only one"),
        (("sim", "--rosbridge", "1.0"), "rosbridge must be one of ['0.11', '2.1',"),
        (("sim", "--rosbridge", "4.1", "--dialect", "ros1"), "give only one"),
        (("demo", "--host", "0.0.0.0"), "--insecure-lan"),
        (("demo", "--tls", "--tls-cert", "fleet.pem"), "got both"),
        (("demo", "--tls-cert", "fleet.pem"), "got one of them"),
        (("demo", "--tls", "--host", "robots.example.com"), "private names"),
    ],
)
def test_an_invalid_argument_prints_one_error_line_and_exits_with_code_2(
    arguments, message
):
    result = run_inside(*arguments)
    assert result.returncode == 2, result.stderr
    [error] = [line for line in result.stderr.splitlines() if not is_logged(line)]
    assert error.startswith("Error: ")
    assert message in error
    assert result.stdout == ""


@pytest.mark.parametrize(
    "arguments",
    [
        ("sim", "--port"),
        ("sim", "--port", "0", "--http-camera"),
        ("demo", "--no-browser", "--port"),
        ("demo", "--no-browser", "--port", "0", "--bridge-port"),
        ("view", "ws://127.0.0.1:1", *ROBOT, "--no-browser", "--port"),
        ("run", "--no-browser", "PAGE", "--port"),
    ],
)
def test_a_port_in_use_prints_one_error_line_and_exits_with_code_2(arguments, page):
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        port = listener.getsockname()[1]
        command = [page if argument == "PAGE" else argument for argument in arguments]
        result = run(*command, port)
    assert result.returncode == 2
    error = result.stderr.splitlines()[-1]
    assert error.startswith(f"Error: port {port} on 127.0.0.1 is in use: ")
    assert result.stderr.count("Error") == 1
    assert "Traceback" not in result.stderr
    assert result.stdout == ""


@pytest.mark.parametrize("sig", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize(
    ("command", "line"),
    [
        (("sim", "--port", 0), r"rosbridge is ready at ws://127\.0\.0\.1:\d+\n"),
        (("demo", "--port", 0, "--no-browser"), WEB),
        (("run", "PAGE", "--port", 0, "--no-browser"), WEB),
        (("view", "ws://127.0.0.1:1", *ROBOT, "--port", 0, "--no-browser"), WEB),
    ],
    ids=["sim", "demo", "run", "view"],
)
def test_a_command_prints_one_ready_line_and_a_signal_ends_it_with_exit_code_0(
    command, line, sig, page
):
    process = start(*[page if argument == "PAGE" else argument for argument in command])
    try:
        assert re.fullmatch(line, process.stdout.readline())
        process.send_signal(sig)
        out, err = process.communicate(timeout=15)
    finally:
        if process.poll() is None:
            process.kill()
    assert process.returncode == 0, err
    assert out == "", "only the one line is printed"
    assert "Traceback" not in err


def test_killing_the_demo_also_ends_its_gate_and_simulator():
    process = start("demo", "--port", 0, "--no-browser")
    assert process.stdout.readline().startswith("WebMap is ready")
    for _ in range(100):
        listed = subprocess.run(
            ["ps", "-o", "pid=", "--ppid", str(process.pid)],
            capture_output=True,
            text=True,
            check=True,
        )
        children = [int(pid) for pid in listed.stdout.split()]
        if len(children) == 2:  # the gate starts a moment after the page
            break
        time.sleep(0.1)
    assert len(children) == 2, "the children are the gate and the simulator"
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
    raise AssertionError(f"still running: {alive}")


def test_a_failing_script_is_named_with_its_error():
    import tempfile
    from pathlib import Path

    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "broken.py"
        script.write_text("import webmap\nwebmap.Rbot('Bob')\n")
        result = run("run", script, "--port", 0, "--no-browser")
    assert result.returncode != 0
    assert "broken.py" in result.stderr
    assert "has no attribute 'Rbot'" in result.stderr


THREADS = "OPENBLAS_NUM_THREADS"
PRINTING = f"""
import os, sys
from webmap.cli import main
try:
    main()
finally:
    print("threads:", os.environ.get("{THREADS}"))
"""


def test_commands_limit_the_threads_of_linear_algebra_but_not_of_a_users_program(
    tmp_path, monkeypatch
):
    def threads(*arguments):
        command = [sys.executable, "-c", PRINTING, *map(str, arguments)]
        result = subprocess.run(command, capture_output=True, text=True, timeout=30)
        return result.stdout.split("threads: ")[1].strip()

    program = tmp_path / "program.py"
    program.write_text("raise SystemExit")
    monkeypatch.delenv(THREADS, raising=False)
    assert threads("check", program) == "1"
    assert threads("run", program) == "None"
    monkeypatch.setenv(THREADS, "3")
    assert threads("check", program) == "3"
