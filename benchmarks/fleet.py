"""A program for ``webmap run``: robots that move and scan, without ROS.

Their data is computed in advance, so that only the scene, the wire and the sockets are
measured. ``FLEET_ROBOTS`` and ``FLEET_BEAMS`` are the numbers of robots and beams, and
``FLEET_TICK`` is the time between two poses; without beams there are no scans. The page
is a plain map, or the console if ``FLEET_CONSOLE`` is set.
"""

import math
import os
import threading
import time

import numpy as np

import webmap
import webmap.console
from webmap.base.geometry import Quaternion, Vector3
from webmap.poses.placing import PoseReading

ROBOTS = int(os.environ.get("FLEET_ROBOTS", "200"))
BEAMS = int(os.environ.get("FLEET_BEAMS", "360"))

CONSOLE = bool(os.environ.get("FLEET_CONSOLE"))

TICK = float(os.environ.get("FLEET_TICK", "0.05"))
"""Seconds between two poses of a robot; scans come half as often."""

STEPS = 40
"""Ticks after which poses and scans repeat."""


class Mover:
    """One robot on its circle."""

    def __init__(self, number: int) -> None:
        model = webmap.svg.circle(r=0.3, fill="steelblue")
        self.robot = webmap.Robot(f"robot {number}", model)
        self.dots = webmap.svg.path(class_="dot", fill="crimson")
        if BEAMS:
            self.robot.svg.append(webmap.svg.g(self.dots, class_="laserscan"))
        side = math.ceil(math.sqrt(ROBOTS))
        self.x, self.y = number % side * 4.0, number // side * 4.0
        self.phase = number * 0.7
        chance = np.random.default_rng(number)
        bearings = np.linspace(-math.pi, math.pi, BEAMS, endpoint=False)
        self.scans = []
        for _ in range(STEPS // 2):
            ranges = chance.uniform(0.5, 1.9, BEAMS)
            hits = np.stack((ranges * np.cos(bearings), ranges * np.sin(bearings)), 1)
            self.scans.append((hits * 1000).astype("<i2").tobytes())

    def step(self, number: int) -> None:
        """Show the state of one tick."""
        turn = self.phase + number % STEPS * math.tau / STEPS
        x, y = self.x + math.cos(turn), self.y + math.sin(turn)
        if CONSOLE or not BEAMS:  # sends the age of the pose, too
            turned = Quaternion.from_yaw(turn + math.pi / 2)
            pose = PoseReading(Vector3(x, y, 0.0), turned)
            self.robot.show_pose(pose, time.monotonic())
        else:
            self.robot.svg.set_pose(x, y, turn + math.pi / 2)
        if BEAMS and number % 2 == 0:
            self.dots.set_dots(self.scans[number % STEPS // 2], 0.001)


fleet = [Mover(number) for number in range(ROBOTS)]


def step(number: int) -> None:
    """Move all robots, in the model's thread."""
    for mover in fleet:
        mover.step(number)


def drive() -> None:
    """Request a step at each tick, from a thread that only keeps time."""
    due = time.monotonic()
    number = 0
    while True:
        due += TICK
        time.sleep(max(0.0, due - time.monotonic()))
        number += 1
        try:
            webmap.call(step, number)
        except RuntimeError:
            continue  # not started yet


def main(page: webmap.Page) -> None:
    """Show all robots in the window."""
    side = math.ceil(math.sqrt(ROBOTS)) * 4.0
    map = webmap.Map(page.element("webmap_container"), 1200, 900)
    map.fit(-3.0, -3.0, side + 2.0, side + 2.0)
    for mover in fleet:
        map.add_robot(mover.robot)


if CONSOLE:
    opened = webmap.console.open_console([], [], title="Benchmark")
    for each in fleet:
        opened.add(each.robot)
else:
    webmap.page("/")(main)
threading.Thread(target=drive, daemon=True).start()
webmap.run()
