"""A display of one map, without pages; it reports the cost of the map and its changes.

Run as ``python -m benchmarks.map_reader SIDE ORDER COUNT``; prints JSON. It sends
each order to the map server when it has drawn the change before.
"""

import asyncio
import json
import subprocess
import sys
import time
from typing import Any

import psutil

from webmap import Bridge
from webmap.core.pictures import pictures
from webmap.features.layers.occupancy_grid import OccupancyGrid


class Blocks:
    """The longest callback of an event loop, by this thread's processor time."""

    def __init__(self) -> None:
        self.longest = 0.0
        run = asyncio.events.Handle._run

        def measured(handle: asyncio.Handle) -> None:
            began = time.thread_time()
            run(handle)
            self.longest = max(self.longest, time.thread_time() - began)

        setattr(asyncio.events.Handle, "_run", measured)  # noqa: B010


def used() -> float:
    """Return the processor time of this process and of its decoder, in seconds."""
    own = psutil.Process()
    decoders = [p for p in own.children() if "webmap.ros.worker" in p.cmdline()]
    times = [process.cpu_times() for process in (own, *decoders)]
    return sum(float(each.user + each.system) for each in times)


async def measure(url: str, give: Any, order: str, count: int) -> dict[str, float]:
    """Show the map, send the orders one after the other, and return the figures."""
    published: list[tuple[float, int]] = []
    publish = pictures.publish

    def counted(data: bytes, *args: Any, **options: Any) -> str:
        published.append((time.monotonic(), len(data)))
        return publish(data, *args, **options)

    pictures.publish = counted  # type: ignore[method-assign]
    bridge, blocks = Bridge(url), Blocks()
    layer = OccupancyGrid._made(bridge, "/map")
    with layer.scope.active():
        layer.start()
    began = time.monotonic()
    bridge.start(asyncio.get_running_loop())

    async def drawn() -> float:
        """Wait until all pictures are published; return the time of the last one."""
        while not published or layer.tiles.is_drawing:  # noqa: ASYNC110
            await asyncio.sleep(0.005)
        return published[-1][0]

    first = await drawn() - began
    blocked, whole = blocks.longest, sum(size for _, size in published)
    blocks.longest, before, took, sent = 0.0, used(), 0.0, 0
    for _ in range(count):
        published.clear()
        began = time.monotonic()
        give(order)
        took += await drawn() - began
        sent += sum(size for _, size in published)
    spent = used() - before
    await bridge.stop()
    return {
        "time to the first picture of the whole map (ms)": first * 1000,
        "bytes of the whole map (kB)": whole / 1000,
        "longest callback until then (ms)": blocked * 1000,
        "time of a change (ms)": took / count * 1000,
        "cpu of a change (ms)": spent / count * 1000,
        "bytes of a change (kB)": sent / count / 1000,
        "longest callback of a change (ms)": blocks.longest * 1000,
    }


def main(side: str, order: str, count: int) -> None:
    """Start the map server, measure, and print the figures."""
    with subprocess.Popen(
        [sys.executable, "-m", "benchmarks.map_server", side],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as server:
        assert server.stdin is not None
        assert server.stdout is not None
        url = server.stdout.readline().strip()

        def give(line: str) -> None:
            assert server.stdin is not None
            print(line, file=server.stdin, flush=True)

        print(json.dumps(asyncio.run(measure(url, give, order, count))), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]))
