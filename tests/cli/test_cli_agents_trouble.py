"""The errors that an agent or a display prints when the other side is wrong."""

import asyncio
import os
import socket
import subprocess
import sys
import threading
import time
from contextlib import contextmanager

import msgspec
import psutil
import pytest

from equipment.webmap_process import simulator, webmap
from webmap.agents import address
from webmap.agents.announcements import PROTOCOL, Beacon
from webmap.agents.link import AgentConnection
from webmap.agents.peer import Peer, close_peers, peer_of
from webmap.agents.router_access import RouterUser
from webmap.ros.rosbridge import ops

pytestmark = pytest.mark.slow

pytest.importorskip("zenoh")

OPTIONS = ("--port", "0", "--no-browser")


@contextmanager
def lines_of(*arguments, **environment):
    """Run the command ``webmap``; yield the lines of its standard error."""
    with subprocess.Popen(
        [sys.executable, "-m", "webmap", *arguments],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **environment},
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
    peer = Peer(router, RouterUser())
    peer.start()

    def repeat():
        while not ended.wait(0.2):
            peer.put_data(address.beacon(name), msgspec.json.encode(beacon))

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


USERS = """
[users.bay3]
password = "one"
agent = "bay3"

[users.west]
password = "two"
drives = ["bay3"]
"""


def test_an_agent_and_a_display_name_what_their_user_may_not_do(tmp_path):
    (tmp_path / "users.toml").write_text(USERS)
    west = {"WEBMAP_ROUTER_USER": "west", "WEBMAP_ROUTER_PASSWORD": "two"}
    users = ("--users", str(tmp_path / "users.toml"))
    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0", *users) as router,
        simulator("--robots", "1") as url,
    ):
        agent = ("agent", url, "--router", router, "--name", "bay3")
        state = {"WEBMAP_STATE_DIR": str(tmp_path)}
        with lines_of(*agent, **west, **state) as lines:
            expected = "the router's user west may not act as the agent bay3"
            assert any(expected in line for line in lines)
        with lines_of("view", router, *OPTIONS, **west) as lines:
            expected = f"No agent is at {router} yet, or the user west may not see it"
            assert any(expected in line for line in lines)


def start_agent(url, router, folder):
    command = ("agent", url, "--router", router, "--name", "bay3")
    return psutil.Popen(
        [sys.executable, "-m", "webmap", *command],
        stdout=subprocess.DEVNULL,
        env=os.environ | {"WEBMAP_STATE_DIR": str(folder)},
    )


def kill(agent):
    """Kill an agent and its gate."""
    everything = [agent, *agent.children(recursive=True)]
    for process in everything:
        process.kill()
    psutil.wait_procs(everything, 20)


class Poses:
    """A connection of a display that shows where a robot is."""

    def __init__(self, url):
        self.at = 0.0
        self.lane = AgentConnection(
            url, opened=self.subscribe, received=self.take, closed=str, failed=str
        )
        self.lane.start(asyncio.get_running_loop())

    def subscribe(self):
        self.at = 0.0
        self.lane.send(ops.subscribe("/robot_0/odom", id="1", throttle_rate=100))

    def take(self, frame):
        self.at = time.monotonic()

    async def wait(self, since, within):
        while self.at < since:
            assert time.monotonic() < since + within, "no poses"
            await asyncio.sleep(0.02)


def test_poses_are_back_three_seconds_after_a_killed_agent_is(tmp_path):
    async def trial(url, router):
        signs = []
        peer_of(router).listen(address.beacon("bay3"), lambda *_: signs.append(1))
        agent = start_agent(url, router, tmp_path)
        try:
            poses = Poses(f"{router}/bay3")
            await poses.wait(time.monotonic(), 30.0)
            for _ in range(2):
                await asyncio.to_thread(kill, agent)
                signs.clear()
                agent = start_agent(url, router, tmp_path)
                while not signs:
                    await asyncio.sleep(0.02)
                other = Poses(f"{router}/bay3")  # its data comes to the first one too
                await poses.wait(time.monotonic(), 3.0)
                await other.lane.stop()
            await poses.lane.stop()
        finally:
            await asyncio.to_thread(kill, agent)
            await asyncio.to_thread(close_peers)

    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
        simulator("--robots", "1") as url,
    ):
        asyncio.run(asyncio.wait_for(trial(url, router), 100.0))
