"""A simulated bridge that hangs for ever when a client leaves a queue of messages."""

import asyncio
import contextlib
from importlib.resources import files

from websockets.asyncio.client import connect

from webmap.ros.definitions import split_texts
from webmap.ros.rosbridge.server.dialect import Dialect, parse_quirks
from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.graph import Graph
from webmap.ros.rosbridge.server.rosapi import Rosapi
from webmap.ros.rosbridge.server.schema import Schema
from webmap.ros.rosbridge.server.server import RosbridgeServer


class HangingBridge:
    """Publishes on each topic every 10 ms, so a message is always in transit."""

    def __init__(self, dialect, types):
        quirks = parse_quirks("real,spinning_queue", dialect)
        schema = Schema(Dialect(dialect))
        # The types of move_base exist in ROS 1 only. Here also a bridge of ROS 2 has
        # them, so that the tests can send the same goals to both.
        move_base = files("webmap.ros").joinpath("msg/move_base_msgs.msg")
        schema.define(split_texts(move_base.read_text("utf-8"), ros2=False))
        self.graph = Graph(schema)
        Rosapi(self.graph, quirks).start()
        self.types = types
        self.server = RosbridgeServer(self.graph, Encoder(schema, quirks))
        self.url = ""

    async def publish(self):
        for topic, type in self.types.items():
            self.graph.advertise(self, topic, type)
        while True:
            for topic, type in self.types.items():
                self.graph.publish(
                    self, topic, self.graph.conform(type, {}, finite=True)
                )
            await asyncio.sleep(0.01)

    @property
    def clients(self):
        return len(self.server.sessions)

    def reset_all(self):
        """Abort every socket without a close frame, as a network failure does."""
        for connection in list(self.server._server.connections):
            connection.transport.abort()

    async def accepts_client(self):
        """Return whether a new client can connect."""
        try:
            async with connect(self.url, open_timeout=3, proxy=None):
                return True
        except TimeoutError:
            return False


@contextlib.asynccontextmanager
async def hanging_bridge(dialect, types):
    """Run such a bridge in this loop.

    Args:
        dialect: ``ros1`` or ``ros2``.
        types: The type of each topic.

    """
    bridge = HangingBridge(dialect, types)
    bridge.url = await bridge.server.start("127.0.0.1", 0)
    publishing = asyncio.create_task(bridge.publish())
    try:
        yield bridge
    finally:
        publishing.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await publishing
        await bridge.server.stop()
