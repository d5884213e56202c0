"""``webmap demo --agents``: a router, agents with robots, and two displays."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from importlib.resources import as_file, files

from webmap.base.child_process import child_process
from webmap.base.echo import echo
from webmap.base.errors import ConfigError
from webmap.cli.demo_simulator import simulator

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
