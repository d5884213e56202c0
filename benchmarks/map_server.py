"""A rosbridge with one map, which publishes updates of it on request.

Run as ``python -m benchmarks.map_server SIDE``; prints its address. Each line on its
standard input is an order: ``map`` publishes the whole map again with one changed cell,
``update`` publishes a changed square of :data:`CHANGED` cells.
"""

import asyncio
import sys
import time

import numpy as np

from webmap.ros.rosbridge.server.dialect import Dialect, parse_quirks
from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.graph import Graph
from webmap.ros.rosbridge.server.schema import Schema
from webmap.ros.rosbridge.server.server import RosbridgeServer
from webmap.sim.messages import Messages

CHANGED = 100
"""The side of an update, in cells."""


def rooms(side: int) -> "np.ndarray":
    """Return a floor of rooms with uneven walls, and a margin that is unknown."""
    random = np.random.default_rng(5)
    cells = np.zeros((side, side), np.int8)
    for wall in range(0, side, 97):
        cells[wall : wall + 3], cells[:, wall : wall + 3] = 100, 100
    cells[random.random((side, side)) < 0.01] = 60
    edge = side // 10
    cells[:edge], cells[-edge:], cells[:, :edge], cells[:, -edge:] = -1, -1, -1, -1
    return cells


async def serve(side: int) -> None:
    """Follow the orders on standard input until it ends."""
    schema, quirks = Schema(Dialect("ros1")), parse_quirks("real", "ros1")
    graph, node = Graph(schema), object()
    server = RosbridgeServer(graph, Encoder(schema, quirks))
    graph.advertise(node, "/map", "nav_msgs/OccupancyGrid", latch=True)
    graph.advertise(node, "/map_updates", "map_msgs/OccupancyGridUpdate")
    messages, cells = Messages(Dialect("ros1")), rooms(side)

    def publish_map() -> None:
        message = messages.cells("/map", time.time(), "map", cells, 0.05, (0.0, 0.0))
        graph.publish(node, "/map", message)

    publish_map()
    print(await server.start("127.0.0.1", 0), flush=True)
    loop, number = asyncio.get_running_loop(), 0
    while order := (await loop.run_in_executor(None, sys.stdin.readline)).strip():
        number += 1
        if order == "map":
            cells[side // 2, side // 2] = number % 100
            publish_map()
            continue
        at = side // 2 + 7 * number % (side // 4)
        patch = np.full((CHANGED, CHANGED), number % 100, np.int8)
        square = {"x": at, "y": at, "width": CHANGED, "height": CHANGED}
        header = {"frame_id": "map"}
        update = {"header": header, **square, "data": patch.ravel().tolist()}
        kind = "map_msgs/OccupancyGridUpdate"
        update = graph.conform(kind, update, finite=True)
        graph.publish(node, "/map_updates", update)
    await server.stop()


if __name__ == "__main__":
    asyncio.run(serve(int(sys.argv[1])))
