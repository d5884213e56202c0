"""A console under strain, for `webmap run`.

The environment has ``ROBOTS``, the number of robots, and may have ``BRIDGE``, the
address of a simulator with these robots, of which the last one is removed every two
seconds; a new pose brings a removed robot back. Robots without a bridge get their
poses here, and the state ``STATE``, if that is given, and each page gets a notice.
"""

import asyncio
import math
import os
import time

import webmap
from webmap.base.geometry import Quaternion, Vector3
from webmap.console import open_console
from webmap.core.robot_state import STATE_TEXTS, RobotState
from webmap.core.runtime import runtime
from webmap.poses.placing import PoseReading

ROBOTS = int(os.environ["ROBOTS"])
BRIDGE = os.environ.get("BRIDGE")
ROW = max(1, math.isqrt(ROBOTS))
"""How many robots are beside each other."""

if given := os.environ.get("STATE"):
    text = STATE_TEXTS[given]
    state = RobotState(given, given, (), text, text, text, "")
    webmap.Robot.state = property(lambda robot: state)


def config(number: int) -> webmap.RobotConfig:
    given = {"name": f"Robot {number}"}
    if BRIDGE is not None:
        given |= {"bridge": BRIDGE, "odometry": f"/robot_{number}/odom"}
    return webmap.RobotConfig.from_dict(given)


bridges = [] if BRIDGE is None else [webmap.Bridge(BRIDGE)]
configs = [config(number) for number in range(ROBOTS)]
console = open_console(bridges, configs, title="Strained")


async def give_poses() -> None:
    """Give every robot its pose repeatedly."""
    while True:
        now = time.monotonic()
        for index, robot in enumerate(console.given):
            position = Vector3(2.0 * (index % ROW), 2.0 * (index // ROW), 0.0)
            robot.show_pose(PoseReading(position, Quaternion.from_yaw(now)), now)
        await asyncio.sleep(0.2)


async def remove() -> None:
    """Remove the last robot from all pages repeatedly."""
    while True:
        await asyncio.sleep(2.0)
        console.remove(console.given[-1])


class Strain:
    """A module of maps that starts when the first page opens."""

    task: asyncio.Task[None] | None = None

    def __init__(self, map: webmap.Map) -> None:
        if Strain.task is None:
            work = give_poses() if BRIDGE is None else remove()
            Strain.task = asyncio.get_running_loop().create_task(work)
        if given:
            asyncio.get_running_loop().call_later(1.0, runtime.notice, "A notice.")


console.add_module(Strain)
webmap.run()
