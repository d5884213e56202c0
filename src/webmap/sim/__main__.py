"""The simulator from a command line: ``python -m webmap.sim``."""

import argparse
import asyncio
import sys
from typing import Any

from webmap.base.errors import WebMapError
from webmap.base.logs import set_up_logging
from webmap.base.text import one_line
from webmap.sim.process import end_with_stdin, run_simulator


def main() -> int:
    """Run the simulator and return the exit status."""
    options = vars(_parser().parse_args())
    set_up_logging()
    try:
        asyncio.run(_run(options))
    except (WebMapError, OSError) as error:
        print(f"error: {one_line(error)}", file=sys.stderr)
        return 2
    return 0


async def _run(options: dict[str, Any]) -> None:
    stop = asyncio.Event()
    if options.pop("until_eof"):
        end_with_stdin(stop)
    await run_simulator(
        **options, on_http_camera=_print_cameras, on_ready=_print_ready, stop=stop
    )


def _print_ready(url: str) -> None:
    print(f"rosbridge is ready at {url}", flush=True)


def _print_cameras(url: str) -> None:
    print(f"cameras are at {url}", file=sys.stderr, flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m webmap.sim",
        description="Simulated robots behind a rosbridge server.",
    )
    add = parser.add_argument
    add("--robots", type=int, default=2, help="how many robots (2)")
    add(
        "--port",
        type=int,
        default=0,
        help="port to listen on; 0 lets the system choose",
    )
    add("--host", default="127.0.0.1", help="address to listen on")
    add("--seed", type=int, default=1, help="random seed (1)")
    add("--map", help="map_server YAML file; by default a floor made for this")
    add("--dialect", choices=("ros1", "ros2"), default="ros1")
    add("--rosbridge", help="version to behave like, such as 4.1; sets --dialect")
    add("--twist", choices=("Twist", "TwistStamped"), default="Twist")
    add(
        "--robot-timeout",
        type=_seconds_or_none,
        default=0.25,
        help="seconds without cmd_vel until a base stops by itself; 'none' for never",
    )
    add("--drift", type=float, default=0.0, help="odometry error, metres a metre (0)")
    add("--nan", action="store_true", help="some NaN in scans and covariances")
    add("--quirks", default="real", help="'real', 'polite', or 'polite,NAME,-NAME'")
    add("--wander", action="store_true", help="idle robots drive to random places")
    add(
        "--no-extras",
        dest="extras",
        action="store_false",
        help="robots without costmaps, clouds, sonars, health and the like",
    )
    add(
        "--take-nan",
        dest="refuse_nan",
        action="store_false",
        help="bases that run on a twist with NaN or infinity",
    )
    add(
        "--http-camera",
        type=int,
        metavar="PORT",
        help="the cameras over HTTP too, as web_video_server has them",
    )
    add("--until-eof", action="store_true", help="end when standard input ends")
    return parser


def _seconds_or_none(text: str) -> float | None:
    return None if text.lower() == "none" else float(text)


if __name__ == "__main__":
    sys.exit(main())
