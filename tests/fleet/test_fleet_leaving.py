"""Commands close their link to a bridge that hangs if a client's queue is not empty."""

import contextlib
import signal
import subprocess
import sys
import time

import psutil
import pytest
from websockets.sync.client import connect

from equipment.waiting import wait_for
from equipment.webmap_process import simulator

pytestmark = pytest.mark.slow

COMMANDS = {
    "record": ("--duration", "1.5"),
    "doctor": ("--seconds", "1"),
    "discover": (),
    "view": ("--port", "0", "--no-browser"),
}


@pytest.fixture(scope="module")
def bridge():
    with simulator("--dialect", "ros2", "--robots", "1") as url:
        yield url


@contextlib.contextmanager
def running(name, url, folder):
    out = ("--out", folder / "bag") if name == "record" else ()
    options = [*map(str, COMMANDS[name]), *map(str, out)]
    process = subprocess.Popen(
        [sys.executable, "-m", "webmap", name, url, *options],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        cwd=folder,
    )
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


def wait_for_messages(process, url):
    """Wait until a command has been connected to the bridge for a short time."""
    port = int(url.rpartition(":")[2])
    whole = psutil.Process(process.pid)

    def is_linked():
        assert process.poll() is None, process.stderr.read().decode()
        for each in [whole, *whole.children(recursive=True)]:
            with contextlib.suppress(psutil.NoSuchProcess):
                for link in each.net_connections("tcp"):
                    if link.raddr and link.raddr.port == port:
                        return True
        return False

    wait_for(is_linked)
    time.sleep(0.5)


def lets_in(url):
    with contextlib.suppress(TimeoutError), connect(url, proxy=None, open_timeout=5):
        return True
    return False


@pytest.mark.parametrize("name", ["record", "doctor", "discover"])
def test_the_bridge_accepts_clients_after_a_command_ends(bridge, name, tmp_path):
    with running(name, bridge, tmp_path) as process:
        _, output = process.communicate(timeout=60)
    assert b"Traceback" not in output
    assert process.returncode in (0, 1)
    assert lets_in(bridge)


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_the_bridge_accepts_clients_after_a_command_is_ended_by_a_signal(
    bridge, name, number, tmp_path
):
    with running(name, bridge, tmp_path) as process:
        wait_for_messages(process, bridge)
        process.send_signal(number)
        process.communicate(timeout=60)
    assert lets_in(bridge)
