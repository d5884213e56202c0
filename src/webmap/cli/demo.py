"""``webmap demo``: the simulator, and the console on it."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import as_file, files

import click

from webmap.cli.options import PORT, web_options
from webmap.errors import ConfigError

READY = "rosbridge is ready at "


@click.command()
@click.option(
    "--robots",
    "-n",
    type=click.IntRange(1, 500),
    default=2,
    show_default=True,
    help="How many robots.",
)
@click.option(
    "--bridge-port",
    type=PORT,
    default=0,
    show_default=True,
    help="Port of the simulator's rosbridge; 0 lets the system choose.",
)
@click.option(
    "--seed", type=int, default=1, show_default=True, help="Where they start."
)
@web_options
def demo(
    robots: int,
    bridge_port: int,
    seed: int,
    host: str,
    port: int,
    no_browser: bool,
    insecure_lan: bool,
) -> None:
    """Show simulated robots, to try everything without a robot.

    The simulator is a process of its own behind a rosbridge, so the demo takes the
    same road as real robots.
    """
    import webmap
    from webmap import console

    with (
        simulator("--robots", robots, "--port", bridge_port, "--seed", seed) as url,
        as_file(files("webmap.sim") / "data") as data,
    ):
        bridge = webmap.Bridge(url, name="simulator")
        described = [
            console.RobotDescription(
                name=f"Robot {index}",
                bridge=bridge,
                odometry=f"/robot_{index}/odom",
                twist=f"/robot_{index}/cmd_vel",
                scan=f"/robot_{index}/base_scan",
                battery=f"/robot_{index}/battery_state",
                cameras=(f"/robot_{index}/camera/image_raw/compressed",),
                goal=f"/robot_{index}/move_base_simple/goal",
                action=(f"/robot_{index}/move_base", "move_base_msgs/MoveBaseAction"),
                initial_pose=f"/robot_{index}/initialpose",
                stops_within=0.25,
            )
            for index in range(robots)
        ]
        console.open_console(
            [bridge], described, floor=data / "floor.yaml", title="WebMap demo"
        )
        webmap.run(
            host=host,
            port=port,
            open_browser=not no_browser,
            insecure_lan=insecure_lan,
        )


@contextmanager
def simulator(*arguments: object) -> Iterator[str]:
    """Run ``webmap sim`` beside this process and give its rosbridge's URL.

    It ends with this process, however that ends, since its standard input does.

    Raises:
        ConfigError: If it does not come up.

    """
    command = [sys.executable, "-m", "webmap", "sim", "--with-parent"]
    with subprocess.Popen(
        [*command, *map(str, arguments)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        assert process.stdout is not None
        try:
            line = process.stdout.readline()
            if not line.startswith(READY):
                raise ConfigError("the simulator did not start; what it said is above")
            yield line.removeprefix(READY).strip()
        finally:
            process.terminate()
            try:
                process.wait(3.0)
            except subprocess.TimeoutExpired:
                process.kill()
