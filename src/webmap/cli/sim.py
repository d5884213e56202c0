"""``webmap sim``: runs the simulator and its rosbridge."""

import os
import signal
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from webmap.base.echo import echo
from webmap.base.processes import end_with_parent
from webmap.cli.options import PORT, Finite, simulator_options, verbose_option


@click.command()
@simulator_options(
    robots="Number of robots; 2 by default, and 1 with --flat.",
    dialect="ROS version of types and stamps.",
)
@click.option(
    "--port",
    "-p",
    type=PORT,
    default=9090,
    show_default=True,
    help="Port of the rosbridge; 0 lets the system choose.",
)
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="Address of the rosbridge; anyone who reaches it can drive the robots.",
)
@click.option(
    "--map",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="A floor plan in map_server's format (YAML); a building by default.",
)
@click.option(
    "--twist",
    type=click.Choice(["Twist", "TwistStamped"]),
    default="Twist",
    show_default=True,
    help="The type of cmd_vel.",
)
@click.option(
    "--robot-timeout",
    type=Finite(0.0),
    default=0.25,
    show_default=True,
    help="Seconds without cmd_vel after which a base stops by itself; 0: never.",
)
@click.option(
    "--drift",
    type=Finite(0.0),
    default=0.0,
    show_default=True,
    help="Drift of odometry, as a fraction of the driven distance.",
)
@click.option("--nan", is_flag=True, help="Set some rays of each scan to NaN.")
@click.option("--wander", is_flag=True, help="Let robots without commands drive about.")
@click.option(
    "--errands",
    type=click.IntRange(0, 500),
    default=0,
    show_default=True,
    help="Number of robots that go from place to place on their own, the last ones. A "
    "robot that gets a command pauses until 60 s pass without one.",
)
@click.option(
    "--low-battery", is_flag=True, help="Start the last robot with a low battery."
)
@click.option(
    "--flat",
    is_flag=True,
    help="One robot, with topics without a prefix: /odom, /cmd_vel, /base_scan.",
)
@click.option(
    "--extras/--no-extras",
    default=True,
    show_default=True,
    help="Offer costmaps, clouds, sonars, markers, diagnostics and more topics.",
)
@click.option(
    "--tilted",
    is_flag=True,
    help="Mount lasers upside down; send the depth cloud in its optical frame.",
)
@click.option(
    "--rosbridge",
    metavar="VERSION",
    help="Behave like this version of rosbridge: 0.11 (ROS 1), 2.1, 2.7, 3.2, 3.3, 4.1 "
    "or 4.2 (ROS 2). By default 0.11 or 2.1, by --dialect.",
)
@click.option(
    "--polite",
    is_flag=True,
    help="Let the rosbridge report mistakes of clients; short for --quirks polite.",
)
@click.option(
    "--quirks",
    metavar="TEXT",
    help="How the rosbridge departs from its protocol: 'real' as observed servers, or "
    "'polite'; then ',NAME' adds and ',-NAME' removes a quirk: 'polite,bare_nan'. The "
    "reference lists the names.",
)
@click.option(
    "--take-nan",
    is_flag=True,
    help="Let bases obey a velocity with NaN or infinity; by default they ignore it.",
)
@click.option(
    "--http-camera",
    type=PORT,
    help="Serve the cameras over HTTP too, as web_video_server does, on this port; 0 "
    "lets the system choose.",
)
@click.option("--with-parent", is_flag=True, hidden=True)
@verbose_option
def sim(
    robots: int | None,
    flat: bool,
    robot_timeout: float,
    rosbridge: str | None,
    polite: bool,
    quirks: str | None,
    take_nan: bool,
    with_parent: bool,
    **options: Any,
) -> None:
    """Simulate robots with laser scanners, behind a rosbridge.

    Any client of rosbridge can use it: roslibpy, roslib, Foxglove, WebMap.
    """
    import asyncio

    from webmap.sim import run_simulator

    if polite and quirks:
        raise click.UsageError(
            "--polite is short for --quirks polite; give only one of them"
        )
    dialect_from = click.get_current_context().get_parameter_source("dialect")
    if rosbridge and dialect_from is not ParameterSource.DEFAULT:
        raise click.UsageError(
            "--rosbridge determines the dialect; give only one of them"
        )
    if with_parent:
        end_with_parent(lambda: os.kill(os.getpid(), signal.SIGTERM))
    asyncio.run(
        run_simulator(
            robots=robots or (1 if flat else 2),
            flat=flat,
            robot_timeout=robot_timeout or None,
            rosbridge=rosbridge,
            quirks="polite" if polite else quirks or "real",
            refuse_nan=not take_nan,
            on_http_camera=lambda url: echo(f"cameras are at {url}", err=True),
            on_ready=lambda url: echo(f"rosbridge is ready at {url}"),
            **options,  # they have the names of its arguments
        )
    )
