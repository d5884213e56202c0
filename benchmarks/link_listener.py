"""Receives the messages of ``benchmarks.link_server`` and reports cost and times.

Run as ``python -m benchmarks.link_listener CLIENT LINK URL SECONDS``; prints JSON. The
client ``webmap`` is a Bridge that gives each message to a listener as a view; ``bare``
is websockets alone, which reads the same frames and looks at none of them until the
end. The cost is the processor time of this whole process, all threads, after the first
second; the messages of that second are not counted.
"""

import asyncio
import json
import sys
import time
from collections.abc import Callable
from typing import Any

import cbor2
from websockets.asyncio.client import connect

from benchmarks.link_server import FIRST, TOPICS, Times, schedule
from webmap import Bridge
from webmap.ros.messages import LaserScanMsg, OdometryMsg, TFMessage
from webmap.ros.rosbridge import ops
from webmap.ros.serialized.reader import make_reader
from webmap.ros.serialized.schemas import read_schema

WARM = 1.0
"""Seconds whose messages are not counted."""

PATIENCE = 13.0
"""Seconds beyond those of the sending for the connection, and for late messages."""

HEAD = 13
"""Bytes before the message in a frame of Foxglove: operation, subscription and time."""

Read = Callable[[Any], float]


class Meter:
    """Counts messages, and asks for the processor time twice, as each question costs.

    Args:
        seconds: The duration of the sending.

    """

    def __init__(self, seconds: float) -> None:
        plan = schedule(seconds)
        self._total, self._warm = len(plan), sum(due < WARM for due, *_ in plan)
        self._seen = 0
        self._before = 0.0
        self._patience = seconds + PATIENCE
        self.cpu = 0.0
        """Seconds of processor time for each message."""
        self._done = asyncio.Event()

    def count(self) -> float:
        """Count a message; return the time."""
        self._seen += 1
        if self._seen == self._warm:
            self._before = time.process_time()
        elif self._seen == self._total:
            self._end()
        return time.monotonic()

    async def wait(self) -> None:
        """Wait until all messages have come, or should have come.

        Raises:
            RuntimeError: If half of them did not come.

        """
        try:
            async with asyncio.timeout(self._patience):
                await self._done.wait()
        except TimeoutError:
            if self._seen < self._total / 2:
                text = f"only {self._seen} of {self._total} messages came"
                raise RuntimeError(text) from None
            self._end()

    def _end(self) -> None:
        self.cpu = time.process_time() - self._before
        self.cpu /= self._seen - self._warm
        self._done.set()


def x_and_stamp(message: OdometryMsg) -> float:
    """Return the stamp; the position is read, as by a user."""
    _ = message.pose.pose.position.x
    return message.stamp


def ranges_and_stamp(message: LaserScanMsg) -> float:
    """Return the stamp; the ranges are read, as by a user."""
    _ = message.ranges
    return message.stamp


def rows_and_stamp(message: TFMessage) -> float:
    """Return the stamp; the transforms are read, as by the buffer of frames."""
    row = message.rows[0]
    return row[0] or row[2]


VIEWS: dict[str, tuple[Any, Read]] = {
    "/odom": (OdometryMsg, x_and_stamp),
    "/scan": (LaserScanMsg, ranges_and_stamp),
    "/tf": (TFMessage, rows_and_stamp),
}


async def listen(link: str, url: str, meter: Meter) -> Times:
    """Receive the messages with a Bridge."""
    got: Times = {topic: {} for topic in TOPICS}
    bridge = Bridge(url)
    for topic, (type, *_) in TOPICS.items():
        view, read = VIEWS[topic]

        def take(
            message: Any, times: dict[int, float] = got[topic], read: Read = read
        ) -> None:
            times[int(read(message)) - FIRST] = meter.count()

        encoding: Any = {"json": "text", "cbor": "binary"}.get(link)
        bridge.subscribe(
            topic, take, type, decode=view, encoding=encoding, queue_length=100
        )
    bridge.start(asyncio.get_running_loop())
    await meter.wait()
    await bridge.stop()
    return got


async def listen_bare(link: str, url: str, meter: Meter) -> Times:
    """Receive the same frames with websockets alone."""
    found: list[tuple[float, Any]] = []
    topics: dict[int, str] = {}

    async def receive() -> None:
        async for frame in socket:
            if link != "cdr" or frame[0] == 1:
                found.append((meter.count(), frame))

    is_foxglove = link == "cdr"
    async with connect(
        url.replace("foxglove", "ws", 1),
        compression=None,
        max_size=None,
        subprotocols=["foxglove.sdk.v1"] if is_foxglove else None,  # type: ignore[list-item]
    ) as socket:
        if is_foxglove:
            await subscribe_foxglove(socket, topics)
        else:
            for topic, (type, *_) in TOPICS.items():
                await socket.send(ops.subscribe(topic, id=topic, type=type), text=True)
        receiving = asyncio.create_task(receive())
        await meter.wait()
        receiving.cancel()
    got: Times = {topic: {} for topic in TOPICS}
    for at, frame in found:
        topic, message = opened(link, frame, topics)
        header = message.get("transforms", [message])[0]["header"]
        stamp = header["stamp"]
        got[topic][stamp.get("secs", stamp.get("sec")) - FIRST] = at
    return got


async def subscribe_foxglove(socket: Any, topics: dict[int, str]) -> None:
    """Subscribe to all channels, and note their topics by the subscription."""
    while len(topics) < len(TOPICS):
        message = json.loads(await socket.recv())
        if message["op"] != "advertise":
            continue
        for channel in message["channels"]:
            topics[len(topics) + 1] = channel["topic"]
            subscription = {"id": len(topics), "channelId": channel["id"]}
            request = {"op": "subscribe", "subscriptions": [subscription]}
            await socket.send(json.dumps(request))


def opened(
    link: str, frame: bytes, topics: dict[int, str]
) -> tuple[str, dict[str, Any]]:
    """Return the topic and the message of a frame, as dicts."""
    if link == "cdr":
        topic = topics[int.from_bytes(frame[1:5], "little")]
        schema = read_schema(TOPICS[topic][0], "ros2msg")
        return topic, make_reader(schema, None, "cdr")(frame[HEAD:])
    publish = cbor2.loads(frame) if link == "cbor" else json.loads(frame)
    return publish["topic"], publish["msg"]


async def main(client: str, link: str, url: str, seconds: float) -> None:
    """Receive the messages with one client and print the figures."""
    meter = Meter(seconds)
    receive = listen if client == "webmap" else listen_bare
    got = await receive(link, url, meter)
    counted = {
        topic: {
            number: at
            for number, at in times.items()
            if number >= TOPICS[topic][2] * WARM
        }
        for topic, times in got.items()
    }
    print(json.dumps({"cpu": meter.cpu, "got": counted}), flush=True)


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], sys.argv[2], sys.argv[3], float(sys.argv[4])))
