"""Scan assist from end to end: a simulated scanner, the gate's process, the wheels."""

import math
import re
import subprocess
import sys
import threading
import time

import pytest

from equipment.declarations import declared
from equipment.waiting import wait_for
from webmap.base.geometry import Twist
from webmap.base.outline import polygon_around
from webmap.config.motion import ScanAssistConfig
from webmap.gate.display.client import GateClient
from webmap.gate.protocol import RobotReport

RADIUS = 0.25


@pytest.fixture
def bridge():
    """A simulator with one robot, which faces along a corridor."""
    command = [sys.executable, "-m", "webmap", "sim", "--flat", "--seed", "7"]
    with subprocess.Popen(
        [*command, "--port", "0"], stdout=subprocess.PIPE, text=True
    ) as process:
        try:
            yield re.search(r"ready at (\S+)", process.stdout.readline())[1]
        finally:
            process.terminate()


@pytest.fixture
def gate(tmp_path, monkeypatch):
    monkeypatch.setenv("WEBMAP_STATE_DIR", str(tmp_path))
    client = GateClient()
    client.start()
    yield client
    client.stop()


def ranges_seen(bridge):
    """Return the current ranges of the scanner, received by a separate client."""
    from websockets.sync.client import connect

    from webmap.gate.lanes.scans import parse_scan, subscribe

    with connect(bridge, max_size=None) as link:
        link.send(subscribe("/base_scan", "t").decode())
        received = None
        while received is None:
            frame = link.recv(timeout=10)
            received = parse_scan(frame if isinstance(frame, bytes) else b"", 0.0)
    return [reach for reach in received[1].ranges if math.isfinite(reach)]


@pytest.mark.serial  # turns for a fixed time; a delayed program loses control
def test_scan_assist_stops_a_robot_that_is_driven_towards_a_wall(gate, bridge):
    newest = {}
    reports = gate.on_report(
        lambda report: isinstance(report, RobotReport) and newest.update(report=report)
    )
    gate.declare(
        declared(
            id="r1",
            name="Bob",
            bridge_url=bridge,
            twist_topic="/cmd_vel",
            stops_within=0.25,
            v_max=1.0,
            w_max=1.5,
            odometry_topic="/odom",
            odometry_type="nav_msgs/Odometry",
            assist=ScanAssistConfig(
                topic="/base_scan", footprint=polygon_around(RADIUS)
            ),
        )
    )
    wait_for(lambda: "report" in newest and newest["report"].armable, "a link")
    gate.take("r1").result(10)
    over = threading.Event()
    wanted = [Twist(0.0, 0.0, 1.5)]

    def drive():
        while not over.wait(0.05):
            gate.twist("r1", wanted[0])

    driver = threading.Thread(target=drive)
    driver.start()
    try:
        time.sleep(1.05)  # a quarter of a turn: towards the corridor's wall
        wanted[0] = Twist(0.8, 0.0, 0.0)
        wait_for(lambda: newest["report"].measured[0] > 0.1, "driving")
        wait_for(
            lambda: (
                newest["report"].measured[0] == 0.0
                and any("scan assist" in why for why in newest["report"].why)
            ),
            "a robot that stopped before the wall",
            seconds=20,
        )
        gap = min(ranges_seen(bridge)) - RADIUS
        assert 0.05 < gap < 0.5
    finally:
        over.set()
        driver.join()
        reports.remove()
