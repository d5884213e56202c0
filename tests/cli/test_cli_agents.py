"""``webmap agent`` and ``webmap router``: options and their errors."""

import asyncio
import os
import subprocess
import sys

import msgspec
import psutil
import pytest

from equipment.command_line import run_inside
from equipment.waiting import wait_for
from equipment.webmap_process import simulator, webmap
from webmap.agents import address
from webmap.agents.announcements import PROTOCOL, Beacon, read_about
from webmap.agents.peer import Peer
from webmap.agents.router_access import RouterUser
from webmap.fleet.agent import (
    parse_beams,
    parse_operators,
    parse_rates,
)
from webmap.ros.temporary_bridge import ask_topics

pytestmark = pytest.mark.slow

pytest.importorskip("zenoh")

ROUTER = ("--router", "zenoh://127.0.0.1:1")
NAME = ("--name", "bay3")

FLEET = """
[bridges]
forklift = {{ url = "{url}", alignment = [3.0, 4.0, 90.0] }}

[[robots]]
name = "Forklift"
odometry = "/robot_0/odom"
tags = "yard"
scan = "/robot_0/base_scan"

[robots.twist]
topic = "/robot_0/cmd_vel"
v_max = 0.7
stops_within = 0.3

[[robots.buttons]]
label = "Dock"
service = "/dock"
"""


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("agent", "ws://h", *NAME), "Missing option '--router'"),
        (("agent", "ws://h", *ROUTER), "Missing option '--name'"),
        (("agent", "ws://h", *ROUTER, "--name", "a/b"), "got the agent 'a/b'"),
        (("agent", "http://h", *ROUTER, *NAME), "is not the address of a bridge"),
        (("agent", "ws://h", "--router", "ws://h", *NAME), "got the router 'ws://h'"),
        (("agent", "ws://h", *ROUTER, *NAME, "--rate", "/scan"), "/scan=5"),
        (("agent", "ws://h", *ROUTER, *NAME, "--rate", "/scan=0"), "/scan=5"),
        (("agent", "ws://h", *ROUTER, *NAME, "--beams", "/scan=0"), "/scan=180"),
        (("agent", "ws://h", *ROUTER, *NAME, "--beams", "/scan"), "/scan=180"),
        (("agent", "ws://h", *ROUTER, *NAME, "--operators", "a b"), "got the user"),
        (("agent", "none.toml", *ROUTER, *NAME), "none.toml"),
        (
            ("agent", "a.toml", *ROUTER, *NAME, "--stops-within", "1"),
            "the fleet file has all settings",
        ),
        (("router", "--listen", "tcp/0.0.0.0:0"), "reached from other computers"),
        (("router", "--listen", "nonsense"), "got the router 'nonsense'"),
        (("demo", "--agents", "2", "--robots", "3"), "one robot for each agent"),
    ],
)
def test_a_wrong_argument_ends_the_command_with_one_sentence(arguments, message):
    result = run_inside(
        *arguments, *(("--wait", "0") if arguments[0] == "agent" else ())
    )
    assert result.returncode == 2
    assert message in result.stderr.splitlines()[-1]


def test_the_unit_for_systemd_runs_the_same_command():
    result = run_inside("agent", "ws://localhost:9090", *ROUTER, *NAME, "--systemd")
    assert result.returncode == 0
    (command,) = [
        line for line in result.stdout.splitlines() if line.startswith("ExecStart=")
    ]
    assert command.endswith(
        "-m webmap agent ws://localhost:9090 --router zenoh://127.0.0.1:1 --name bay3"
    )
    assert "EnvironmentFile=-/etc/webmap/bay3.env" in result.stdout


def test_rates_and_operators_are_read():
    assert parse_beams(["scan=180"]) == {"/scan": 180}
    assert parse_rates(["scan=5", "/map=0.1"]) == {"/scan": 200, "/map": 10_000}
    assert parse_operators("ann, ben") == {
        "": "viewer",
        "ann": "operator",
        "ben": "operator",
    }


def listening(command):
    """Return the sockets on which a running command and its gate listen."""
    started = [
        process
        for process in psutil.Process().children()
        if command in process.cmdline()
    ]
    assert started
    every = [*started, *started[0].children(recursive=True)]
    return [
        place
        for process in every
        for place in process.net_connections()
        if place.status == psutil.CONN_LISTEN
    ]


def test_an_agent_describes_the_robots_of_its_fleet_file_and_listens_on_nothing(
    tmp_path,
):
    file = tmp_path / "bay3.toml"
    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
        simulator("--robots", "1") as url,
    ):
        file.write_text(FLEET.format(url=url))
        peer = Peer(router, RouterUser())
        beacons = []
        peer.listen(address.beacon("*"), lambda key, data: beacons.append((key, data)))
        peer.start()
        try:
            with webmap(
                "agent", file, "--router", router, *NAME, WEBMAP_STATE_DIR=str(tmp_path)
            ) as own:
                assert own == f"{router}/bay3"
                key, piece = wait_for(lambda: beacons and beacons[-1])
                assert key == "webmap/bay3/here"
                assert msgspec.json.decode(piece, type=Beacon).protocol == PROTOCOL
                answer = peer.ask(address.about("bay3"))
                about, robots, _ = read_about(answer)
                topics = asyncio.run(ask_topics(own, wait=10.0))
                assert listening("agent") == []
        finally:
            peer.close()
    (robot,) = robots.values()
    assert robot.name == "Forklift"
    assert robot.motion.twist.v_max == 0.7
    assert robot.tags == ["yard"]
    assert about.alignment == pytest.approx((3.0, 4.0, 90.0))
    assert topics["/robot_0/odom"] == "nav_msgs/Odometry"


def test_a_second_agent_of_the_same_name_waits_and_says_why(tmp_path):
    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
        simulator("--robots", "1") as url,
        webmap("agent", url, "--router", router, *NAME, WEBMAP_STATE_DIR=str(tmp_path)),
    ):
        wait_for_beacon(router)
        second = subprocess.Popen(
            [sys.executable, "-m", "webmap", "agent", url, "--router", router, *NAME],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ | {"WEBMAP_STATE_DIR": str(tmp_path / "second")},
        )
        try:
            lines = iter(second.stderr.readline, "")
            assert any("another agent is called bay3" in line for line in lines)
        finally:
            second.terminate()
            second.wait(20)
            second.stderr.close()


def wait_for_beacon(router):
    beacons = []
    peer = Peer(router, RouterUser())
    peer.listen(address.beacon("bay3"), lambda key, data: beacons.append(data))
    peer.start()
    try:
        wait_for(lambda: beacons)
    finally:
        peer.close()
