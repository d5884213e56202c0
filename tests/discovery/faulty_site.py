"""A simulated ROS system in this process, with faults that a robot may have."""

import asyncio
import contextlib
import time

import numpy as np

from webmap.ros.rosbridge.server.dialect import Dialect, parse_quirks
from webmap.ros.rosbridge.server.encode import MAX_MESSAGE_SIZE, Encoder
from webmap.ros.rosbridge.server.graph import Graph
from webmap.ros.rosbridge.server.rosapi import Rosapi
from webmap.ros.rosbridge.server.schema import Schema
from webmap.ros.rosbridge.server.server import RosbridgeServer
from webmap.sim.maps import FREE, FloorPlan
from webmap.sim.node import STEP, RobotsNode
from webmap.sim.world import World, WorldOptions


class Watched(Graph):
    """A graph that records the calls it receives and drops chosen messages."""

    def __init__(self, schema, clock, change):
        super().__init__(schema, clock=clock)
        self.change = change
        self.called = []
        self.advertised = []

    def call(self, service, *arguments, **named):
        self.called.append(service)
        return super().call(service, *arguments, **named)

    def advertise(self, owner, name, type_name, **named):
        self.advertised.append(name)
        super().advertise(owner, name, type_name, **named)

    def publish(self, owner, name, message):
        changed = self.change(name, message)
        if changed is not None:
            super().publish(owner, name, changed)


class Site:
    """The system, its server, and the calls that they received."""

    def __init__(self, graph, server, url):
        self.graph, self.server, self.url = graph, server, url

    @property
    def called(self):
        return self.graph.called


@contextlib.asynccontextmanager
async def site(
    dialect="ros1",
    *,
    quirks="real",
    ahead=0.0,
    change=lambda name, message: message,
    rosapi=True,
    twist="Twist",
    limit=MAX_MESSAGE_SIZE,
):
    """Run a system with one robot, ``robot_0``.

    Args:
        dialect: ``ros1`` or ``ros2``.
        quirks: The quirks of the server.
        ahead: Seconds by which the robot's clock is ahead of this machine's.
        change: Takes a topic and a message; returns the message, or None to drop it.
        rosapi: Whether the system has rosapi.
        twist: The type of velocity.
        limit: The server's ``max_message_size``.

    """
    behaviour = parse_quirks(quirks, dialect)
    schema = Schema(Dialect(dialect))
    graph = Watched(schema, lambda: time.time() + ahead, change)
    if rosapi:
        Rosapi(graph, behaviour).start()
    plan = FloorPlan(np.full((100, 100), FREE, np.int8), 0.1, 0.0, 0.0)
    node = RobotsNode(
        World(plan, WorldOptions(robots=1)), graph, twist, behaviour, extras=False
    )
    node.start()
    graph.advertised.clear()
    server = RosbridgeServer(graph, Encoder(schema, behaviour, limit))

    async def turn():
        while True:
            node.step()
            await asyncio.sleep(STEP)

    url = await server.start("127.0.0.1", 0)
    clock = asyncio.create_task(turn())
    try:
        yield Site(graph, server, url)
    finally:
        clock.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await clock
        await server.stop()
