"""``webmap demo``: runs the simulator and the console for its robots."""

from importlib.resources import as_file, files

import click

from webmap.cli.bad_link import bad_link, bad_link_options
from webmap.cli.demo_agents import demo_of_agents
from webmap.cli.demo_robots import FREE, demo_robot
from webmap.cli.demo_simulator import simulator
from webmap.cli.options import PORT, simulator_options, web_options

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
    host: str,
    port: int,
    no_browser: bool,
    insecure_lan: bool,
) -> None:
    """Show simulated robots, to try everything without a robot.

    The first two robots wait for you. The others have errands: they drive from place
    to place on their own, and wait after a command until 60 s pass without one.

    The simulator is a separate process behind a rosbridge, so the demo uses the same
    code as real robots. With --delay, --jitter and --stall the link to it is bad, to
    train on such a link.
    """
    import webmap

    def serve() -> None:
        webmap.run(
            host=host,
            port=port,
            open_browser=not no_browser,
            insecure_lan=insecure_lan,
        )

    if agents is not None:
        if bridge_port or robots:
            raise click.UsageError("--agents has one robot for each agent")
        with demo_of_agents(agents, dialect, seed):
            serve()
        return
    number = robots or ROBOTS
    options = ["--robots", number, "--port", bridge_port, "--seed", seed]
    if not quiet and number > FREE:
        options += ["--errands", number - FREE, "--low-battery"]
    with (
        simulator(*options, "--dialect", dialect) as direct,
        bad_link(direct, delay, jitter, stall) as url,
        as_file(files("webmap.sim") / "data") as data,
    ):
        from webmap import console

        bridge = webmap.Bridge(url, name="simulator")
        opened = console.open_console(
            [bridge],
            [],
            floor=data / "floor.yaml",
            title="Demo",
            place="demo",
            layers_off=["Costmaps"] if quiet else [],
        )
        for index in range(number):
            opened.add(demo_robot(bridge, index, dialect, quiet=quiet))
        serve()
