"""The cost of displays and viewers for an agent, and the bytes on its uplink.

The agent has simulated robots with scans, and one or several displays: processes that
draw nothing (``far_display.py``). A line between agent and router counts all bytes: of
data, ticks and everything else. They are compared with the bytes of rosbridge in JSON,
for a client that subscribes to the same topics at the same rates. Figures are for each
message of a topic, because a busy machine produces fewer messages.

A real display that shows the robots to a viewer first gives the list of subscriptions.
"""

import asyncio
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field

import psutil
from websockets.asyncio.client import connect
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from benchmarks.harness import Comparison, Contender, Figures, compare
from benchmarks.line import Line
from benchmarks.processes import started, used
from webmap.agents.peer import Peer
from webmap.agents.router_access import RouterUser
from webmap.base.tasks import LoopThread

ROBOTS = 20
SHAPES = ((1, 1), (4, 1), (4, 50))
"""Numbers of displays, and of viewers of each display."""

SLOW = 2.0
"""Scans a second of each robot if ``--rate`` limits them."""

MESSAGES = "messages of topics (a second)"
BYTES = "bytes on the uplink (bytes a message)"
CPU = "cpu of the agent (us a message)"


@dataclass
class Scene:
    """The subscriptions of an agent at its rosbridge to show its robots."""

    subscriptions: list[dict[str, object]] = field(default_factory=list)

    @property
    def scans(self) -> list[str]:
        """The topics of scans."""
        types = ("sensor_msgs/LaserScan", "sensor_msgs/msg/LaserScan")
        return [str(op["topic"]) for op in self.subscriptions if op["type"] in types]

    def note(self, frame: str | bytes) -> None:
        """Record an operation of a client."""
        op = json.loads(frame)
        if str(op.get("id", "")).startswith("agent-") and op["op"] == "subscribe":
            kept = [each for each in self.subscriptions if each["topic"] != op["topic"]]
            self.subscriptions = [*kept, op]


def watched_scene() -> Scene:
    """Return the subscriptions of an agent for a display with a viewer."""
    scene = Scene()
    thread = LoopThread("listening")
    with ExitStack() as running:
        running.callback(thread.end)
        url, _ = running.enter_context(started(*_simulator()))

        async def pass_on(near: ServerConnection) -> None:
            async with connect(url, compression=None, max_size=None) as far:

                async def back() -> None:
                    async for frame in far:
                        await near.send(frame)

                task = asyncio.create_task(back())
                with suppress(ConnectionClosed):
                    async for frame in near:
                        scene.note(frame)
                        await far.send(frame)
                task.cancel()

        async def listen() -> int:
            server = await serve(pass_on, "127.0.0.1", 0, compression=None)
            port: int = next(iter(server.sockets)).getsockname()[1]
            return port

        near = f"ws://127.0.0.1:{thread.call(listen())}"
        router, _ = running.enter_context(started(*_router()))
        _agent(running, near, router, [])
        view = ("view", router, "--port", 0, "--no-browser")
        folder = running.enter_context(tempfile.TemporaryDirectory())
        page, _ = running.enter_context(started(*view, state=folder))
        _start(running, "benchmarks.watchers", page, "1", "5")
        time.sleep(3.0)
    if not scene.subscriptions:
        raise RuntimeError("the agent subscribed to nothing")
    return scene


def _simulator() -> tuple[object, ...]:
    return ("sim", "--robots", ROBOTS, "--port", 0, "--no-extras")


def _router() -> tuple[object, ...]:
    return ("router", "--listen", "tcp/127.0.0.1:0")


def _agent(
    running: ExitStack, bridge: str, router: str, options: list[object]
) -> psutil.Process:
    """Start an agent; return its process."""
    folder = running.enter_context(tempfile.TemporaryDirectory())
    named = ("--router", router, "--name", "bay3", *options)
    return running.enter_context(started("agent", bridge, *named, state=folder))[1]


def _start(running: ExitStack, *module: str, text: str = "") -> None:
    """Run a module of the benchmarks until it is ready, and end it afterwards."""
    process = running.enter_context(
        subprocess.Popen(
            [sys.executable, "-m", *module],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
    )
    running.callback(process.terminate)
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write(text + "\n")
    process.stdin.flush()
    if process.stdout.readline().strip() != "ready":
        raise RuntimeError(f"{module[0]} got no message")


def watched_by(
    displays: int,
    pages: int,
    scene: Scene,
    seconds: float,
    options: Sequence[object] = (),
) -> Callable[[], Figures]:
    """Return a run with a number of displays, of pages of each, and agent options."""

    def run() -> Figures:
        with ExitStack() as running:
            url, _ = running.enter_context(started(*_simulator()))
            router, _ = running.enter_context(started(*_router()))
            line = running.enter_context(Line(int(router.rpartition(":")[2])))
            agent = _agent(
                running, url, f"zenoh://127.0.0.1:{line.port}", list(options)
            )
            for _ in range(displays):
                _start(
                    running,
                    "benchmarks.far_display",
                    f"{router}/bay3",
                    str(pages),
                    text=json.dumps(scene.subscriptions),
                )
            counted = 0

            def count(_key: str, _piece: bytes) -> None:
                nonlocal counted
                counted += 1

            peer = Peer(router, RouterUser())
            running.callback(peer.close)
            peer.start()
            peer.listen("webmap/bay3/topics/**", count)
            time.sleep(3.0)
            before, sent, already = used(agent), line.up.bytes, counted
            begun = time.monotonic()
            time.sleep(seconds)
            took = time.monotonic() - begun
            spent, sent = used(agent) - before, line.up.bytes - sent
            messages = counted - already
        return {
            MESSAGES: messages / took,
            BYTES: sent / messages,
            CPU: 1e6 * spent / messages,
        }

    return run


def in_json(scene: Scene, seconds: float) -> Callable[[], Figures]:
    """Return a run of one client of the rosbridge, in JSON and without an agent."""

    async def listen(url: str, subscriptions: list[dict[str, object]]) -> Figures:
        async with connect(url, compression=None, max_size=None) as link:
            for op in subscriptions:
                await link.send(json.dumps({**op, "compression": "none"}))
            received = count = 0
            with suppress(TimeoutError):
                async with asyncio.timeout(2.0):
                    async for _ in link:
                        pass
            begun = time.monotonic()
            with suppress(TimeoutError):
                async with asyncio.timeout(seconds):
                    async for frame in link:
                        received += len(frame)
                        count += 1
            took = time.monotonic() - begun
        return {MESSAGES: count / took, BYTES: received / count}

    def run() -> Figures:
        with started(*_simulator()) as (url, _):
            return asyncio.run(listen(url, scene.subscriptions))

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare one display and viewer with several, and with rosbridge in JSON."""
    seconds = 2.0 if quick else 3.0
    scene = watched_scene()
    thinned: list[object] = []
    for topic in scene.scans:
        thinned += ["--rate", f"{topic}={SLOW:g}"]
    shapes = [
        Contender(
            f"{displays} displays, {pages} viewers each",
            watched_by(displays, pages, scene, seconds),
        )
        for displays, pages in (SHAPES[:2] if quick else SHAPES)
    ]
    ways = [
        Contender("rosbridge, JSON", in_json(scene, seconds)),
        Contender("agent", watched_by(1, 1, scene, seconds)),
        Contender(
            f"agent, scans at {SLOW:g} Hz", watched_by(1, 1, scene, seconds, thinned)
        ),
    ]
    return [
        compare(f"an agent with {ROBOTS} robots", shapes, rounds),
        compare(f"the uplink of {ROBOTS} robots", ways, rounds),
    ]
