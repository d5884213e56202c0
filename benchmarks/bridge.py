"""The cost of a frame from a robot: ``webmap.Bridge``, roslibpy and roslib in Node.js.

Each runs in a separate process, and receives frames from the same player in another
process. roslibpy returns dicts and lists, roslib objects; WebMap returns typed messages
and compact arrays, so it does more work. The reference is the least possible work:
websockets and msgspec alone, with JSON.
WebMap requests scans in CBOR, which roslibpy cannot read and roslib reads if asked;
``webmap-json`` is WebMap with a bridge that supports only JSON.

numpy's library for linear algebra gets one thread: a second one waits actively for
0.1 s after the import, which would be counted.
"""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from benchmarks.frames import ODOM, SCAN, TYPES
from benchmarks.harness import Comparison, Contender, Figures, compare
from benchmarks.listener import WARM

NODE = ("roslib", "roslib-cbor")
"""The contenders that run in Node.js."""

ROSLIB_PACKAGE = Path(__file__).parent.parent / "node_modules" / "roslib2"

ROSLIB = str(Path(__file__).with_name("roslib_listener.mjs"))

COUNTS = {ODOM: 10_000, SCAN: 4_000}


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
                if client in NODE:
                    compression = "cbor" if client == "roslib-cbor" else "none"
                    command = ["node", ROSLIB, compression, port, topic, TYPES[topic]]
                finished = subprocess.run(
                    [*command, str(count)],
                    capture_output=True,
                    text=True,
                    check=True,
                    env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
                )
            finally:
                player.terminate()
        figures: Figures = json.loads(finished.stdout)
        return figures

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare the clients on odometry and on scans.

    roslib is left out where Node.js or its packages are missing.
    """
    has_node = shutil.which("node") is not None and ROSLIB_PACKAGE.exists()
    comparisons = []
    for topic, title, clients in (
        (ODOM, "Odometry of 1.9 kB", ["libraries", "webmap", "roslibpy", "roslib"]),
        (
            SCAN,
            "LaserScan of 720 ranges",
            [
                "libraries",
                "webmap-json",
                "webmap",
                "roslibpy",
                "roslib",
                "roslib-cbor",
            ],
        ),
    ):
        count = WARM + COUNTS[topic] // (10 if quick else 1)
        contenders = [
            Contender(client, listening(client, topic, count))
            for client in clients
            if has_node or client not in NODE
        ]
        comparisons.append(compare(title, contenders, rounds))
    return comparisons
