"""Drives a simulated robot as a user's program does, and prints the results."""

import asyncio
import json
import math
import sys
import time

import webmap
from webmap.base.errors import NoLease
from webmap.base.geometry import Pose, Quaternion, Vector3

GOAL = "/move_base_simple/goal"

bridge = webmap.Bridge(sys.argv[1])
bob = webmap.Robot("Bob")
bob.set_odometry_topic(bridge, "/odom", 50)
bob.set_twist_topic(bridge, "/cmd_vel", stops_within=0.25)
bob.set_move_topic(bridge, GOAL, cancel_topic="/move_base/cancel")
bob.set_alignment(10.0, 0.0, 90.0)
# A robot on the same machine that can only navigate.
ann = webmap.Robot("Ann")
ann.set_move_topic(bridge, GOAL)
received: dict[str, object] = {}


class SentCommands:
    """Records the commands that the gate sent."""

    def __init__(self, robot) -> None:
        self.twists: list[dict] = []
        self.goals: list[dict] = []

    def on_send_twist(self, msg) -> None:
        self.twists.append(msg)

    def on_send_move(self, msg) -> None:
        self.goals.append(msg)


async def repeat(act, until, what: str) -> None:
    """Call ``act`` at 20 Hz until the condition holds.

    On a busy machine the way to the robot may be slow and the gate end the lease.
    """
    deadline = time.monotonic() + 20.0
    while not until():
        assert time.monotonic() < deadline, what
        try:
            act()
        except NoLease:
            await bob.acquire_lease(timeout=20.0)
        await asyncio.sleep(0.05)


def outcome_of(act) -> str:
    """Return "taken" if the gate's client accepts a command."""
    try:
        act()
    except NoLease as error:
        return type(error).__name__
    return "taken"


async def drive() -> None:
    sent_commands = bob.add_module(SentCommands)
    seen: list[dict] = []
    bridge.subscribe(GOAL, seen.append, "geometry_msgs/PoseStamped")
    # Directly after the start: the gate and the link are not ready yet.
    received["epoch"] = await bob.acquire_lease(timeout=20.0)
    begun = bob.yaw
    await repeat(
        lambda: bob.twist(0.1, rz=0.5),
        lambda: abs(math.remainder(bob.yaw - begun, math.tau)) > 0.1,
        "odometry does not turn",
    )
    received["twists"] = [
        (msg["linear"]["x"], msg["angular"]["z"]) for msg in sent_commands.twists
    ]
    # One metre ahead of the robot.
    at = Pose(bob.position.x, bob.position.y, bob.yaw) @ Pose(1.0, 0.0, 0.0)
    place, turn = Vector3(at.x, at.y), Quaternion.from_yaw(at.yaw)
    # A goal is refused until the robot has stopped.
    await repeat(
        lambda: sent_commands.goals or bob.move(place, turn),
        lambda: sent_commands.goals and seen,
        "no goal arrives",
    )
    received["asked"] = (at.x, at.y)
    received["sent goal"] = [sent_commands.goals[0]["position"][axis] for axis in "xy"]
    received["published goal"] = [seen[0]["pose"]["position"][axis] for axis in "xy"]
    received["frame"] = seen[0]["header"]["frame_id"]
    bob.release_lease()
    received["twist afterwards"] = outcome_of(lambda: bob.twist(0.1))
    received["move afterwards"] = outcome_of(lambda: bob.move(place, turn))
    received["epoch of goals alone"] = await ann.acquire_lease()


def main() -> None:
    webmap.start()
    try:
        webmap.call(drive)
    finally:
        webmap.stop()
    print(json.dumps(received))


main()
