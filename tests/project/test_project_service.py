"""The systemd unit of the documentation, with the files and the calls of a real run."""

import os
import re
import shutil
import signal
import subprocess
import sys
from configparser import ConfigParser
from pathlib import Path

import psutil
import pytest

from equipment.waiting import wait_for

PAGE = Path(__file__).parents[2] / "docs/howto/service.md"

FLEET = """
[bridges]
a = "ws://127.0.0.1:1"

[[robots]]
name = "Bob"
bridge = "a"
odometry = "/odom"
twist = "/cmd_vel"
"""

HOOK = """
import os, sys
log = os.open(os.environ["OPENED"], os.O_WRONLY | os.O_APPEND | os.O_CREAT)

def hook(event, args):
    if event == "open":
        path, mode, flags = args
        if isinstance(path, int) or not flags & (os.O_WRONLY | os.O_RDWR):
            return
    elif event in {"os.mkdir", "os.rename", "os.remove", "os.symlink", "os.link"}:
        path = args[0]
    else:
        return
    os.write(log, os.fsencode(os.path.abspath(path)) + b"\\n")

sys.addaudithook(hook)
"""
"""Notes each path that a process of Python opens for writing."""

FALLS_BACK = {"io_uring_setup", "io_uring_enter", "io_uring_register"}
"""Calls that are refused, which uvloop replaces by others."""


@pytest.fixture
def unit(tmp_path):
    """The unit of the page, as a file and parsed."""
    text = re.search(r"```ini\n(.*?)```", PAGE.read_text(), re.DOTALL)[1]
    file = tmp_path / "webmap.service"
    file.write_text(text)
    parsed = ConfigParser(strict=False, interpolation=None)
    parsed.optionxform = str
    parsed.read_string(text)
    return file, parsed["Service"]


def run_for_a_while(command, folder, **environment):
    """Run a fleet file until it is ready, then end it as systemd does."""
    (folder / "fleet.toml").write_text(FLEET)
    process = subprocess.Popen(
        [*command, "run", "fleet.toml", "--no-browser", "--port", "0"],
        cwd=folder,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, **environment},
    )
    try:
        assert "is ready at" in process.stdout.readline()
        state = Path(environment["WEBMAP_STATE_DIR"])
        wait_for(lambda: state.exists() and any(state.iterdir()))  # the gate runs
    finally:
        webmap = psutil.Process(process.pid)
        while "webmap" not in webmap.cmdline()[:3]:  # strace, whose child it is
            (webmap,) = webmap.children()
        webmap.send_signal(signal.SIGTERM)
        process.wait(60)
        process.stdout.close()
    assert process.returncode == 0


def test_a_service_writes_only_into_the_folder_that_its_unit_gives_it(unit, tmp_path):
    _, service = unit
    assert service["ProtectSystem"] == "strict"
    assert "ReadWritePaths" not in service
    assert (
        service["Environment"]
        == f"WEBMAP_STATE_DIR=/var/lib/{service['StateDirectory']}"
    )
    hooks, home, log = tmp_path / "hooks", tmp_path / "home", tmp_path / "log"
    for folder in (hooks, home):
        folder.mkdir()
    (hooks / "sitecustomize.py").write_text(HOOK)
    state = tmp_path / "state"
    run_for_a_while(
        [sys.executable, "-m", "webmap"],
        tmp_path,
        PYTHONPATH=str(hooks),
        PYTHONDONTWRITEBYTECODE="1",
        HOME=str(home),
        OPENED=str(log),
        WEBMAP_STATE_DIR=str(state),
    )
    opened = set(log.read_text().split("\n")) - {"", os.devnull}
    assert any(path.startswith(f"{state}/") for path in opened), opened
    elsewhere = {path for path in opened if not f"{path}/".startswith(f"{state}/")}
    assert elsewhere == set()
    assert list(home.iterdir()) == []


def test_the_unit_leaves_what_the_gate_needs(unit):
    _, service = unit
    assert service["LimitRTPRIO"] == "1"
    assert "RestrictRealtime" not in service
    assert "KillMode" not in service
    families = set(service["RestrictAddressFamilies"].split())
    assert families >= {"AF_UNIX", "AF_INET", "AF_INET6"}


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="needs systemd-analyze")
def test_systemd_knows_each_option_of_the_unit_and_finds_it_well_confined(unit):
    file, _ = unit
    done = subprocess.run(
        ["systemd-analyze", "security", "--offline=yes", "--threshold=20", file],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout[-200:]
    assert "Unknown" not in done.stderr, done.stderr


def allowed_calls():
    """Return the system calls of ``@system-service`` without ``@privileged``."""

    def calls_of(group):
        command = ["systemd-analyze", "syscall-filter", group]
        listed = subprocess.run(command, capture_output=True, text=True, check=True)
        lines = {line.strip() for line in listed.stdout.splitlines()[1:]}
        groups = {line for line in lines if line.startswith("@")}
        return (lines - groups).union(*map(calls_of, groups))

    return calls_of("@system-service") - calls_of("@privileged")


@pytest.mark.skipif(
    not (shutil.which("systemd-analyze") and shutil.which("strace")),
    reason="needs systemd-analyze and strace",
)
def test_a_service_makes_only_the_system_calls_that_its_unit_allows(unit, tmp_path):
    _, service = unit
    assert service["SystemCallFilter"] == "~@privileged"  # the later of two lines
    assert "SystemCallFilter=@system-service\n" in PAGE.read_text()
    log = tmp_path / "calls"
    strace = ["strace", "-f", "-qq", "-o", str(log), sys.executable, "-m", "webmap"]
    run_for_a_while(strace, tmp_path, WEBMAP_STATE_DIR=str(tmp_path / "state"))
    made = set(re.findall(r"^\d+ +([a-z]\w+)\(", log.read_text(errors="replace"), re.M))
    assert len(made) > 30
    assert made - allowed_calls() - FALLS_BACK == set()
