"""The errors that an agent or a display prints when the other side is wrong."""

import socket
import subprocess
import sys
import threading
from contextlib import contextmanager

import msgspec
import pytest

from webmap.agents import address
from webmap.agents.description import PROTOCOL, Beacon
from webmap.agents.peer import Peer, User
from webmap_process import webmap

pytest.importorskip("zenoh")

OPTIONS = ("--port", "0", "--no-browser")


@contextmanager
def lines_of(*arguments):
    """Run the command ``webmap``; yield the lines of its standard error."""
    with subprocess.Popen(
        [sys.executable, "-m", "webmap", *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        watchdog = threading.Timer(60, process.kill)
        watchdog.start()
        try:
            yield iter(process.stderr.readline, "")
        finally:
            watchdog.cancel()
            process.terminate()
            process.wait(60)


@contextmanager
def beacons(router, name, beacon):
    """Publish the beacon of an agent repeatedly."""
    ended = threading.Event()
    peer = Peer(router, User())
    peer.start()

    def repeat():
        while not ended.wait(0.2):
            peer.put_data(address.here(name), msgspec.json.encode(beacon))

    thread = threading.Thread(target=repeat)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()
        peer.close()


@pytest.mark.parametrize("version", [PROTOCOL - 1, PROTOCOL + 1])
def test_an_agent_with_another_protocol_is_named_with_both_versions(version):
    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
        beacons(router, "bay3", Beacon(version, "session", "about")),
        lines_of("view", router, *OPTIONS) as lines,
    ):
        expected = (
            "the robots of the agent bay3 are not shown: the agent speaks version "
            f"{version} of the protocol, this display version {PROTOCOL}: install the "
            "same WebMap on both"
        )
        assert any(expected in line for line in lines)


def test_a_beacon_that_cannot_be_read_is_no_agent():
    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
        beacons(router, "bay3", {"protocol": "new"}),
        lines_of("view", router, *OPTIONS) as lines,
    ):
        assert any(f"No agent is at {router} yet" in line for line in lines)


@pytest.mark.parametrize(
    "command",
    [
        ("view", "{router}", *OPTIONS),
        ("agent", "ws://127.0.0.1:1", "--router", "{router}", "--name", "bay3"),
    ],
)
def test_a_router_that_accepts_and_never_answers_is_no_zenoh_router(command):
    with socket.create_server(("127.0.0.1", 0)) as server:
        host, port = server.getsockname()
        router = f"zenoh://{host}:{port}"
        with lines_of(
            *(argument.format(router=router) for argument in command)
        ) as lines:
            message = f"cannot reach the router at tcp/{host}:{port}"
            assert any(
                message in line and "it is not a Zenoh router" in line for line in lines
            )
