"""A gate without a display drives a good robot while three bridges flood the gate."""

import itertools
import json
import threading
import time
from contextlib import ExitStack

import pytest
from safety_bench import pass_time
from safety_load import helper
from safety_run import grace

from equipment.declarations import declared
from equipment.waiting import wait_for
from webmap.gate.display.client import GateClient
from webmap.testing import Sentinel, WitnessRobot

pytestmark = [pytest.mark.safety, pytest.mark.serial]

PERIOD = 0.05
"""Seconds between two commands, the same as for a page."""


class Page:
    """A page on ``/drive``: sends commands to the good robot at 20 Hz."""

    def __init__(self, client):
        self.pressed = False
        self.robot = {}
        self.ticks = []
        self._tick = None
        self._end = threading.Event()
        self._connection = client.connect("Ann", "operator", self._receive, print)
        self._thread = threading.Thread(target=self._stream, daemon=True)
        self._thread.start()

    def _receive(self, text):
        message = json.loads(text)
        if message["op"] == "tick":
            self._tick = message["tick"]
            self.ticks.append(time.monotonic())
        elif message["op"] == "robot" and message["robot"] == "good":
            self.robot = message

    def send(self, **command):
        self._connection.receive(json.dumps(command))

    def _stream(self):
        for seq in itertools.count():
            if self._end.wait(PERIOD):
                return
            if self._tick is not None and self.robot.get("mine"):
                self.send(
                    op="drive",
                    robot="good",
                    epoch=self.robot["epoch"],
                    seq=seq,
                    tick=self._tick,
                    x=1.0 if self.pressed and self.robot["armed"] else 0.0,
                    y=0.0,
                    turn=0.0,
                )

    def end(self):
        self._end.set()
        self._thread.join()


def spec(id, url):
    return declared(
        id=id,
        name=id,
        bridge_url=url,
        twist_topic="/cmd_vel",
        stops_within=0.5,
        v_max=1.0,
        w_max=1.5,
        odometry_topic="/odom",
        odometry_type="nav_msgs/Odometry",
    )


class FloodedGate:
    """A running gate with a good robot, and with a robot for each hostile bridge."""

    def __init__(self, folder, monkeypatch, peers):
        monkeypatch.setenv("WEBMAP_STATE_DIR", str(folder))
        self._open = ExitStack()
        self._peers = peers

    def __enter__(self):
        enter = self._open.enter_context
        helpers = [
            enter(helper("safety_hostile_peers.py", f"safety_hostile_peers:{peer}"))
            for peer in self._peers
        ]
        urls = [process.stdout.readline().strip() for process in helpers]
        self.robot, self.sentinel = enter(WitnessRobot()), enter(Sentinel())
        self.client = GateClient()
        self.client.start()
        self._open.callback(self.client.stop)
        self.page = Page(self.client)
        self._open.callback(self.page.end)
        self.client.declare(spec("good", self.robot.url))
        for number, url in enumerate(urls):
            self.client.declare(spec(f"h{number}", url))
        pass_time(2.0)
        return self

    def __exit__(self, *exception):
        self._open.close()

    def drive_off(self):
        page = self.page
        wait_for(lambda: page.robot.get("armable") or page.robot.get("mine"), "a robot")
        page.send(op="take", robot="good")
        wait_for(lambda: page.robot.get("mine"), "control of the robot")
        pass_time(0.3)
        page.pressed = True
        wait_for(lambda: self.robot.velocity.vx == 1.0, "full speed")

    def stop(self):
        """Send STOP; return the seconds to the first zero, and the machine's delay."""
        begun = time.monotonic()
        self.client.stop_robot("good")
        zero = wait_for(lambda: self.robot.log.first_zero(begun), "a zero")
        late = self.sentinel.stolen(begun, zero)
        self.page.pressed = False
        pass_time(0.6)
        self.client.reset("good", self.page.robot["stop"]["id"])
        return zero - begun, late


FLOODS = [
    ("tiny_texts", "tiny_texts", "tiny_texts"),
    ("endless_message", "pings", "empty_frames"),
    ("pongs", "topics", "frames_with_handshake"),
    ("endless_headers", "status_words", "nested"),
]


@pytest.mark.parametrize("peers", FLOODS, ids=" ".join)
def test_stop_reaches_the_robot_within_50_ms_while_three_bridges_flood_the_gate(
    peers, tmp_path, monkeypatch
):
    with FloodedGate(tmp_path, monkeypatch, peers) as gate:
        for _ in range(3):
            gate.drive_off()
            begun = time.monotonic()
            pass_time(1.5)
            ended = time.monotonic()
            received = [t for t in gate.robot.log.twists if begun <= t.at <= ended]
            ticks = [at for at in gate.page.ticks if begun <= at <= ended]
            tick_gap = longest_gap(ticks, gate.sentinel)
            velocity_gap = longest_gap([t.at for t in received], gate.sentinel)
            stopped, stolen = gate.stop()
            zeros = sum(each.is_zero for each in received)
            figures = {
                "stop": stopped,
                "stolen": stolen,
                "tick_gap": tick_gap,
                "velocity_gap": velocity_gap,
                "zeros": zeros,
            }
            print(peers, figures)
            assert stopped < 0.05 + grace(stolen), figures
            assert tick_gap < 0.15, figures
            assert velocity_gap < 0.15, figures
            if gate.sentinel.worst(begun - 0.3, ended) < 0.05:
                # Otherwise the machine may have delayed the page for too long.
                assert zeros == 0, figures


def longest_gap(times, sentinel):
    """Return the longest gap between successive times, without the machine's delay."""
    return max(
        b - a - grace(sentinel.stolen(a, b)) for a, b in itertools.pairwise(times)
    )
