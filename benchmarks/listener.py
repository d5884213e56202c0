"""One client that receives frames from the player and reports the cost of a frame.

Run as ``python -m benchmarks.listener CLIENT PORT TOPIC COUNT``; prints JSON. The cost
is the processor time of this whole process, all threads, from the first frame of the
measured part to the last, divided by the number of frames. The least cost is that of
the cheapest part of :data:`PART` frames: what other programs on the machine delay is
not in it.
"""

import asyncio
import json
import math
import sys
import threading
import time
from array import array
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from benchmarks.frames import ODOM, TYPES

if TYPE_CHECKING:
    from webmap.ros.subscriptions import Encoding

WARM = 200
"""Frames that are not counted."""

PART = 200
"""Frames in a row that are measured together."""


class Meter:
    """Counts frames up to a given number: ``WARM`` and a multiple of ``PART``."""

    def __init__(self, count: int) -> None:
        self.count = count
        self.seen = 0
        self.done = threading.Event()
        self._cpu: list[float] = []
        """The processor time after the frames that are not counted and each part."""
        self._wall = 0.0

    def frame(self) -> None:
        """Count a message that reached the code of the user."""
        self.seen += 1
        if self.seen >= WARM and (self.seen - WARM) % PART == 0:
            self._cpu.append(time.process_time())
            if self.seen == WARM:
                self._wall = time.perf_counter()
            elif self.seen == self.count:
                self._wall = time.perf_counter() - self._wall
                self.done.set()

    def figures(self) -> dict[str, float]:
        """Return the figures of the run."""
        frames = self.count - WARM
        parts = [after - before for before, after in pairwise(self._cpu)]
        return {
            "cpu a frame (us)": sum(parts) / frames * 1e6,
            "least cpu a frame (us)": min(parts) / PART * 1e6,
            "frames a second": frames / self._wall,
        }


def listen_with_roslibpy(port: int, topic: str, meter: Meter) -> None:
    """Receive messages with roslibpy: dicts, without conversion to arrays."""
    import roslibpy

    def on_message(message: dict[str, Any]) -> None:
        _ = message["pose"]["pose"]["position"]["x"] if topic == ODOM else None
        _ = message["ranges"] if topic != ODOM else None
        meter.frame()

    ros = roslibpy.Ros("127.0.0.1", port)
    ros.run()
    roslibpy.Topic(ros, topic, TYPES[topic]).subscribe(on_message)
    meter.done.wait(120)
    ros.terminate()


def listen_with_webmap(
    port: int, topic: str, meter: Meter, encoding: "Encoding | None"
) -> None:
    """Receive messages like WebMap's own modules: typed, with ranges as an array."""
    asyncio.run(_listen_with_webmap(port, topic, meter, encoding))


async def _listen_with_webmap(
    port: int, topic: str, meter: Meter, encoding: "Encoding | None"
) -> None:
    from webmap import Bridge
    from webmap.ros.messages import LaserScanMsg, OdometryMsg

    done = asyncio.Event()

    def on_odometry(message: Any) -> None:
        _ = message.pose.pose.position.x
        count()

    def on_scan(message: Any) -> None:
        _ = message.ranges
        count()

    def count() -> None:
        meter.frame()
        if meter.done.is_set():
            done.set()

    bridge = Bridge(f"ws://127.0.0.1:{port}")
    bridge.subscribe(
        topic,
        on_odometry if topic == ODOM else on_scan,
        TYPES[topic],
        decode=OdometryMsg if topic == ODOM else LaserScanMsg,
        encoding=encoding,
    )
    bridge.start(asyncio.get_running_loop())
    async with asyncio.timeout(120):
        await done.wait()
    await bridge.stop()


def listen_with_libraries(port: int, topic: str, meter: Meter) -> None:
    """Receive typed messages with websockets, msgspec and Python's arrays alone."""
    asyncio.run(_listen_with_libraries(port, topic, meter))


async def _listen_with_libraries(port: int, topic: str, meter: Meter) -> None:
    import msgspec
    from websockets.asyncio.client import connect

    from webmap.ros.arrays import Floats
    from webmap.ros.messages import LaserScanMsg, OdometryMsg
    from webmap.ros.rosbridge import ops

    def dec_hook(_floats: object, value: list[float | None]) -> Floats:
        return Floats(array("f", [math.nan if v is None else v for v in value]))

    type = OdometryMsg if topic == ODOM else LaserScanMsg
    fields = [("op", str), ("topic", str), ("msg", type)]
    decode = msgspec.json.Decoder(msgspec.defstruct("Frame", fields), dec_hook=dec_hook)
    async with connect(f"ws://127.0.0.1:{port}", compression=None) as link:
        await link.send(ops.subscribe(topic, id="1", type=TYPES[topic]), text=True)
        while not meter.done.is_set():
            message: Any = decode.decode(await link.recv(decode=False))
            _ = message.msg.pose.pose.position.x if topic == ODOM else None
            _ = message.msg.ranges if topic != ODOM else None
            meter.frame()


def main(client: str, port: int, topic: str, count: int) -> None:
    """Receive frames with one client and print the figures."""
    meter = Meter(count)
    if client == "roslibpy":
        listen_with_roslibpy(port, topic, meter)
    elif client == "libraries":
        listen_with_libraries(port, topic, meter)
    else:
        encoding: Encoding | None = "text" if client == "webmap-json" else None
        listen_with_webmap(port, topic, meter, encoding)
    print(json.dumps(meter.figures()), flush=True)


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), sys.argv[3], int(sys.argv[4]))
