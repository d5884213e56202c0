"""``webmap demo``: the simulator, a bad link or agents, and the console."""

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from importlib import import_module
from importlib.resources import as_file, files
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

import click

from webmap.base.echo import echo
from webmap.base.errors import ConfigError
from webmap.base.processes import GRACE, child_process
from webmap.cli.demo_robots import FREE, demo_robot
from webmap.cli.options import PORT, Finite, simulator_options, together, web_options

if TYPE_CHECKING:
    from webmap import Bridge
    from webmap.console.console import Console
    from webmap.testing.fault_proxy import FaultProxy


STALL_EVERY = 20.0
"""Seconds from the start of a stall to the start of the next one."""

LONGEST_DELAY = 5000.0
"""Greatest delay and greatest jitter, in milliseconds."""

LONGEST_STALL = 10.0
"""Greatest length of a stall, in seconds."""


bad_link_options = together(
    click.option(
        "--stall",
        type=Finite(0.0, LONGEST_STALL),
        default=0.0,
        metavar="SECONDS",
        help=f"Every {STALL_EVERY:g} s, let the link to the robots carry nothing "
        f"for this long; at most {LONGEST_STALL:g}.",
    ),
    click.option(
        "--jitter",
        type=Finite(0.0, LONGEST_DELAY),
        default=0.0,
        metavar="MS",
        help="Delay messages by up to this many milliseconds more, at random.",
    ),
    click.option(
        "--delay",
        type=Finite(0.0, LONGEST_DELAY),
        default=0.0,
        metavar="MS",
        help="Delay the link to the robots by this many milliseconds each way.",
    ),
)
"""The options ``--delay``, ``--jitter`` and ``--stall``."""


@contextmanager
def bad_link(url: str, delay: float, jitter: float, stall: float) -> Iterator[str]:
    """Yield the address of a bad link to a server; its own address without faults.

    Args:
        url: Address of the server, on the loopback address.
        delay: Milliseconds by which every byte is delayed, each way.
        jitter: Most milliseconds that are added to the delay at random.
        stall: Seconds for which the link carries nothing, every ``STALL_EVERY``
            seconds.

    """
    port = urlsplit(url).port
    if port is None or not (delay or jitter or stall):
        yield url
        return
    from webmap.testing.fault_proxy import FaultProxy, Shape

    with FaultProxy(port) as proxy:
        proxy.shape(Shape(latency=delay / 1000, jitter=jitter / 1000))
        with _stalls(proxy, stall):
            yield f"ws://127.0.0.1:{proxy.port}"


@contextmanager
def _stalls(proxy: "FaultProxy", seconds: float) -> Iterator[None]:
    """Stall a link every ``STALL_EVERY`` seconds until the block ends."""
    if not seconds:
        yield
        return
    ended = threading.Event()

    def stall() -> None:
        while not ended.wait(STALL_EVERY - seconds):
            proxy.hold()
            ended.wait(seconds)
            proxy.release()

    thread = threading.Thread(target=stall, name="stalls")
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


ROUTER_READY = "The router is ready at "


@contextmanager
def demo_of_agents(number: int, dialect: str, seed: int) -> Iterator[None]:
    """Open the console for the robots of agents, with everything that they need.

    Raises:
        ConfigError: If a part does not start.

    """
    import webmap
    from webmap import console
    from webmap.fleet.remote_robots import find_agents

    with ExitStack() as running:
        router = running.enter_context(demo_router())
        for index in range(number):
            options = ("--robots", 1, "--port", 0, "--seed", seed + index)
            url = running.enter_context(simulator(*options, "--dialect", dialect))
            agent = ("agent", url, "--router", router, "--name", f"bay{index + 1}")
            running.enter_context(child("is ready", *agent, "--with-parent"))
        data = running.enter_context(as_file(files("webmap.sim") / "data"))
        floor = data / "floor.yaml"
        other = ("view", router, "--floor", floor, "--port", 0, "--no-browser")
        line = running.enter_context(child("is ready at", *other))
        echo(f"A second display: {line}", err=True)
        bridges: list[webmap.Bridge] = []
        agents = find_agents([router], bridges)
        opened = console.open_console(
            bridges, [], floor=floor, title="Demo", place="demo of agents"
        )
        for each in agents:
            each.show_on(opened)
        yield


@contextmanager
def demo_router() -> Iterator[str]:
    """Run a router on a free port of this computer; yield its address."""
    options = ("router", "--listen", "tcp/127.0.0.1:0", "--with-parent")
    with child(ROUTER_READY, *options) as line:
        yield line.removeprefix(ROUTER_READY).strip()


