"""The simulator as a process: the world's clock and the server in one loop."""

import asyncio
import contextlib
import logging
import signal
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from webmap.base.errors import ConfigError
from webmap.base.processes import end_with_parent, why_not_listening

if TYPE_CHECKING:
    from webmap.sim.node import RobotsNode

log = logging.getLogger("webmap.sim")

_MOST_ROBOTS = 1000


async def run_simulator(
    *,
    robots: int = 2,
    port: int = 0,
    seed: int = 1,
    map: Path | str | None = None,
    dialect: Literal["ros1", "ros2"] = "ros1",
    rosbridge: str | None = None,
    twist: Literal["Twist", "TwistStamped"] = "Twist",
    robot_timeout: float | None = 0.25,
    drift: float = 0.0,
    nan: bool = False,
    quirks: str = "real",
    wander: bool = False,
    errands: int = 0,
    low_battery: bool = False,
    flat: bool = False,
    extras: bool = True,
    tilted: bool = False,
    host: str = "127.0.0.1",
    refuse_nan: bool = True,
    http_camera: int | None = None,
    on_http_camera: Callable[[str], None] | None = None,
    on_ready: Callable[[str], None] | None = None,
    stop: asyncio.Event | None = None,
) -> None:
    """Run a simulator until SIGINT, SIGTERM, or ``stop`` is set.

    Args:
        robots: Number of robots, called ``robot_0`` and so on.
        port: Port to listen on; 0 lets the kernel choose.
        seed: Seed of everything random: the same seed gives the same positions.
        map: A map_server YAML file; None for the floor that comes with the package.
        dialect: The dialect of the server's type names and times.
        rosbridge: The version of rosbridge to behave like, such as ``4.1``, which
            replaces ``dialect`` by its own; None for the usual one of ``dialect``.
        twist: The type of ``cmd_vel``.
        robot_timeout: Command timeout of the bases, in seconds; None for a base that
            never stops by itself.
        drift: Growth of the odometry error, in metres per metre.
        nan: Whether scans and covariances contain some NaN.
        quirks: ``real``, ``polite``, or one of them with changes; see
            :func:`webmap.ros.rosbridge.server.dialect.parse_quirks`.
        wander: Whether robots without commands drive to random places.
        errands: Number of robots that go from station to station on their own, the
            last ones; see :mod:`webmap.sim.navigator`.
        low_battery: Whether the last robot starts with a low battery.
        flat: Whether the only robot has its topics without a prefix: ``/odom``.
        extras: Whether robots have costmaps, clouds, footprints, particles, sonars,
            fixes, markers, diagnostics and logs too. They cost nothing without
            subscribers.
        tilted: Whether their lasers are mounted upside down and, with ``extras``, they
            have a depth camera whose cloud is in its optical frame.
        host: The address to listen on.
        refuse_nan: Whether the bases ignore a twist with NaN or infinity.
        http_camera: Port of the cameras over HTTP, like web_video_server; 0 lets the
            kernel choose, None for no such server.
        on_http_camera: Called with the URL of the first robot's stream, before
            ``on_ready``.
        on_ready: Called with the URL once clients can connect.
        stop: Ends the run when it is set.

    Raises:
        ConfigError: If the map or an option is invalid, a port is in use, or the
            address does not belong to this machine.

    """
    # Slow to import, and not needed to import this module.
    from webmap.ros.rosbridge.server.dialect import Dialect, dialect_of, parse_quirks
    from webmap.ros.rosbridge.server.encode import Encoder
    from webmap.ros.rosbridge.server.graph import Graph
    from webmap.ros.rosbridge.server.rosapi import Rosapi
    from webmap.ros.rosbridge.server.schema import Schema
    from webmap.ros.rosbridge.server.server import RosbridgeServer
    from webmap.sim.maps import FLOOR, load_map
    from webmap.sim.node import IMAGE, RobotsNode
    from webmap.sim.robot import BaseOptions
    from webmap.sim.scanner import ScannerOptions
    from webmap.sim.web_video import WebVideoServer
    from webmap.sim.world import World, WorldOptions

    _check(robots, dialect, twist, robot_timeout)
    if flat and robots != 1:
        raise ConfigError(f"without prefixes there can be one robot only, not {robots}")
    if not 0 <= errands <= robots:
        raise ConfigError(
            f"errands must be from 0 to the number of robots, {robots}, got {errands}"
        )
    if errands and wander:
        raise ConfigError("robots either wander or have errands: give only one of them")
    version = rosbridge or dialect
    dialect = dialect_of(version)
    behaviour = parse_quirks(quirks, version)
    options = WorldOptions(
        robots=robots,
        seed=seed,
        base=BaseOptions(timeout=robot_timeout, drift=drift, refuse_nan=refuse_nan),
        scanner=ScannerOptions(nan=nan),
        wander=wander,
        errands=errands,
        low_battery=low_battery,
        flat=flat,
    )
    world = World(load_map(map or FLOOR), options)
    schema = Schema(Dialect(dialect))
    graph = Graph(schema)
    Rosapi(graph, behaviour).start()
    node = RobotsNode(world, graph, twist, behaviour, extras=extras, tilted=tilted)
    node.start()
    server = RosbridgeServer(graph, Encoder(schema, behaviour))
    stop = stop or asyncio.Event()
    async with contextlib.AsyncExitStack() as running:
        running.enter_context(signals_set(stop))
        if http_camera is not None:
            video = WebVideoServer(graph)
            running.push_async_callback(video.stop)
            with _port_errors_explained(host, http_camera):
                url = await video.start(host, http_camera)
            if on_http_camera:
                topic = f"{world.robots[0].topics}/{IMAGE}"
                on_http_camera(f"{url}/stream?topic={topic}&type=mjpeg")
        running.push_async_callback(server.stop)
        with _port_errors_explained(host, port):
            url = await server.start(host, port)
        if on_ready:
            on_ready(url)
        await _run_clock(node, stop)


