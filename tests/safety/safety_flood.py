"""Ten robots with scans, and a map of 16 million cells that is published repeatedly.

It is a separate process with two rosbridge servers. It prints their addresses, and ends
when standard input ends.
"""

import asyncio
import time

import numpy as np

from webmap.ros.rosbridge.server.dialect import Dialect, parse_quirks
from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.graph import Graph
from webmap.ros.rosbridge.server.schema import Schema
from webmap.ros.rosbridge.server.server import RosbridgeServer
from webmap.sim import run_simulator
from webmap.sim.messages import Messages
from webmap.sim.process import end_with_stdin

ROBOTS = 10
SIDE = 4000
"""Number of cells along a side of the map."""

EVERY = 2.0
"""Seconds between two maps."""


async def send_maps(stop: asyncio.Event) -> None:
    """Publish the map again and again, each time with other cells."""
    schema, quirks = Schema(Dialect("ros1")), parse_quirks("real", "ros1")
    graph, node = Graph(schema), object()
    server = RosbridgeServer(graph, Encoder(schema, quirks))
    graph.advertise(node, "/huge", "nav_msgs/OccupancyGrid", node="/map_server")
    messages = Messages(Dialect("ros1"))
    cells = np.zeros((SIDE, SIDE), np.int8)
    cells[::97], cells[:, ::113], cells[: SIDE // 8] = 100, 100, -1
    print(f"maps at {await server.start('127.0.0.1', 0)}", flush=True)
    while not stop.is_set():
        cells = np.roll(cells, 1, axis=0)  # the display must draw every tile again
        now = time.time()
        message = messages.cells("/huge", now, "map", cells, 0.05, (0.0, 0.0))
        graph.publish(node, "/huge", message)
        try:
            async with asyncio.timeout(EVERY):
                await stop.wait()
        except TimeoutError:
            continue
    await server.stop()


async def main() -> None:
    """Run both servers until standard input ends."""
    stop = asyncio.Event()
    end_with_stdin(stop)

    def ready(url: str) -> None:
        print(f"robots at {url}", flush=True)

    robots = run_simulator(robots=ROBOTS, wander=True, on_ready=ready, stop=stop)
    await asyncio.gather(robots, send_maps(stop))


if __name__ == "__main__":
    asyncio.run(main())
