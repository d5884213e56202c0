"""A program on a display: drives the robot of an agent and prints the results.

Run with the URL of a router that has one agent with one robot.
"""

import asyncio
import json
import math
import sys
import threading
import time

from webmap.base.errors import NoLease
from webmap.base.geometry import Quaternion, Vector3
from webmap.console import Console
from webmap.core.runtime import runtime
from webmap.fleet.remote_robots import find_agents

console = Console()


async def until(check, act=lambda: None):
    """Call ``act`` at 20 Hz until ``check`` returns true."""
    deadline = time.monotonic() + 30.0
    while not check():
        assert time.monotonic() < deadline, "the condition did not become true"
        act()
        await asyncio.sleep(0.05)


async def driven():
    """Drive the robot, then send it to a goal; return the results."""
    await until(lambda: console.robots)
    (robot,) = console.robots
    await until(lambda: robot.report is not None)
    try:
        epoch = await robot.acquire_lease(timeout=20.0)
    except NoLease as error:
        return {"refused": str(error)}
    begun = robot.yaw
    turned = lambda: abs(math.remainder(robot.yaw - begun, math.tau)) > 0.1  # noqa: E731
    await until(turned, lambda: robot.twist(0.0, rz=0.5))
    result = {"epoch": epoch == robot.report.epoch}
    result["holder"] = robot.report.holder.name
    await until(
        lambda: robot.report.state == "held"
    )  # the program no longer sends velocities
    place = Vector3(robot.position.x, robot.position.y)
    robot.move(place, Quaternion.from_yaw(begun))
    await until(lambda: robot.report.goal is not None)
    result["goal by"] = robot.report.goal.by
    robot.cancel()
    robot.release_lease()
    await until(lambda: robot.report.holder is None)
    try:
        robot.twist(0.1)
    except NoLease:
        result["afterwards"] = "NoLease"
    return result


def main(router):
    done, tasks = threading.Event(), []

    def begin():
        tasks.append(asyncio.get_running_loop().create_task(driven()))
        tasks[0].add_done_callback(lambda _: done.set())

    for agents in find_agents([router], []):
        agents.show_on(console)
    runtime.start()
    runtime.call(begin)
    done.wait(90)
    result = tasks[0].result()
    runtime.stop()
    print(json.dumps(result))


if __name__ == "__main__":
    main(sys.argv[1])
