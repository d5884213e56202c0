"""Sends odometry, scans and frames to two subscribers, as a robot's bridge does.

Run as ``python -m benchmarks.link_server LINK SECONDS``, where LINK is ``json``,
``cbor`` or ``cdr``; prints its address. The first two are a rosbridge, the last one the
server of foxglove-sdk. It starts when both have subscribed to all topics, and prints
the time of each message before it is sent, in seconds of the monotonic clock.
"""

import asyncio
import heapq
import json
import sys
import time
from typing import Any

import foxglove
from foxglove.websocket import ServerListener
from websockets.asyncio.server import ServerConnection, serve

from benchmarks.frames import odometry, scan
from benchmarks.links import as_cbor, as_json, transforms, whole
from webmap.ros.foxglove.messages import included_text
from webmap.ros.serialized.schemas import read_schema
from webmap.ros.serialized.writer import make_writer

TOPICS = {
    "/odom": ("nav_msgs/Odometry", odometry, 50),
    "/scan": ("sensor_msgs/LaserScan", scan, 10),
    "/tf": ("tf2_msgs/TFMessage", transforms, 20),
}
"""The type of each topic, what makes its messages, and how many come in a second."""

FIRST = 1_700_000_000
"""The seconds in the stamp of the first message of a topic; each next has one more."""

SUBSCRIBERS = 2

Times = dict[str, dict[int, float]]
"""When each message was sent or received, by its topic and its number."""


def stamped(message: dict[str, Any], number: int) -> dict[str, Any]:
    """Return a message whose stamps show its number."""
    for each in message.get("transforms", [message]):
        each["header"]["stamp"] = {"secs": FIRST + number, "nsecs": 0}
    return message


def schedule(seconds: float) -> list[tuple[float, str, int]]:
    """Return the time of each message from the start on, its topic and its number."""
    return [
        *heapq.merge(
            *(
                [
                    (number / rate, topic, number)
                    for number in range(int(rate * seconds))
                ]
                for topic, (_, _, rate) in TOPICS.items()
            )
        )
    ]


class Rosbridge:
    """A rosbridge that sends what was subscribed to.

    Args:
        link: ``json`` or ``cbor``, which all subscribers get.

    """

    def __init__(self, link: str) -> None:
        self._packed = as_cbor if link == "cbor" else as_json
        self._links: dict[ServerConnection, set[str]] = {}

    async def start(self) -> str:
        """Listen; return the address."""
        self._server = await serve(self._handle, "127.0.0.1", 0, compression=None)
        return f"ws://127.0.0.1:{next(iter(self._server.sockets)).getsockname()[1]}"

    async def _handle(self, link: ServerConnection) -> None:
        topics = self._links[link] = set()
        async for text in link:
            request = json.loads(text)
            if request["op"] == "subscribe":
                topics.add(request["topic"])

    @property
    def is_ready(self) -> bool:
        """Whether all subscribers are there."""
        return sum(len(each) for each in self._links.values()) == (
            SUBSCRIBERS * len(TOPICS)
        )

    def pack(self, topic: str, message: dict[str, Any]) -> str | bytes:
        """Return the frame of a message."""
        frame = self._packed(message, topic)
        return frame if self._packed is as_cbor else frame.decode()

    async def send(self, topic: str, frame: str | bytes) -> None:
        """Send a frame to all; each time another one is the first."""
        links = [*self._links.items()]
        self._links = dict(links[1:] + links[:1])
        for link, _ in links:
            await link.send(frame)


class Foxglove(ServerListener):
    """The server of foxglove-sdk."""

    def __init__(self) -> None:
        self._subscribed = 0
        self._channels: dict[str, Any] = {}
        self._writers: dict[str, Any] = {}
        self._context = context = foxglove.Context()  # it ends with the last reference
        for topic, (type, _, _) in TOPICS.items():
            schema = foxglove.Schema(
                name=type.replace("/", "/msg/"),
                encoding="ros2msg",
                data=included_text(type, ros2=True).encode(),
            )
            self._channels[topic] = foxglove.Channel(
                topic, message_encoding="cdr", schema=schema, context=context
            )
            self._writers[topic] = make_writer(read_schema(type, "ros2msg"), "cdr")
        self._server = foxglove.start_server(
            name="robot", port=0, server_listener=self, context=context
        )

    async def start(self) -> str:
        """Return the address."""
        return f"foxglove://127.0.0.1:{self._server.port}"

    def on_subscribe(self, client: object, channel: object) -> None:
        """Count a subscription."""
        self._subscribed += 1

    @property
    def is_ready(self) -> bool:
        """Whether all subscribers are there."""
        return self._subscribed == SUBSCRIBERS * len(TOPICS)

    def pack(self, topic: str, message: dict[str, Any]) -> bytes:
        """Return the CDR of a message."""
        data: bytes = self._writers[topic](whole(message, "cdr"))
        return data

    async def send(self, topic: str, frame: bytes) -> None:
        """Give a message to the server, which sends it in a thread of its own."""
        self._channels[topic].log(frame)


async def main(link: str, seconds: float) -> None:
    """Send all messages at their times; then wait to be killed."""
    server: Any = Foxglove() if link == "cdr" else Rosbridge(link)
    plan = [
        (
            due,
            topic,
            number,
            server.pack(topic, stamped(TOPICS[topic][1](number), number)),
        )
        for due, topic, number in schedule(seconds)
    ]
    print(await server.start(), flush=True)
    while not server.is_ready:  # noqa: ASYNC110 (another thread counts)
        await asyncio.sleep(0.05)
    sent: Times = {topic: {} for topic in TOPICS}
    begun = time.monotonic() + 0.5
    for due, topic, number, frame in plan:
        await asyncio.sleep(max(0.0, begun + due - time.monotonic()))
        sent[topic][number] = time.monotonic()
        await server.send(topic, frame)
    print(json.dumps(sent), flush=True)
    await asyncio.sleep(60)


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], float(sys.argv[2])))
