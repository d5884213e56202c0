"""Flies a robot as a user's program does, and prints the results."""

import asyncio
import json
import threading
import time

import webmap
from webmap.base.errors import MotionError, NoLease
from webmap.testing import Bounds, WitnessRobot, check_invariants

LIMITS = {"z_max": 0.5, "rx_max": 0.2, "ry_max": 0.1}
PATIENCE = 20.0
received: dict[str, object] = {}


async def repeat(act, until, what: str) -> None:
    """Call ``act`` at 20 Hz until the condition holds."""
    deadline = time.monotonic() + PATIENCE
    while not until():
        assert time.monotonic() < deadline, what
        act()
        await asyncio.sleep(0.05)


async def fly(base: WitnessRobot) -> None:
    bridge = webmap.Bridge(base.url)
    bob = webmap.Robot("Bob")
    bob.set_odometry_topic(bridge, base.ODOMETRY_TOPIC, type="nav_msgs/Odometry")
    known = {"type": "geometry_msgs/Twist", "stops_within": 0.5}
    known |= {"v_max": 1.0, "w_max": 1.0}
    bob.set_twist_topic(bridge, base.TWIST_TOPIC, **known)
    await bob.acquire_lease(timeout=PATIENCE)
    try:
        bob.twist(0.1, z=0.3)
    except MotionError as error:
        received["without a limit"] = str(error)
    received["moved without a limit"] = len(base.log.moving_since(0.0))

    bob.set_twist_topic(bridge, base.TWIST_TOPIC, **known, **LIMITS)
    await bob.acquire_lease(timeout=PATIENCE)

    def climb() -> None:
        try:
            bob.twist(0.05, z=0.9, rx=0.1, ry=-0.05, rz=0.2)
        except NoLease:  # busy machine: take control again
            bob.motion.commands().take(bob.id)

    await repeat(climb, lambda: bob.position.z > 0.2, "odometry does not climb")
    received["twists"] = [
        received.twist.numbers for received in base.log.moving_since(0.0)
    ]

    base.obeys = False  # it keeps its last velocity
    bob.stop()
    stop = lambda: bob.report is not None and bob.report.stop  # noqa: E731
    await repeat(
        lambda: None,
        lambda: stop() and stop().confirmed is not None,
        "no report of the stop",
    )
    received["a robot that climbs on"] = (stop().confirmed, stop().why)
    received["measured"] = bob.report.measured
    received["last"] = base.log.twists[-1].twist.numbers
    base.obeys = True
    await repeat(lambda: None, lambda: stop().confirmed, "the robot does not stop")
    received["standing"] = bob.report.measured
    received["wrong"] = check_invariants(
        base.log.twists, Bounds(v_max=1.0, z_max=0.5, zeros=PATIENCE)
    )


def main() -> None:
    done = threading.Event()
    tasks = []

    def begin() -> None:
        tasks.append(asyncio.get_running_loop().create_task(fly(base)))
        tasks[0].add_done_callback(lambda _: done.set())

    # No timeout in the base, so it keeps climbing when it does not obey.
    with WitnessRobot(timeout=None, flies=True) as base:
        webmap.start()
        webmap.call(begin)
        done.wait(90)
        webmap.stop()
    tasks[0].result()  # raises the error of the program, if any
    print(json.dumps(received))


main()
