"""``webmap demo``: runs the simulator and the console for its robots."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.resources import as_file, files
from typing import TYPE_CHECKING, NoReturn

import click

from webmap.base.child_process import child_process
from webmap.base.children import GRACE
from webmap.base.errors import ConfigError
from webmap.cli.options import PORT, simulator_options, web_options

if TYPE_CHECKING:
    from webmap import Bridge, Robot

READY = "rosbridge is ready at "
USAGE = 2
"""Exit status of a command that has reported an error in one sentence."""


@click.command()
@simulator_options(
    robots="Number of robots; 2 by default.",
    dialect="ROS version: ros1 has the actions of move_base, ros2 those of Nav2.",
)
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
    bridge_port: int,
    seed: int,
    dialect: str,
    host: str,
    port: int,
    no_browser: bool,
    insecure_lan: bool,
) -> None:
    """Show simulated robots, to try everything without a robot.

    The simulator is a separate process behind a rosbridge, so the demo uses the same
    code as real robots.
    """
    import webmap
    from webmap import console

    number = robots or 2
    options = ("--robots", number, "--port", bridge_port, "--seed", seed)
    with (
        simulator(*options, "--dialect", dialect) as url,
        as_file(files("webmap.sim") / "data") as data,
    ):
        bridge = webmap.Bridge(url, name="simulator")
        floor = data / "floor.yaml"
        opened = console.open_console(
            [bridge], [], floor=floor, title="WebMap demo", place="demo"
        )
        for index in range(number):
            opened.add(demo_robot(bridge, index, dialect))
        webmap.run(
            host=host,
            port=port,
            open_browser=not no_browser,
            insecure_lan=insecure_lan,
        )


def demo_robot(bridge: "Bridge", index: int, dialect: str = "ros1") -> "Robot":
    """Return one of the simulator's robots, with modules that show its behavior.

    Drawing all its topics would hide the map; ``webmap view`` draws all of them.

    Args:
        bridge: The simulator's bridge.
        index: Number of the robot, from 0.
        dialect: The ROS that the simulator imitates, ``"ros1"`` or ``"ros2"``.

    """
    import webmap
    from webmap.console import make_robot

    topics = f"/robot_{index}"
    move = {
        "topic": f"{topics}/goal_pose",
        "action": f"{topics}/navigate_to_pose",
        "action_type": "nav2_msgs/action/NavigateToPose",
    }
    if dialect != "ros2":
        move = {
            "topic": f"{topics}/move_base_simple/goal",
            "cancel_topic": f"{topics}/move_base/cancel",
            "action": f"{topics}/move_base",
            "action_type": "move_base_msgs/MoveBaseAction",
        }
    link = {"bridge": bridge.url}
    lookahead = {"name": "lookahead", "frame": "robot", "age_limit": 2.0}
    point = f"{topics}/lookahead_point"
    config = {
        "name": f"Robot {index}",
        "bridge": bridge.url,
        "odometry": f"{topics}/odom",
        "twist": {"topic": f"{topics}/cmd_vel", "stops_within": 0.25},
        "scan": f"{topics}/base_scan",
        "battery": f"{topics}/battery_state",
        "cameras": f"{topics}/camera/image_raw/compressed",
        "move": move,
        "initial_pose": f"{topics}/initialpose",
        "modules": [
            {"name": "Path", "args": [link, f"{topics}/plan"]},
            {"name": "Trail", "options": {"length": 10.0}},
            {"name": "PointStamped", "args": [link, point], "options": lookahead},
            {"name": "Diagnostics", "args": [link], "options": {"namespace": topics}},
        ],
    }
    return make_robot(webmap.RobotConfig.from_dict(config), [bridge])


def _give_up(status: int) -> NoReturn:
    """End the command, with an error if the simulator has reported none."""
    if status == USAGE:
        sys.exit(USAGE)
    raise ConfigError(f"the simulator ended with status {status} before it was ready")


@contextmanager
def simulator(*arguments: object) -> Iterator[str]:
    """Run ``webmap sim`` as a child process and yield the URL of its rosbridge.

    It ends with this process, however that ends, because its standard input closes.

    Raises:
        ConfigError: If it does not start.

    """
    with child_process("webmap", "sim", "--with-parent", *arguments) as started:
        if not started.line.startswith(READY):
            _give_up(started.process.wait(GRACE))
        yield started.line.removeprefix(READY).strip()
