"""A console with many robots in given states, for `webmap run`.

The robots have no bridge: their poses and states are given here, so that a test shows
every state at once. What makes a robot have a state is tested in tests/core.
"""

import asyncio
import time

import webmap
from webmap.base.geometry import Quaternion, Vector3
from webmap.console import open_console
from webmap.core.robot_state import STATE_TEXTS, RobotState
from webmap.poses.placing import PoseReading

NAMES = [
    *(f"Robot {number}" for number in range(1, 25)),
    "x" * 200,
    "عربة التوصيل رقم ٧",  # noqa: RUF001
    "🤖🚚 Zwilling 👩‍👩‍👧‍👦",
    "Twin",
    "Twin",
    "<b>&amp;</b>",
]
STATES = ["stopped", "stopped", "lost", "battery_low", "driven", "navigating"]

CONDITIONS = ("battery_low", "goal_failed", "blocked")

GIVEN: dict[str, str] = {}
"""The state of each robot that is not free, by the id of the robot."""


def state(robot: webmap.Robot) -> RobotState:
    name = GIVEN.get(robot.id, "free")
    text = STATE_TEXTS[name].format(who="Ann", since="10:32")
    if name in CONDITIONS:
        activity = "navigating" if name == "battery_low" else "free"
        doing = STATE_TEXTS[activity]
        return RobotState(name, activity, (name,), doing, doing, doing, text.lower())
    return RobotState(name, name, (), text, text, text, "")


webmap.Robot.state = property(state)
configs = [
    webmap.RobotConfig(name=name, tags=[f"bay {index % 3}"] if index < 24 else [])
    for index, name in enumerate(NAMES)
]
console = open_console([], configs, title="Crowd")
GIVEN |= {robot.id: s for robot, s in zip(console.given, STATES, strict=False)}


def place(index: int) -> tuple[float, float]:
    """Return the place of a robot: the first 20 are far apart, the others are close."""
    if index < 20:
        return 3.0 * (index % 5), 3.0 * (index // 5)
    return 18.0 + 0.2 * (index % 5), 4.0 + 0.2 * (index // 5)


async def give_poses() -> None:
    """Give every robot its pose repeatedly, so that no pose is stale."""
    while True:
        for index, robot in enumerate(console.given):
            position = Vector3(*place(index), 0.0)
            reading = PoseReading(position, Quaternion.from_yaw(index))
            robot.show_pose(reading, time.monotonic())
        await asyncio.sleep(0.2)


class Poses:
    """A module of maps that starts to give poses when the first page opens."""

    task: asyncio.Task[None] | None = None

    def __init__(self, map: webmap.Map) -> None:
        if Poses.task is None:
            Poses.task = asyncio.get_running_loop().create_task(give_poses())


console.add_module(Poses)
webmap.run()
