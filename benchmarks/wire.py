"""What the display sends to one viewer, compared with what rosbridge sent to it.

The robots, their layers and the session of a page are real; only the clock is made, so
that the figures are the same on each machine. The page acknowledges each frame.
"""

import math
import time
from collections.abc import Callable
from unittest.mock import patch

import webmap
from benchmarks.frames import ODOM, json_frames
from benchmarks.harness import Comparison, Contender, Figures, compare
from benchmarks.watchers import HEAD
from webmap.base.geometry import Quaternion, Vector3
from webmap.poses.placing import PoseReading
from webmap.scene.wire.session import SceneSession

ROBOTS = 20
RATE = 10
"""Messages a second of each topic."""

TICKS = 20
"""Ticks of the display a second."""


class Site:
    """Robots whose data a viewer gets.

    Args:
        moves: Whether the robots drive along circles.

    """

    def __init__(self, *, moves: bool) -> None:
        self.now = 1000.0
        self._moves = moves
        self.robots = [webmap.Robot(f"robot {number}") for number in range(ROBOTS)]
        self.session = SceneSession()
        for robot in self.robots:
            self.session.mount(robot.fragment, under=0)
        self.frames = self.bytes = 0

    def run(self, seconds: float) -> None:
        """Let time pass."""
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

    def _tick(self) -> None:
        frame = self.session.frame(self.now)
        if frame is not None:
            self.frames += 1
            self.bytes += len(frame)
            number = HEAD.unpack_from(frame)[2]
            self.session.receive(f'{{"op":"seen","frame":{number}}}')


def shown(seconds: float, *, moves: bool) -> Callable[[], Figures]:
    """Return a run of the display."""

    def run() -> Figures:
        site = Site(moves=moves)
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
    """Return what a rosbridge sends to one browser: every message, in JSON."""

    def run() -> Figures:
        size = sum(
            sum(map(len, frames)) / len(frames)
            for frames in (json_frames(topic) for topic in topics)
        )
        messages = ROBOTS * RATE
        return {
            "messages a second": messages * len(topics),
            "bytes (kB a second)": messages * size / 1000,
        }

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare what a viewer gets with what rosbridge sends."""
    seconds = 2.0 if quick else 20.0
    poses = [
        Contender("rosbridge's JSON", rosbridge(ODOM)),
        Contender("robots that move", shown(seconds, moves=True)),
        Contender("robots that stand still", shown(seconds, moves=False)),
    ]
    title = f"poses of {ROBOTS} robots at {RATE} Hz, to one viewer"
    return [compare(title, poses, 1)]
