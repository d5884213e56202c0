"""A replay and its rosbridge as a process: ``python -m webmap.bags FILE``."""

import argparse
import asyncio
import logging
import sys
from pathlib import Path

from webmap.bags import need_rosbags
from webmap.bags.player import Player
from webmap.bags.recording import Recording
from webmap.base.errors import ConfigError, WebMapError
from webmap.base.logs import set_up_logging
from webmap.base.processes import end_with_parent, why_not_listening
from webmap.base.text import one_line
from webmap.ros.rosbridge.server.dialect import POLITE
from webmap.ros.rosbridge.server.encode import Encoder
from webmap.ros.rosbridge.server.server import RosbridgeServer
from webmap.sim.process import signals_set

log = logging.getLogger("webmap.bags")

HOST = "127.0.0.1"
"""Only this machine may connect: a recording is private."""

READY = "rosbridge is ready at "
WRONG = "error: "
"""The beginning of the only line on standard output if there is nothing to play."""

LONGEST = 100
"""Bytes of a command, which is a line on standard input."""


def main() -> int:
    """Play a recording until SIGINT or SIGTERM and return the exit status."""
    options = vars(_parser().parse_args())
    set_up_logging()
    try:
        asyncio.run(_run(**options))
    except (WebMapError, OSError) as error:
        print(f"{WRONG}{one_line(error)}", flush=True)
        return 2
    return 0


async def _run(
    paths: list[Path],
    rate: float,
    start: float,
    loop: bool,
    port: int,
    foxglove_port: int | None,
    with_parent: bool,
) -> None:
    need_rosbags()
    running = asyncio.get_running_loop()
    stop = asyncio.Event()
    player: Player | None = None
    rest = b""

    def hear(data: bytes) -> None:
        nonlocal rest
        *lines, rest = (rest + data).split(b"\n")
        rest = rest[:LONGEST]
        for line in lines:
            if player is not None:
                player.obey(line[:LONGEST].decode(errors="replace"))

    if with_parent:  # before the files are opened, which may take long
        end_with_parent(
            lambda: running.call_soon_threadsafe(stop.set),
            lambda data: running.call_soon_threadsafe(hear, data),
        )
    recording = Recording(paths, warn=log.warning, undecoded=foxglove_port is not None)
    try:
        player = Player(recording, rate=rate, start=start, loop=loop)
        player.replay.start()
        server = RosbridgeServer(player.replay.graph, Encoder(recording.schema, POLITE))
        with signals_set(stop):
            try:
                url = await server.start(HOST, port)
            except OSError as error:
                raise ConfigError(why_not_listening(HOST, port, error)) from error
            if foxglove_port is not None:
                from webmap.bags.foxglove_server import FoxgloveServer

                logging.getLogger("foxglove").setLevel(logging.WARNING)
                player.foxglove = FoxgloveServer(
                    recording, HOST, foxglove_port, player.obey, lambda: player.status
                )
                url += f" {player.foxglove.url}"
            print(f"{READY}{url}", flush=True)
            playing = asyncio.create_task(player.run())
            stopped = asyncio.create_task(stop.wait())
            try:
                await asyncio.wait(
                    [playing, stopped], return_when=asyncio.FIRST_COMPLETED
                )
                if playing.done():  # only after an error
                    playing.result()
            finally:
                playing.cancel()
                stopped.cancel()
                await asyncio.wait([playing, stopped])
                await server.stop()
                if player.foxglove is not None:
                    player.foxglove.stop()
    finally:
        recording.close()


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m webmap.bags", description="A recording behind a rosbridge."
    )
    add = parser.add_argument
    add("paths", nargs="+", type=Path, help="a bag of ROS 1 or ROS 2")
    add("--rate", type=float, default=1.0, help="playback rate (1)")
    add("--start", type=float, default=0.0, help="where it begins, in seconds")
    add("--loop", action="store_true", help="start again when the recording ends")
    add("--port", type=int, default=0, help="rosbridge port; 0 lets the system choose")
    add("--foxglove-port", type=int, help="also serve Foxglove at this port")
    add("--with-parent", action="store_true", help="end when standard input does")
    return parser


if __name__ == "__main__":
    sys.exit(main())
