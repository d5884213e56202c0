"""The cost of a frame from a robot: ``webmap.Bridge`` compared with roslibpy.

Each listens in its own process to the same player in another process. roslibpy returns
dicts and lists; WebMap returns typed messages and numpy arrays, so it does more work.
WebMap requests scans in CBOR, which roslibpy cannot read; the third contender is WebMap
with a bridge that only has JSON. For odometry the reference is the floor: websockets
and msgspec alone, which WebMap uses.
"""

import json
import subprocess
import sys
from collections.abc import Callable

from benchmarks.frames import ODOM, SCAN
from benchmarks.harness import Comparison, Contender, Figures, compare
from benchmarks.listener import WARM

COUNTS = {ODOM: 10_000, SCAN: 2_000}


def listening(client: str, topic: str, count: int) -> Callable[[], Figures]:
    """Return a run of one client that receives ``count`` frames."""

    def run() -> Figures:
        module = [sys.executable, "-m"]
        player = subprocess.Popen(
            [*module, "benchmarks.player", str(count)],
            stdout=subprocess.PIPE,
            text=True,
        )
        with player:
            try:
                assert player.stdout is not None
                port = player.stdout.readline().strip()
                command = [*module, "benchmarks.listener", client, port, topic]
                finished = subprocess.run(
                    [*command, str(count)], capture_output=True, text=True, check=True
                )
            finally:
                player.terminate()
        figures: Figures = json.loads(finished.stdout)
        return figures

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare the clients on odometry and on scans."""
    comparisons = []
    for topic, title, clients in (
        (ODOM, "Odometry of 1.9 kB", ["libraries", "webmap", "roslibpy"]),
        (SCAN, "LaserScan of 720 ranges", ["webmap", "roslibpy", "webmap-json"]),
    ):
        count = WARM + COUNTS[topic] // (10 if quick else 1)
        contenders = [Contender(c, listening(c, topic, count)) for c in clients]
        comparisons.append(compare(title, contenders, rounds))
    return comparisons
