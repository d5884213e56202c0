"""Imitates a rosbridge with many robots that send odometry and scans all the time.

Run as ``python -m benchmarks.busy_robots ROBOTS BEAMS``; prints its port. Each robot
has ``/robot_N/odom`` and, with beams, ``/robot_N/base_scan``, at 10 Hz. It implements
subscriptions with their ``throttle_rate``, and answers no service call.
"""

import asyncio
import json
import math
import struct
import sys
import time
from collections.abc import Iterator

import cbor2
import numpy as np
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from benchmarks.frames import odometry, scan

RATE = 10.0
"""Messages of a topic a second."""

SLOTS = 10
"""Parts of a period over which the robots are spread."""

SECONDS, NANOSECONDS, X, Y = 1_234_567_890, 987_654_321, 4321.125, 8642.125
"""Numbers in the template of a message that the current values replace."""


def _websocket(opcode: int, payload: bytes) -> bytes:
    """Return an unmasked WebSocket frame."""
    size = len(payload)
    if size < 126:
        return struct.pack(">BB", 0x80 | opcode, size) + payload
    if size < 1 << 16:
        return struct.pack(">BBH", 0x80 | opcode, 126, size) + payload
    return struct.pack(">BBQ", 0x80 | opcode, 127, size) + payload


class Robots:
    """The messages of all robots, which differ only in topic, stamp and position.

    Args:
        beams: The number of beams of a scan.

    """

    def __init__(self, beams: int) -> None:
        message = odometry(1)
        message["header"]["stamp"] = {"secs": SECONDS, "nsecs": NANOSECONDS}
        message["pose"]["pose"]["position"].update(x=X, y=Y)
        text = json.dumps(message, separators=(",", ":"))
        for number, place in ((SECONDS, "%d"), (NANOSECONDS, "%d"), (X, "%f")):
            text = text.replace(str(number), place)
        self._odometry = text.replace(str(Y), "%f")
        seen = scan(1, max(beams, 1))
        ranges = [math.nan if each is None else each for each in seen["ranges"]]
        seen["header"]["stamp"] = {"secs": SECONDS, "nsecs": 0}
        seen["ranges"] = cbor2.CBORTag(85, np.array(ranges, "<f4").tobytes())
        seen["intensities"] = cbor2.CBORTag(85, b"")
        self._scan = cbor2.dumps(seen)

    def frame(self, topic: str, now: float) -> bytes:
        """Return the WebSocket frame with a message of a topic at a Unix time."""
        _, name, kind = topic.split("/")
        number = int(name.removeprefix("robot_"))
        secs, part = divmod(now, 1.0)
        if kind == "odom":
            x = number % 40 * 4.0 + math.cos(now)
            y = number // 40 * 4.0 + math.sin(now)
            body = self._odometry % (secs, part * 1e9, x, y)
            text = f'{{"op":"publish","topic":"{topic}","msg":{body}}}'
            return _websocket(1, text.encode())
        was, stamp = struct.pack(">I", SECONDS), struct.pack(">I", int(secs))
        seen = self._scan.replace(was, stamp)
        head: bytes = cbor2.dumps({"op": "publish", "topic": topic, "msg": None})[:-1]
        return _websocket(2, head + seen)


class Subscriber:
    """The subscriptions of one connection."""

    def __init__(self, robots: Robots) -> None:
        self._robots = robots
        self._slots: list[dict[str, dict[str, float]]] = [{} for _ in range(SLOTS)]
        self._due: dict[str, float] = {}

    def receive(self, operation: dict[str, object]) -> None:
        """Carry out ``subscribe`` and ``unsubscribe``; ignore everything else."""
        topic, id = str(operation.get("topic", "")), str(operation.get("id"))
        if not topic.endswith(("/odom", "/base_scan")):
            return
        slot = self._slots[int(topic.split("/")[1].removeprefix("robot_")) % SLOTS]
        if operation["op"] == "subscribe":
            throttle = float(str(operation.get("throttle_rate", 0))) / 1000
            slot.setdefault(topic, {})[id] = throttle
            self._due[topic] = min(self._due.get(topic, 0.0), time.time() + throttle)
        elif operation["op"] == "unsubscribe":
            slot.get(topic, {}).pop(id, None)
            if not slot.get(topic):
                slot.pop(topic, None)
                self._due.pop(topic, None)

    def frames(self, slot: int, now: float) -> Iterator[bytes]:
        """Yield the frames that are due for the robots of a slot."""
        for topic, asked in self._slots[slot].items():
            if now >= self._due[topic] - 0.5 / RATE:
                self._due[topic] = now + min(asked.values())
                yield self._robots.frame(topic, now)


async def _play(link: ServerConnection, subscriber: Subscriber) -> None:
    due, slot = time.time(), 0
    while True:
        due = max(due + 1 / RATE / SLOTS, time.time() - 0.5)
        await asyncio.sleep(max(0.0, due - time.time()))
        batch = b"".join(subscriber.frames(slot, time.time()))
        if batch:
            link.transport.write(batch)
        slot = (slot + 1) % SLOTS


async def main(beams: int) -> None:
    """Serve until killed."""
    robots = Robots(beams)

    async def handle(link: ServerConnection) -> None:
        subscriber = Subscriber(robots)
        playing = asyncio.create_task(_play(link, subscriber))
        try:
            async for text in link:
                subscriber.receive(json.loads(text))
        except ConnectionClosed:
            pass
        finally:
            playing.cancel()

    keep = {"compression": None, "ping_interval": None}
    async with serve(handle, "127.0.0.1", 0, **keep) as server:  # type: ignore[arg-type]
        print(next(iter(server.sockets)).getsockname()[1], flush=True)
        await server.serve_forever()


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1])))
