"""The simulator and the player as processes, and the server's sockets."""

import asyncio
import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import pytest
from simulated import SIMULATOR, room, running
from websockets.asyncio.client import connect

from equipment.captured_frames import PLAYER, frame_file, played
from equipment.frame_player import load_recording
from equipment.waiting import until
from webmap.base.errors import ConfigError
from webmap.ros.rosbridge.server.dialect import (
    POLITE,
    REAL,
    Dialect,
    Quirks,
    parse_quirks,
)
from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.graph import Graph
from webmap.ros.rosbridge.server.rosapi import Rosapi
from webmap.ros.rosbridge.server.schema import Schema
from webmap.ros.rosbridge.server.server import RosbridgeServer
from webmap.sim import run_simulator

pytestmark = pytest.mark.slow

REFERENCE = (Path(__file__).parents[2] / "docs/reference/cli.md").read_text()


async def subscribe(socket_, topic, **more):
    await socket_.send(json.dumps({"op": "subscribe", "topic": topic, **more}))


async def next_of(socket_, topic):
    async with asyncio.timeout(20):
        while True:
            operation = json.loads(await socket_.recv())
            if operation.get("topic") == topic:
                return operation["msg"]


@contextlib.asynccontextmanager
async def simulated(**options):
    """Run a simulator in this loop; yield its URL."""
    ready, stop = asyncio.get_running_loop().create_future(), asyncio.Event()
    task = asyncio.create_task(
        run_simulator(on_ready=ready.set_result, stop=stop, **options)
    )
    try:
        await asyncio.wait([ready, task], return_when=asyncio.FIRST_COMPLETED)
        if task.done():
            await task
        yield ready.result()
    finally:
        stop.set()
        await asyncio.wait([task])


def test_a_client_drives_a_robot_over_a_socket():
    async def scenario():
        async with simulated() as url, connect(url, max_size=None) as client:
            await subscribe(client, "/robot_0/odom")
            speed = 0.0
            async with asyncio.timeout(20):
                while speed != pytest.approx(0.4):
                    message = {"linear": {"x": 0.4}}
                    operation = {"op": "publish", "topic": "/robot_0/cmd_vel"}
                    await client.send(json.dumps({**operation, "msg": message}))
                    odometry = await next_of(client, "/robot_0/odom")
                    speed = odometry["twist"]["twist"]["linear"]["x"]

    asyncio.run(scenario())


def test_a_port_in_use_is_an_error():
    async def scenario():
        with socket.socket() as listener:
            listener.bind(("127.0.0.1", 0))
            listener.listen()
            with pytest.raises(ConfigError, match="in use: end the program"):
                await run_simulator(port=listener.getsockname()[1])

    asyncio.run(scenario())


@pytest.mark.parametrize(
    "options",
    [
        {"robots": 0},
        {"dialect": "ros3"},
        {"twist": "Wrench"},
        {"robot_timeout": 0},
        {"quirks": "odd"},
        {"quirks": "real,nonsense"},
        {"map": "/no/such/map.yaml"},
        {"robots": 2, "errands": 3},
        {"errands": -1},
        {"errands": 1, "wander": True},
    ],
)
def test_invalid_simulator_options_are_refused(options):
    with pytest.raises(ConfigError):
        asyncio.run(run_simulator(**options))


def test_quirks_are_parsed_from_their_names():
    assert parse_quirks("polite", "ros2") == POLITE
    assert parse_quirks("real", "ros2") == REAL["2.1"]
    assert parse_quirks("polite, bare_nan", "ros1") == Quirks(bare_nan=True)
    assert not parse_quirks("real,-silent", "ros1").silent


