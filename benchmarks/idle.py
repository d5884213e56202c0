"""The processor time of the gate for robots that nobody drives.

First, many robots have one rosbridge: the gate has three connections for any number of
robots, so this shows the work for each robot. Then each robot has a separate rosbridge:
the gate pings each connection. The reference is bare connections of the ``websockets``
package with as many pings.
"""

import asyncio
import os
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack

import psutil
from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import ServerConnection, serve

from benchmarks.harness import Comparison, Contender, Figures, compare
from benchmarks.processes import module
from webmap.config.motion import MoveConfig, TwistConfig
from webmap.gate.display.client import GateClient
from webmap.gate.protocol import Report, RobotReport, RobotSpec

MANY = 1000
"""Robots of one rosbridge."""

BRIDGES = 100
"""Robots, each with a separate rosbridge."""

PINGS = (0.5, 1.0, 1.0)
"""Seconds between pings on the gate's lanes: control, odometry and tasks."""

PATIENCE = 60.0
"""Seconds after which all connections must be open."""


async def _serve() -> None:
    """Print the port, accept all messages and send none."""

    async def handle(link: ServerConnection) -> None:
        async for _ in link:
            pass

    keep = {"compression": None, "ping_interval": None}
    async with serve(handle, "127.0.0.1", 0, **keep) as server:  # type: ignore[arg-type]
        print(next(iter(server.sockets)).getsockname()[1], flush=True)
        await server.serve_forever()


async def _ping(link: ClientConnection, period: float) -> None:
    while True:
        await (await link.ping())
        await asyncio.sleep(period)


async def _connect(port: str, robots: int) -> None:
    """Open three connections for each robot, print a line, and ping them."""
    address = f"ws://127.0.0.1:{port}"
    pinging = []
    for _ in range(robots):
        for period in PINGS:
            link = await connect(address, compression=None, ping_interval=None)
            pinging.append(asyncio.create_task(_ping(link, period)))
    print("open", flush=True)
    await asyncio.gather(*pinging)


def _running(
    *arguments: object,
) -> AbstractContextManager[tuple[str, psutil.Process]]:
    """Run a part of this module; yield its first line and its process."""
    return module("benchmarks.idle", *arguments)


def _measured(process: psutil.Process, seconds: float) -> Figures:
    before = sum(process.cpu_times()[:2])
    time.sleep(seconds)
    used = sum(process.cpu_times()[:2]) - before
    return {"cpu (% of a core)": 100 * used / seconds}


def _spec(number: int, url: str) -> RobotSpec:
    return RobotSpec(
        id=f"robot {number}",
        name=f"robot {number}",
        twist=TwistConfig(topic=f"/robot_{number}/cmd_vel", bridge=url),
        odometry_topic=f"/robot_{number}/odom",
        move=MoveConfig(
            topic=f"/robot_{number}/goal",
            cancel_topic=f"/robot_{number}/cancel",
            bridge=url,
        ),
    )


def gate_with(robots: int, seconds: float, *, apart: bool) -> Callable[[], Figures]:
    """Return a run of the gate with idle robots.

    Args:
        robots: The number of robots.
        seconds: The duration of the measurement.
        apart: Whether each robot has a separate rosbridge.

    """

    def run() -> Figures:
        with ExitStack() as running:
            folder = running.enter_context(tempfile.TemporaryDirectory())
            os.environ["WEBMAP_STATE_DIR"] = folder
            port, _ = running.enter_context(_running("serve"))
            up: set[str] = set()
            all_up = threading.Event()

            def note(report: Report) -> None:
                if isinstance(report, RobotReport) and report.link == "up":
                    up.add(report.robot)
                    if len(up) == robots:
                        all_up.set()

            client = GateClient()
            client.on_report(note)
            client.start()
            running.callback(client.stop)
            for number in range(robots):
                path = f"/{number}" if apart else ""
                client.declare(_spec(number, f"ws://127.0.0.1:{port}{path}"))
            if not all_up.wait(PATIENCE):
                raise RuntimeError(f"only {len(up)} of {robots} robots are connected")
            time.sleep(2.0)
            assert client.pid is not None
            return _measured(psutil.Process(client.pid), seconds)

    return run


def bare(robots: int, seconds: float) -> Callable[[], Figures]:
    """Return a run of as many connections as the gate has for these robots."""

    def run() -> Figures:
        with ExitStack() as running:
            port, _ = running.enter_context(_running("serve"))
            _, process = running.enter_context(_running("connect", port, robots))
            time.sleep(2.0)
            return _measured(process, seconds)

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare many idle robots with one, and the gate with bare connections."""
    seconds = 2.0 if quick else 5.0
    many = [
        Contender(f"{robots} robots", gate_with(robots, seconds, apart=False))
        for robots in (1, MANY)
    ]
    apart = [
        Contender("bare connections", bare(BRIDGES, seconds)),
        Contender("the gate", gate_with(BRIDGES, seconds, apart=True)),
    ]
    return [
        compare("Idle robots of one rosbridge", many, rounds),
        compare(f"{BRIDGES} idle robots with a rosbridge each", apart, rounds),
    ]


if __name__ == "__main__":
    if sys.argv[1] == "serve":
        asyncio.run(_serve())
    else:
        asyncio.run(_connect(sys.argv[2], int(sys.argv[3])))