@contextlib.contextmanager
def _port_errors_explained(host: str, port: int) -> Iterator[None]:
    """Turn the error of a port that cannot be opened into one sentence."""
    try:
        yield
    except OSError as error:
        raise ConfigError(why_not_listening(host, port, error)) from error


def _check(robots: int, dialect: str, twist: str, robot_timeout: float | None) -> None:
    if not 1 <= robots <= _MOST_ROBOTS:
        raise ConfigError(f"robots must be from 1 to {_MOST_ROBOTS}, got {robots}")
    if dialect not in ("ros1", "ros2"):
        raise ConfigError(f"dialect must be 'ros1' or 'ros2', got {dialect!r}")
    if twist not in ("Twist", "TwistStamped"):
        raise ConfigError(f"twist must be 'Twist' or 'TwistStamped', got {twist!r}")
    if robot_timeout is not None and not robot_timeout > 0:
        raise ConfigError(f"robot_timeout must be above 0, got {robot_timeout}")


async def _run_clock(node: "RobotsNode", stop: asyncio.Event) -> None:
    from webmap.sim.node import STEP

    loop = asyncio.get_running_loop()
    due = loop.time()
    while not stop.is_set():
        node.step()
        due += STEP
        late = loop.time() - due
        if late > 1:
            log.warning("the simulator is %.1f s late: it skips that time", late)
            due = loop.time()
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(max(due - loop.time(), 0)):
                await stop.wait()


@contextlib.contextmanager
def signals_set(stop: asyncio.Event) -> Iterator[None]:
    """Let SIGINT and SIGTERM end the run, if this is the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    loop = asyncio.get_running_loop()
    signals = (signal.SIGINT, signal.SIGTERM)
    before = {number: signal.getsignal(number) for number in signals}
    for number in signals:
        signal.signal(number, lambda *_: loop.call_soon_threadsafe(stop.set))
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def end_with_stdin(stop: asyncio.Event) -> None:
    """Set ``stop`` when standard input ends: the parent process is gone."""
    loop = asyncio.get_running_loop()
    end_with_parent(lambda: loop.call_soon_threadsafe(stop.set))
