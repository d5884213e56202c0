"""``webmap record URL``: records the topics behind a rosbridge into a bag."""

import sys
from pathlib import Path

import click

from webmap.base.errors import ConfigError
from webmap.cli.options import (
    Finite,
    bridge_argument,
    topics_option,
    verbose_option,
    wait_option,
    waiting_for,
)


@click.command(short_help="Record the topics of a bridge into a bag.")
@bridge_argument("url")
@click.option(
    "--topic",
    "only",
    multiple=True,
    metavar="TOPIC",
    help="Record only this topic. May be repeated.",
)
@click.option(
    "--type",
    "types",
    multiple=True,
    metavar="NAME",
    help="The type of a --topic if the bridge has no rosapi, once for each --topic in "
    "the same order: nav_msgs/Odometry, or nav_msgs/msg/Odometry for ROS 2.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="The bag: a file for ROS 1, a folder for ROS 2. It must not exist. By "
    "default, its name is webmap- and the time.",
)
@click.option(
    "--duration",
    type=Finite(0.0, min_open=True),
    help="Seconds to record; without it, Ctrl+C ends the recording.",
)
@wait_option
@topics_option
@verbose_option
def record(
    url: str,
    only: tuple[str, ...],
    types: tuple[str, ...],
    out: Path | None,
    duration: float | None,
    wait: float,
    topics: dict[str, str] | None,
) -> None:
    """Record the topics behind a bridge into a bag.

    URL is the address of a rosbridge, of a Foxglove bridge: foxglove://robot:8765, of a
    robot with rmw_zenoh: zenoh-ros2://robot:7447, or of an agent:
    zenoh://host:7447/bay3.

    The bag has the format of the robot's ROS: a .bag file, or a folder with an MCAP
    file. Topics that appear later are recorded too. Nothing is moved. This command
    needs rosbags: pip install "webmap[bags]".

    \b
    webmap record ws://robot:9090
    webmap record ws://robot:9090 --topic /tf --topic /scan --duration 60
    """
    import asyncio

    from webmap.agents.announcements import one_agent
    from webmap.bags import need_rosbags
    from webmap.bags.record import record_to, stated_types
    from webmap.ros.names import normalise_topic

    need_rosbags()
    names = [normalise_topic(topic) for topic in only]
    stated = stated_types(names, types, topics)
    if stated is not None:
        stated = {
            normalise_topic(topic): type_name for topic, type_name in stated.items()
        }
        if bare := [name for name in names if name not in stated]:
            raise ConfigError(
                f"the type of {', '.join(bare)} is unknown: give it with --type, or "
                f"add it to the list of --topics"
            )
    failed = asyncio.run(
        record_to(
            one_agent(url, wait=wait, waiting=waiting_for(url)),
            out,
            only=names,
            stated=stated,
            wait=wait,
            duration=duration,
        )
    )
    if failed:
        sys.exit(2)
