"""``webmap play FILE``: plays a recording on the map."""

import contextlib
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import click

from webmap.bags.playback import PlaybackCommand
from webmap.base.echo import echo
from webmap.base.errors import ConfigError
from webmap.base.processes import child_process
from webmap.cli.options import PORT, Finite, web_options


@click.command(short_help="Play a recording on the map: a bag of ROS 1 or ROS 2.")
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "--rate",
    type=Finite(0.001, 1000.0),
    default=1.0,
    show_default=True,
    help="Playback rate: 2 plays twice as fast as recorded.",
)
@click.option(
    "--start",
    type=Finite(0.0),
    default=0.0,
    show_default=True,
    help="Start of the playback in the recording, in seconds.",
)
@click.option("--loop", is_flag=True, help="Start again when the recording ends.")
@click.option(
    "--bridge-port",
    type=PORT,
    default=0,
    show_default=True,
    help="Port of the replay's rosbridge; 0 lets the system choose.",
)
@click.option(
    "--foxglove",
    is_flag=True,
    help="Also serve the recording to Foxglove and Lichtblick on this computer.",
)
@click.option(
    "--foxglove-port",
    type=PORT,
    default=8765,
    show_default=True,
    help="Port for --foxglove; 0 lets the system choose.",
)
@web_options
def play(
    files: tuple[Path, ...],
    rate: float,
    start: float,
    loop: bool,
    bridge_port: int,
    foxglove: bool,
    foxglove_port: int,
    web: dict[str, Any],
) -> None:
    """Play a recording on the map.

    A FILE is a bag of ROS 1 (.bag), the folder of a bag of ROS 2, or one of its files
    (.mcap, .db3); several bags of ROS 1 are played as one. Nothing in a recording can
    be driven. This command needs rosbags: pip install "webmap[bags]".

    With --foxglove, the page and Foxglove show one playback: each may pause and seek.
    This needs foxglove-sdk: pip install "webmap[bags,foxglove]".

    \b
    webmap play office.bag
    webmap play rosbag2_2026_05_04/ --rate 4 --loop
    webmap play drive.mcap --foxglove
    """
    import webmap
    from webmap import console
    from webmap.bags import need_foxglove, need_rosbags
    from webmap.bags.files import recording_name
    from webmap.features.player.recording_player import RecordingPlayer, expect_jumps
    from webmap.fleet.overrides import ViewOnly
    from webmap.fleet.search import find_fleet

    need_rosbags()
    if foxglove:
        need_foxglove()
    name = recording_name(files)
    options = ["--rate", rate, "--start", start, "--port", bridge_port]
    options += ["--loop"] if loop else []
    options += ["--foxglove-port", foxglove_port] if foxglove else []
    with replay(*options, "--", *files) as (urls, command):
        url, *served = urls.split()
        if served:
            echo(f"Foxglove and Lichtblick can connect to {served[0]}", err=True)
        bridge = webmap.Bridge(url, name=f"recording {name}")
        bridge.replays = True
        watched = ViewOnly(Path(name).stem)
        fleet = find_fleet([bridge], [], wait=5.0, overrides=watched)
        title = f"Recording {name}"
        opened = console.open_console([bridge], [], title=title, place=title)
        fleet.show(opened)
        expect_jumps(bridge, lambda: opened.robots)
        opened.add_module(RecordingPlayer, bridge, command)
        webmap.run(**web)


@contextlib.contextmanager
def replay(
    *arguments: object,
) -> Iterator[tuple[str, Callable[[PlaybackCommand], None]]]:
    """Run a replay as a child process.

    Yields the URL of its rosbridge, after a space the URL for Foxglove if there is one,
    and a function that gives it a command.

    It ends with this process, however that ends, because its standard input closes.

    Raises:
        ConfigError: If the recording cannot be played.

    """
    from webmap.bags.__main__ import READY, WRONG

    with child_process("webmap.bags", "--with-parent", *arguments) as started:
        line = started.line
        if line.startswith(WRONG):
            raise ConfigError(line.removeprefix(WRONG).strip())
        if not line.startswith(READY):
            raise ConfigError("the replay did not start; its error message is above")

        def give(command: PlaybackCommand) -> None:
            try:  # unbuffered: a buffer would keep the line and fail again at exit
                os.write(started.stdin.fileno(), f"{command.line}\n".encode())
            except (OSError, ValueError):
                echo("The replay has ended: nothing is played", err=True)

        yield line.removeprefix(READY).strip(), give
