"""A rosbridge with robots that publish their frames and nothing else."""

import asyncio
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from webmap.base.geometry import Pose, Quaternion
from webmap.ros.rosbridge.server.dialect import Dialect, parse_quirks
from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.graph import Graph
from webmap.ros.rosbridge.server.rosapi import Rosapi
from webmap.ros.rosbridge.server.schema import Schema
from webmap.ros.rosbridge.server.server import RosbridgeServer

TF = "tf2_msgs/TFMessage"

Chain = list[tuple[str, str, Pose]]
"""Transforms: parent, child, and where the child is in the parent."""


@contextmanager
def publishing(
    received: Mapping[str, Chain],
    dialect: str = "ros1",
    extra: Mapping[str, str] = {},
    odometry: Mapping[str, str] = {},
) -> Iterator[str]:
    """Publish frames on topics 20 times a second; yield the address.

    Args:
        received: The transforms that are published on each topic.
        dialect: ``ros1`` or ``ros2``.
        extra: The types of further topics, by name; nothing is published on them.
        odometry: The ``child_frame_id`` of the odometry on each further topic.

    """
    urls: list[str] = []
    ready, over = threading.Event(), threading.Event()

    async def serve() -> None:
        schema = Schema(Dialect(dialect))
        graph = Graph(schema)
        quirks = parse_quirks("real", dialect)
        Rosapi(graph, quirks).start()
        node = object()
        for topic in received:
            graph.advertise(node, topic, TF, node="/robots", latch=False)
        kinds = {**extra, **dict.fromkeys(odometry, "nav_msgs/Odometry")}
        for topic, kind in kinds.items():
            graph.advertise(node, topic, kind, node="/robots", latch=False)
        server = RosbridgeServer(graph, Encoder(schema, quirks))
        urls.append(await server.start("127.0.0.1", 0))
        ready.set()
        while not over.is_set():
            for topic, chain in received.items():
                message = {"transforms": [_transform(graph, topic, *t) for t in chain]}
                graph.publish(node, topic, message)
            for topic, frame in odometry.items():
                graph.publish(node, topic, {"child_frame_id": frame})
            await asyncio.sleep(0.05)
        await server.stop()

    thread = threading.Thread(target=lambda: asyncio.run(serve()))
    thread.start()
    try:
        assert ready.wait(10)
        yield urls[0]
    finally:
        over.set()
        thread.join(10)


def _transform(graph: Graph, topic: str, parent: str, child: str, at: Pose) -> dict:
    turn = Quaternion.from_yaw(at.yaw)
    return {
        "header": graph.schema.dialect.header(topic, graph.clock(), parent),
        "child_frame_id": child,
        "transform": {
            "translation": {"x": at.x, "y": at.y, "z": 0.0},
            "rotation": {"x": turn.x, "y": turn.y, "z": turn.z, "w": turn.w},
        },
    }