@contextmanager
def child(ready: str, *arguments: object) -> Iterator[str]:
    """Run a command of WebMap and yield its first line.

    Raises:
        ConfigError: If it does not start.

    """
    with child_process("webmap", *arguments) as started:
        if ready not in started.line:
            raise ConfigError(f"webmap {arguments[0]} has ended before it was ready")
        yield started.line.strip()


READY = "rosbridge is ready at "
USAGE = 2
"""Exit status of a command that has reported an error in one sentence."""


@contextmanager
def starting_simulator(*arguments: object) -> Iterator[Callable[[], str]]:
    """Run ``webmap sim`` as a child process.

    It ends with this process, however that ends, because its standard input closes.

    Yields:
        A function that waits for the URL of its rosbridge. It raises ConfigError if the
        simulator does not start.

    """
    with child_process("webmap", "sim", "--with-parent", *arguments) as started:

        def url() -> str:
            if not started.line.startswith(READY):
                status = started.process.wait(GRACE)
                if status == USAGE:  # the simulator has reported an error
                    sys.exit(USAGE)
                raise ConfigError(
                    f"the simulator ended with status {status} before it was ready"
                )
            return started.line.removeprefix(READY).strip()

        yield url


@contextmanager
def simulator(*arguments: object) -> Iterator[str]:
    """Run ``webmap sim`` as a child process and yield the URL of its rosbridge.

    Raises:
        ConfigError: If it does not start.

    """
    with starting_simulator(*arguments) as url:
        yield url()


ROBOTS = 5
"""Number of robots, if it is not given."""


@click.command()
@simulator_options(
    robots=f"Number of robots; {ROBOTS} by default.",
    dialect="ROS version: ros1 has the actions of move_base, ros2 those of Nav2.",
)
@click.option(
    "--quiet",
    is_flag=True,
    help="Show robots that all wait, without scan assist, a costmap or a low battery.",
)
@click.option(
    "--agents",
    type=click.IntRange(1, 9),
    help="Show that many agents, each beside a robot with a simulator of its own, and "
    "a second display; they meet at a router.",
)
@bad_link_options
@click.option(
    "--bridge-port",
    type=PORT,
    default=0,
    show_default=True,
    help="Port of the simulator's rosbridge; 0 lets the system choose.",
)
@web_options
def demo(
    robots: int | None,
    quiet: bool,
    agents: int | None,
    delay: float,
    jitter: float,
    stall: float,
    bridge_port: int,
    seed: int,
    dialect: str,
    web: dict[str, Any],
) -> None:
    """Show simulated robots, to try everything without a robot.

    The first two robots wait for you. The others have errands: they drive from place
    to place on their own, and wait after a command until 60 s pass without one.

    The simulator is a separate process behind a rosbridge, so the demo uses the same
    code as real robots. With --delay, --jitter and --stall the link to it is bad, to
    train on such a link.
    """
    import webmap

    if agents is not None:
        if bridge_port or robots:
            raise click.UsageError("--agents has one robot for each agent")
        with demo_of_agents(agents, dialect, seed):
            webmap.run(**web)
        return
    number = robots or ROBOTS
    options = ["--robots", number, "--port", bridge_port, "--seed", seed]
    if not quiet and number > FREE:
        options += ["--errands", number - FREE, "--low-battery"]
    with (
        starting_simulator(*options, "--dialect", dialect) as simulator_url,
        as_file(files("webmap.sim") / "data") as data,
    ):
        # The simulator starts meanwhile, which takes half a second as well.
        bridges: list[webmap.Bridge] = []
        opened = _open_console(bridges, data / "floor.yaml", quiet=quiet)
        with bad_link(simulator_url(), delay, jitter, stall) as url:
            bridges.append(webmap.Bridge(url, name="simulator"))
            for index in range(number):
                opened.add(demo_robot(bridges[0], index, dialect, quiet=quiet))
            webmap.run(**web)


def _open_console(bridges: "list[Bridge]", floor: Path, *, quiet: bool) -> "Console":
    """Open the console before there are robots, and import what serves it."""
    from webmap import console

    import_module("webmap.server.runner").own_files.version()
    import_module("webmap.agents.gates")
    return console.open_console(
        bridges,
        [],
        floor=floor,
        title="Demo",
        place="demo",
        layers_off=["Costmaps"] if quiet else [],
    )
