"""A rosbridge of many robots whose odometry contains its sending time.

Run as ``python -m benchmarks.stamped ROBOTS [BEAMS]``; prints its address. All robots
have the same y and the same yaw, so that a viewer can find a pose in a frame of the
display by these bytes alone.
"""

import asyncio
import json
import math
import struct
import sys
import time
from collections.abc import Iterable
from typing import Any

import cbor2
import numpy as np
from websockets.protocol import State

from benchmarks.frames import odometry, scan
from webmap.testing.witness import WitnessBridge

RATE = 10
"""Messages a second of each topic."""

PARTS = 5
"""Parts of the fleet, which send one after the other in each period."""

TURN = 100.0
"""Seconds after which the times in poses start again at zero."""

Y = 7.25
"""The y of all robots, in metres."""

MOST_WAITING = 8_000_000
"""Bytes that may wait for one client; if more wait, it misses messages."""

SPEEDS = 10.0
"""Seconds after which the times in velocities start again at zero."""


def topics(robot: int) -> tuple[str, str, str]:
    """Return the topics of a robot: odometry, velocity and scans."""
    return f"/robot_{robot}/odom", f"/robot_{robot}/cmd_vel", f"/robot_{robot}/scan"


def age(x: float, now: float) -> float:
    """Return the seconds since a pose was sent.

    Args:
        x: The x of the pose.
        now: The time of the monotonic clock, which all processes of a machine share.

    """
    return (now - x) % TURN


def frame(payload: bytes, *, text: bool) -> bytes:
    """Return a WebSocket frame of a server."""
    head = 0x81 if text else 0x82
    if len(payload) < 126:
        return bytes((head, len(payload))) + payload
    return struct.pack(">BBH", head, 126, len(payload)) + payload


class Stamped:
    """The messages of one robot's odometry."""

    def __init__(self, robot: int) -> None:
        message = odometry(robot)
        message["header"]["stamp"] = "STAMP"
        pose, twist = message["pose"]["pose"], message["twist"]["twist"]
        pose["position"] = {"x": "X", "y": Y, "z": 0.0}
        pose["orientation"] = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
        twist["linear"]["x"], twist["angular"]["z"] = "V", 0.0
        publish = {"op": "publish", "topic": topics(robot)[0], "msg": message}
        text = json.dumps(publish, separators=(",", ":"))
        for name in ("STAMP", "X", "V"):
            text = text.replace(f'"{name}"', f"%({name})s")
        self._text = text

    def frame(self, now: float) -> bytes:
        """Return the current frame."""
        wall = time.time()
        values = {
            "STAMP": f'{{"secs":{int(wall)},"nsecs":{int(wall % 1 * 1e9)}}}',
            "X": f"{now % TURN:.5f}",
            "V": f"{now % SPEEDS:.3f}",
        }
        return frame((self._text % values).encode(), text=True)


class Scans:
    """The scans of one robot: the same few again and again, in CBOR."""

    def __init__(self, robot: int, beams: int) -> None:
        self._topic = topics(robot)[2]
        self._count = 0
        self._messages = [scan(number, beams) for number in range(4 if beams else 0)]
        for message in self._messages:
            ranges = [math.nan if r is None else r for r in message["ranges"]]
            message["ranges"] = cbor2.CBORTag(85, np.array(ranges, "<f4").tobytes())
            message["intensities"] = cbor2.CBORTag(85, b"")

    def frame(self) -> bytes:
        """Return the current frame."""
        self._count += 1
        message, wall = self._messages[self._count % 4], time.time()
        stamp = {"secs": int(wall), "nsecs": int(wall % 1 * 1e9)}
        message["header"]["stamp"] = stamp
        publish = {"op": "publish", "topic": self._topic, "msg": message}
        return frame(cbor2.dumps(publish), text=False)


class StampedBridge(WitnessBridge):
    """The rosbridge.

    Args:
        robots: How many robots there are.
        beams: Beams of each scan; 0 for robots without scans.

    """

    def __init__(self, robots: int, beams: int = 0) -> None:
        super().__init__(self._note)
        self._every: dict[tuple[int, str], int] = {}
        """The periods from one message of a topic to the next, by connection."""
        self._robots = [Stamped(number) for number in range(robots)]
        self._scans = [Scans(number, beams) for number in range(robots)]
        for number in range(robots):
            odom, velocity, ranges = topics(number)
            self.types |= {odom: "nav_msgs/Odometry", velocity: "geometry_msgs/Twist"}
            if beams:
                self.types[ranges] = "sensor_msgs/LaserScan"

    async def play(self) -> None:
        """Send messages to all subscribers, for ever."""
        due, count = time.monotonic(), 0
        while True:
            due += 1 / RATE / PARTS
            await asyncio.sleep(due - time.monotonic())
            count += 1
            robots = range(count % PARTS, len(self._robots), PARTS)
            self._send_part(robots, count // PARTS)

    def _note(self, link: int, message: dict[str, Any]) -> None:
        """Keep the ``throttle_rate`` of a subscription, as a rosbridge does."""
        if message.get("op") == "subscribe":
            periods = int(message.get("throttle_rate", 0)) * RATE / 1000
            self._every[link, str(message.get("topic"))] = max(1, round(periods))

    def _send_part(self, robots: Iterable[int], period: int) -> None:
        """Send the messages of some robots straight to the sockets."""
        shown = set[str]().union(*(each.topics for each in self._sockets.values()))
        now, made = time.monotonic(), {}
        for number in robots:
            odom, _, ranges = topics(number)
            if odom in shown:
                made[odom] = self._robots[number].frame(now)
            if ranges in shown:
                made[ranges] = self._scans[number].frame()
        for socket in self._sockets.values():
            link = socket.connection
            waiting = link.transport.get_write_buffer_size()
            if link.state is State.OPEN and waiting < MOST_WAITING:
                due = [
                    made[topic]
                    for index, topic in enumerate(made)
                    if socket.topics.get(topic)
                    and (period + index) % self._every.get((socket.number, topic), 1)
                    == 0
                ]
                link.transport.write(b"".join(due))


async def serve(robots: int, beams: int) -> None:
    """Serve until killed."""
    bridge = StampedBridge(robots, beams)
    await bridge.start()
    print(f"ws://127.0.0.1:{bridge.port}", flush=True)
    await bridge.play()


if __name__ == "__main__":
    asyncio.run(serve(int(sys.argv[1]), int(sys.argv[2]) if sys.argv[2:] else 0))
