"""The work for a scan that is drawn on the map by frames, in calls instead of time."""

import asyncio
import json
import sys
import time

import pytest
from pose_script import VirtualLoop, odometry

from webmap import Bridge, Robot
from webmap.features.layers.laser_scanner import LaserScanner

SCANS = 20


def transforms(stamp, *each):
    """Return a message with frames that turn and move."""
    return {
        "transforms": [
            {
                "header": {"stamp": stamp, "frame_id": parent},
                "child_frame_id": child,
                "transform": {
                    "translation": {"x": x, "y": 0.5, "z": 0.1},
                    "rotation": {"x": 0.0, "y": 0.0, "z": 0.6, "w": 0.8},
                },
            }
            for parent, child, x in each
        ]
    }


def scan(stamp, sweep):
    return {
        "header": {"stamp": stamp, "frame_id": "laser"},
        "angle_min": -3.0,
        "angle_increment": 0.1,
        "time_increment": sweep / 60,
        "range_min": 0.1,
        "range_max": 8.0,
        "ranges": [1.0 + 0.01 * stamp["nsecs"] / 1e9] * 60,
    }


class Count:
    """Counts calls in WebMap, and how often they lead to another file."""

    def __init__(self):
        self.calls = self.entries = 0
        self._files = []

    def __call__(self, frame, event, argument):
        if event == "call":
            file = frame.f_code.co_filename
            ours = "/webmap/" in file
            self.calls += ours
            self.entries += ours and file != (self._files or [""])[-1]
            self._files.append(file)
        elif event == "return" and self._files:
            self._files.pop()


@pytest.mark.parametrize(
    ("sweep", "calls", "entries"),
    [(0.0, 100, 62), (0.1, 140, 82)],
    ids=["of one moment", "while the sensor turns"],
)
def test_a_scan_is_placed_with_few_calls(sweep, calls, entries):
    count = Count()

    async def scenario():
        bridge = Bridge("ws://robot:9090")
        bridge._link._send = lambda frame: None
        robot = Robot("Bob")
        robot.set_odometry_topic(bridge, "/odom", type="nav_msgs/Odometry")
        robot.set_tf(bridge)
        layer = LaserScanner(robot, bridge, "/scan", max_dots=None, throttle=0)

        def receive(topic, message):
            frame = {"op": "publish", "topic": topic, "msg": message}
            bridge._link._received(json.dumps(frame).encode())

        mounted = transforms({"secs": 0}, ("base_link", "laser", 0.2))
        receive("/tf_static", mounted)
        receive("/odom", odometry(time.monotonic(), stamp=1.0))
        for tenth in range(12):
            at = {"secs": 1 + tenth // 10, "nsecs": tenth % 10 * 100_000_000}
            moved = ("map", "odom", 0.0), ("odom", "base_link", 0.1 * tenth)
            receive("/tf", transforms(at, *moved))
        drawn = []
        for number in range(-2, SCANS):  # the first ones import, and fill caches
            if number == 0:
                sys.setprofile(count)
            stamp = {"secs": 1, "nsecs": 30_000_000 * (number + 3)}
            receive("/scan", scan(stamp, sweep))
            drawn.append(layer.dots._dots)
        sys.setprofile(None)
        assert len(set(drawn)) == len(drawn)
        assert not robot.problems
        assert not layer.placed._on_robot
        robot.destroy()

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        runner.run(scenario())
    assert count.calls / SCANS <= calls
    assert count.entries / SCANS <= entries
