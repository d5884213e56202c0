"""A script without a page: it drives a robot, sends it to a goal, and waits for it.

Start a rosbridge on the robot, or the simulator in its place, and then this::

    webmap sim --flat
    python examples/script/script.py
"""

import asyncio

import webmap
from webmap.base.geometry import Quaternion

bridge = webmap.Bridge("ws://localhost:9090")
bob = webmap.Robot("Bob")
bob.set_odometry_topic(bridge, "/odom")
bob.set_twist_topic(bridge, "/cmd_vel", stops_within=0.25)
bob.set_move_topic(
    bridge, action="/move_base", action_type="move_base_msgs/MoveBaseAction"
)


async def drive_and_return() -> str:
    """Drive for two seconds, then go back to the start; return how the goal ended."""
    # Control of the robot: the gate accepts commands of this program only.
    await bob.acquire_lease()
    try:
        start, heading = bob.position, bob.yaw
        # A velocity is valid for 0.2 s, so it is sent again and again.
        for _ in range(40):
            bob.twist(0.3)
            await asyncio.sleep(0.05)
        # The robot stops now. The gate refuses a goal until it has stopped.
        async with asyncio.timeout(5.0):  # a STOP may come, or another operator
            while bob.report.state != "held":
                await asyncio.sleep(0.05)
        bob.move(start, Quaternion.from_yaw(heading))
        while bob.goal_ended_at is None:
            await asyncio.sleep(0.1)
        return bob.report.goal.state
    finally:
        bob.release_lease()


webmap.start()
try:
    # Robots belong to WebMap's thread; webmap.call waits until the function has ended.
    print("The goal is", webmap.call(drive_and_return))
finally:
    webmap.stop()
