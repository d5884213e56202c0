"""The work per message from the socket to a callback, in calls instead of time."""

import asyncio
import json
import sys
from collections import Counter
from contextlib import suppress

import pytest
from test_ros_paced import bridge

from equipment.waiting import until
from webmap import Bridge
from webmap.ros.messages import LaserScanMsg, OdometryMsg

MESSAGES = 2000

ODOMETRY = {
    "header": {"seq": 1, "stamp": {"secs": 1, "nsecs": 2}, "frame_id": "odom"},
    "child_frame_id": "base_link",
    "pose": {
        "pose": {
            "position": {"x": 1.0, "y": 2.0, "z": 0.0},
            "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        },
        "covariance": [0.1] * 36,
    },
    "twist": {
        "twist": {
            "linear": {"x": 0.1, "y": 0.0, "z": 0.0},
            "angular": {"x": 0.0, "y": 0.0, "z": 0.2},
        },
        "covariance": [0.1] * 36,
    },
}
SCAN = {
    "header": {"seq": 1, "stamp": {"secs": 1, "nsecs": 2}, "frame_id": "laser"},
    "angle_min": -3.1,
    "angle_max": 3.1,
    "angle_increment": 0.1,
    "time_increment": 0.0,
    "scan_time": 0.1,
    "range_min": 0.1,
    "range_max": 8.0,
    "ranges": [1.5, None, 2.5],
    "intensities": [],
}


class Calls:
    """Counts the calls of a thread by file and function name."""

    def __init__(self):
        self.python, self.builtin = Counter(), Counter()

    def __call__(self, frame, event, argument):
        if event == "call":
            self.python[frame.f_code.co_filename, frame.f_code.co_name] += 1
        elif event == "c_call":
            self.builtin[argument.__name__] += 1

    def calls_in(self, part):
        """Return how many functions in files of this name were called."""
        return sum(n for (file, _), n in self.python.items() if part in file)


def receive(topic, type, decode, message):
    """Let a callback receive many messages; returns the calls between them."""
    text = json.dumps({"op": "publish", "topic": topic, "msg": message}).encode()
    frame = b"\x81\x7e" + len(text).to_bytes(2, "big") + text
    calls, seen = Calls(), []

    def on_message(value):
        assert isinstance(value, decode)
        seen.append(None)
        if len(seen) == 1:
            sys.setprofile(calls)
        elif len(seen) == MESSAGES + 1:
            sys.setprofile(None)

    async def story():
        async def talk(reader, writer):
            writer.write(frame * (MESSAGES + 1))
            await reader.read()

        async with bridge(talk) as url:
            link = Bridge(url)
            link.subscribe(topic, on_message, type, decode=decode, encoding="text")
            link.start(asyncio.get_running_loop())
            with suppress(TimeoutError):
                await until(lambda: len(seen) > MESSAGES)
            sys.setprofile(None)
            await link.stop()

    asyncio.run(story())
    assert len(seen) == MESSAGES + 1
    return calls


@pytest.mark.parametrize(
    ("topic", "type", "decode", "message"),
    [
        ("/odom", "nav_msgs/Odometry", OdometryMsg, ODOMETRY),
        ("/scan", "sensor_msgs/LaserScan", LaserScanMsg, SCAN),
    ],
    ids=["odometry", "scans"],
)
def test_a_message_takes_few_calls_and_no_turn_of_the_event_loop(
    topic, type, decode, message, monkeypatch
):
    # The bridge of this test answers no pings.
    monkeypatch.setattr("webmap.ros.sockets.connection.Liveness.LIMIT", 1000.0)
    # Turns end by time, so the counts would depend on the machine.
    monkeypatch.setattr("webmap.ros.sockets.turns.STEP", 1000.0)
    monkeypatch.setattr("webmap.ros.sockets.turns.SHARE", 1000.0)
    calls = receive(topic, type, decode, message)
    each = {
        "calls of Python": sum(calls.python.values()) / MESSAGES,
        "decodings": calls.builtin["decode"] / MESSAGES,
        "calls of websockets": calls.calls_in("websockets") / MESSAGES,
        "turns of the event loop": calls.python[
            asyncio.base_events.__file__, "_run_once"
        ]
        / MESSAGES,
        "questions for processor time": calls.builtin["thread_time"] / MESSAGES,
    }
    most = {
        "calls of Python": 26 if decode is OdometryMsg else 34,
        "decodings": 1.01,
        "calls of websockets": 0.1,
        "turns of the event loop": 0.1,
        "questions for processor time": 0.1,
    }
    assert all(each[name] <= most[name] for name in most), each