def test_the_reference_lists_every_quirk_with_its_versions():
    row = r"^\| `(\w+)` \| .+? \| (yes)? ?\| (yes)? ?\| (yes)? ?\|$"
    rows = re.findall(row, REFERENCE, re.M)
    real = {
        name: [getattr(REAL[version], name) for version in ("0.11", "2.1", "4.2")]
        for name in (field.name for field in fields(Quirks))
    }
    assert {name: [bool(each) for each in marks] for name, *marks in rows} == real


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_process_cleanly(number):
    process = subprocess.Popen(
        [sys.executable, "-m", *SIMULATOR],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline().startswith("rosbridge is ready at ws://127.0.0.1:")
    process.send_signal(number)
    out, err = process.communicate(timeout=20)
    assert process.returncode == 0
    assert out == ""
    assert "Traceback" not in err


def test_with_its_parent_the_process_ends_with_its_standard_input():
    process = subprocess.Popen(
        [sys.executable, "-m", *SIMULATOR, "--with-parent"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    process.stdout.readline()
    process.communicate(timeout=20)
    assert process.returncode == 0


def test_a_stalled_client_delays_no_other_client_and_uses_little_memory():
    psutil = pytest.importorskip("psutil")

    async def scenario(url):
        async with (
            connect(url, max_size=None, max_queue=1) as stalled,
            connect(url, max_size=None) as good,
        ):
            # A stalled client that requests the map repeatedly.
            for number in range(200):
                await subscribe(stalled, "/map", id=str(number), queue_length=1)
            await subscribe(stalled, "/robot_0/base_scan", queue_length=1)
            await subscribe(good, "/robot_0/odom")
            for _ in range(40):
                await next_of(good, "/robot_0/odom")
            stalled.transport.abort()

    with running() as url:
        port = int(url.rpartition(":")[2])
        (server,) = [
            c
            for c in psutil.Process(os.getpid()).children()
            if any(n.laddr.port == port for n in c.net_connections())
        ]
        before = server.memory_info().rss
        asyncio.run(scenario(url))
        grown = server.memory_info().rss - before
    assert grown < 40_000_000


def test_disconnected_clients_leave_no_sessions_and_no_subscriptions():
    async def scenario():
        schema = Schema(Dialect("ros1"))
        graph = Graph(schema)
        Rosapi(graph, POLITE).start()
        server = RosbridgeServer(graph, Encoder(schema, POLITE))
        url = await server.start("127.0.0.1", 0)
        graph.advertise("talker", "/chatter", "std_msgs/String")
        for _ in range(5):
            async with contextlib.AsyncExitStack() as stack:
                for _ in range(10):
                    client = await stack.enter_async_context(connect(url))
                    await subscribe(client, "/chatter")
                    call = {"op": "call_service", "service": "/rosapi/get_time"}
                    await client.send(json.dumps(call))
                    await client.recv()
                assert len(graph.topics["/chatter"].subscribers) == 10
        await until(lambda: not server.sessions)
        assert graph.topics["/chatter"].subscribers == {}
        await server.stop()

    asyncio.run(scenario())


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_the_player_sends_captured_frames_byte_for_byte(dialect):
    async def scenario(url):
        async with connect(url, max_size=None) as client:
            await subscribe(client, "/robot_0/odom")
            assert (
                await client.recv()
                == frame_file(dialect, "publish_odom.json").read_text()
            )
        async with connect(url, max_size=None) as client:
            await subscribe(client, "/map", compression="cbor")
            assert (
                await client.recv() == frame_file(dialect, "cbor_map.bin").read_bytes()
            )
            # A latched message is sent once, before other messages.
            await subscribe(client, "/robot_1/odom")
            second = json.loads(await client.recv())
            assert second["topic"] == "/robot_1/odom"
            assert second["msg"]["pose"]["pose"]["position"]["x"] > 5

    with running(*played(dialect), **PLAYER) as url:
        asyncio.run(scenario(url))


def test_the_player_answers_rosapi_calls():
    async def scenario(url):
        async with connect(url) as client:
            for name in ("robot_0", "robot_1"):
                args = {"topic": f"/{name}/base_scan"}
                call = {"op": "call_service", "service": "/rosapi/topic_type"}
                await client.send(json.dumps({**call, "args": args, "id": name}))
                response = json.loads(await client.recv())
                assert response["id"] == name
                assert response["values"] == {"type": "sensor_msgs/LaserScan"}
            await client.send("nonsense")
            await client.send('{"op": "call_service", "service": "/no/such"}')
            assert json.loads(await client.recv())["result"] is False

    with running(*played("ros1"), **PLAYER) as url:
        asyncio.run(scenario(url))


def test_the_player_ignores_other_files_beside_the_frames(tmp_path):
    (tmp_path / "INDEX.json").write_text('[{"file": "x"}]')
    (tmp_path / "broken.json").write_text("")
    (tmp_path / "nothing_came.bin").write_bytes(b"")
    text = frame_file("ros1", "publish_odom.json").read_text()
    (tmp_path / "publish_odom.json").write_text(text)
    assert load_recording(sorted(tmp_path.iterdir())).texts == {"/robot_0/odom": text}


def test_the_player_refuses_a_recording_without_publications(tmp_path):
    nothing = tmp_path / "nothing_came.bin"
    nothing.write_bytes(b"")
    done = subprocess.run(
        [sys.executable, "-m", PLAYER["module"], str(nothing)],
        cwd=PLAYER["cwd"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "no captured publications" in done.stderr


def test_the_room_helper_makes_a_closed_room():
    cells = room(2, 2).occupancy
    assert (cells[0] == 100).all()
    assert (cells[:, -1] == 100).all()
