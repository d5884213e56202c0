"""Simulators that run beside a test; the test can read and change their worlds."""

import asyncio
import contextlib
import threading
from collections.abc import Iterator
from typing import Any

from webmap.ros.rosbridge.server.dialect import Dialect, dialect_of, parse_quirks
from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.graph import Graph
from webmap.ros.rosbridge.server.rosapi import Rosapi
from webmap.ros.rosbridge.server.schema import Schema
from webmap.ros.rosbridge.server.server import RosbridgeServer
from webmap.sim.maps import FLOOR, load_map
from webmap.sim.node import STEP, RobotsNode
from webmap.sim.robot import BaseOptions
from webmap.sim.world import World, WorldOptions


class Running:
    """A simulator, its world and its last message on each topic.

    Args:
        version: A version of rosbridge, or a dialect for its usual version.
        tilted: Whether the lasers are mounted upside down.

    """

    def __init__(self, version: str, *, tilted: bool = False) -> None:
        quirks = parse_quirks("real", version)
        # Without drift, odometry would be the pose on the map.
        base = BaseOptions(drift=1e-9)
        options = WorldOptions(robots=2, seed=4, base=base)
        self.world = World(load_map(FLOOR), options)
        schema = Schema(Dialect(dialect_of(version)))
        graph = Graph(schema)
        Rosapi(graph, quirks).start()
        self.node = RobotsNode(self.world, graph, "Twist", quirks, tilted=tilted)
        self.published: dict[str, dict[str, Any]] = {}
        publish = self.node.publish

        def publish_and_note(topic: str, message: dict[str, Any]) -> None:
            self.published[topic] = message
            publish(topic, message)

        self.node.publish = publish_and_note
        self.node.start()
        self.server = RosbridgeServer(graph, Encoder(schema, quirks))
        self.url = ""

    async def run(self) -> None:
        self.url = await self.server.start("127.0.0.1", 0)

    def do(self, action) -> None:
        """Change something in the world between two of its steps."""
        done = threading.Event()
        self.loop.call_soon_threadsafe(lambda: (action(), done.set()))
        assert done.wait(10)


@contextlib.contextmanager
def simulators(*versions: str, tilted: bool = False) -> Iterator[dict[str, Running]]:
    """Run a simulator of each version or dialect in a separate thread."""
    found = {version: Running(version, tilted=tilted) for version in versions}
    ready, stop = threading.Event(), threading.Event()

    async def run() -> None:
        for each in found.values():
            each.loop = asyncio.get_running_loop()
            await each.run()
        ready.set()
        due = asyncio.get_running_loop().time()
        while not stop.is_set():
            for each in found.values():
                each.node.step()
            due = max(due + STEP, asyncio.get_running_loop().time() - 1)
            await asyncio.sleep(max(due - asyncio.get_running_loop().time(), 0))
        for each in found.values():
            await each.server.stop()

    thread = threading.Thread(target=lambda: asyncio.run(run()))
    thread.start()
    try:
        assert ready.wait(30)
        yield found
    finally:
        stop.set()
        thread.join(20)
