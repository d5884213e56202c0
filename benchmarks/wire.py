"""The data that the display sends to one viewer, compared with rosbridge.

The robots, their layers and the session of a page are real. Only the clock is
simulated, so that the figures are the same on each machine. The page acknowledges each
frame.
"""

import json
import math
import time
from collections.abc import Callable
from unittest.mock import patch

import numpy as np

import webmap
from benchmarks.frames import ODOM, SCAN, VARIANTS, json_frames
from benchmarks.harness import Comparison, Contender, Figures, compare
from benchmarks.watchers import HEAD
from webmap.base.geometry import Quaternion, Vector3
from webmap.poses.placing import PoseReading
from webmap.ros.decoding import convert
from webmap.ros.messages import LaserScanMsg
from webmap.scene.node import Fragment
from webmap.scene.wire.session import SceneSession

ROBOTS = 20
RATE = 10
"""Messages a second of each topic."""

TICKS = 20
"""Ticks of the display a second."""


BEAMS = 360
NOISE = 0.01
"""The standard deviation of the ranges of a usual scanner, in metres."""

VIEW = {"op": "view", "b": 0, "c": 0, "e": 0, "f": 500, "height": 1000}
WIDE = 10_000
"""The width in pixels of a map that shows all robots, which are in a row."""


class Site:
    """Robots whose data a viewer gets.

    Args:
        moves: Whether the robots drive along circles.
        pixels: Pixels a metre of the viewer's map; 0 for robots without scans.
        width: The width of the map, in pixels.

    """

    def __init__(
        self, *, moves: bool, pixels: float = 0.0, width: float = WIDE
    ) -> None:
        self.now = 1000.0
        self._moves = moves
        self.robots = [webmap.Robot(f"robot {number}") for number in range(ROBOTS)]
        self.session = SceneSession()
        world = webmap.svg.g()
        root = webmap.svg.svg(world).set_map(world, 1200, 900)
        mount = self.session.mount(Fragment(root), under=0)
        for robot in self.robots:
            self.session.mount(robot.fragment, under=world.id, within=mount)
        if pixels:
            bridge = webmap.Bridge("ws://127.0.0.1:1")
            for robot in self.robots:
                robot.add_module("LaserScanner", bridge, "/scan", max_dots=None)
            at = {"map_element": root.id, "a": pixels, "d": -pixels}
            view = {**VIEW, **at, "width": width, "left": 0, "top": 0}
            self.session.receive(json.dumps(view))
        self.frames = self.bytes = 0
        self._chance = np.random.default_rng(1)

    def run(self, seconds: float) -> None:
        """Advance the simulated clock."""
        for tick in range(int(seconds * TICKS)):
            self.now += 1 / TICKS
            for number, robot in enumerate(self.robots):
                # Half of the robots have new data at each tick.
                if (tick + number) % (TICKS // RATE) == 0:
                    self.show(number, robot)
            self._tick()

    def show(self, number: int, robot: webmap.Robot) -> None:
        """Show new data of a robot."""
        turn = 0.7 * number + (0.5 * self.now if self._moves else 0.0)
        place = Vector3(4.0 * number + math.cos(turn), math.sin(turn), 0.0)
        robot.show_pose(PoseReading(place, Quaternion.from_yaw(turn)), self.now)
        for scanner in robot.modules:
            scanner.take(self._scan(turn))

    def _scan(self, turn: float) -> LaserScanMsg:
        """Return the scan of a room of 8 m by 6 m, with noise."""
        bearings = (np.arange(BEAMS) + 0.5) * math.tau / BEAMS - math.pi
        cos, sin = np.cos(bearings + turn), np.sin(bearings + turn)
        along, across = np.where(cos > 0, 5.0, 3.0), np.where(sin > 0, 2.0, 4.0)
        reach = np.minimum(along / abs(cos), across / abs(sin))
        reach += self._chance.normal(0.0, NOISE, BEAMS)
        ranges = np.round(reach, 3).astype(np.float32)
        fields = {
            "ranges": ranges.tolist(),
            "angle_min": float(bearings[0]),
            "angle_increment": math.tau / BEAMS,
            "range_min": 0.1,
            "range_max": 12.0,
        }
        message: LaserScanMsg = convert(fields, LaserScanMsg)
        return message

    def _tick(self) -> None:
        frame = self.session.frame(self.now)
        if frame is not None:
            self.frames += 1
            self.bytes += len(frame)
            number = HEAD.unpack_from(frame)[2]
            self.session.receive(f'{{"op":"seen","frame":{number}}}')


def shown(
    seconds: float, *, moves: bool, pixels: float = 0.0, width: float = WIDE
) -> Callable[[], Figures]:
    """Return a run of the display; see :class:`Site`."""

    def run() -> Figures:
        site = Site(moves=moves, pixels=pixels, width=width)
        with patch.object(time, "monotonic", lambda: site.now):
            site.run(2.0)
            site.frames = site.bytes = 0
            site.run(seconds)
        for robot in site.robots:
            robot.destroy()
        return {
            "messages a second": site.frames / seconds,
            "bytes (kB a second)": site.bytes / seconds / 1000,
        }

    return run


def rosbridge(*topics: str) -> Callable[[], Figures]:
    """Return the data of a rosbridge for one browser: each message, in JSON."""

    def run() -> Figures:
        frames = {ODOM: json_frames(ODOM), SCAN: json_frames(SCAN, BEAMS)}
        size = sum(sum(map(len, frames[topic])) / VARIANTS for topic in topics)
        messages = ROBOTS * RATE
        return {
            "messages a second": messages * len(topics),
            "bytes (kB a second)": messages * size / 1000,
        }

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare the data of a viewer with the data of rosbridge."""
    seconds = 2.0 if quick else 20.0
    poses = [
        Contender("rosbridge's JSON", rosbridge(ODOM)),
        Contender("robots that move", shown(seconds, moves=True)),
        Contender("robots that stand still", shown(seconds, moves=False)),
    ]
    scans = [
        Contender("rosbridge's JSON", rosbridge(ODOM, SCAN)),
        *(
            Contender(
                f"{pixels} pixels a metre", shown(seconds, moves=True, pixels=pixels)
            )
            for pixels in (100, 50, 20)
        ),
        Contender("20, standing still", shown(seconds, moves=False, pixels=20)),
        Contender(
            "50, map of 600 pixels", shown(seconds, moves=True, pixels=50, width=600)
        ),
    ]
    to = f"of {ROBOTS} robots at {RATE} Hz, to one viewer"
    return [
        compare(f"poses {to}", poses, 1),
        compare(f"poses and scans of {BEAMS} {to}", scans, 1),
    ]
