"""A page with one robot, and user code that blocks when the robot sends a message.

Environment variables have the addresses of the bridges: SAFETY_BRIDGE of the robot;
SAFETY_FLOOD, if set, of ten robots with scans and of a large map; SAFETY_HOSTILE of
robots whose bridges are hostile. With SAFETY_SHOWN the page also shows all data of the
hostile bridges.
"""

import asyncio
import contextlib
import itertools
import os
import time

import webmap
import webmap.base.errors

bridge = webmap.Bridge(os.environ["SAFETY_BRIDGE"])
bob = webmap.Robot("Bob", webmap.svg.circle(cx=0, cy=0, r=0.2, fill="red"))
bob.set_odometry_topic(bridge, "/odom")
bob.set_twist_topic(bridge, "/cmd_vel", stops_within=0.5)


def block(message):
    """Block the model thread, as a callback that waits does."""
    time.sleep(message["data"])


def hold_the_interpreter(message):
    """Block all threads of this process, as a long call of an extension does."""
    until = time.monotonic() + message["data"]
    while time.monotonic() < until:
        # A single call keeps the interpreter lock; a Python loop would release it.
        sum(itertools.repeat(1, 200_000_000))


def call(message):
    """Call a service that may never answer."""

    async def wait():
        with contextlib.suppress(webmap.base.errors.WebMapError):
            await bridge.call_service("/slow", {}, timeout=message["data"])

    tasks.append(asyncio.get_running_loop().create_task(wait()))


tasks = []
bridge.subscribe("/call", call, "std_msgs/Float64")
bridge.subscribe("/block", block, "std_msgs/Float64")
bridge.subscribe("/hold", hold_the_interpreter, "std_msgs/Float64")


scanners, maps = [], None
if flood := os.environ.get("SAFETY_FLOOD"):
    robots, maps = map(webmap.Bridge, flood.split())
    for number in range(10):
        one = webmap.Robot(f"s{number}", webmap.svg.circle(cx=0, cy=0, r=0.2))
        one.set_odometry_topic(robots, f"/robot_{number}/odom")
        topic = f"/robot_{number}/base_scan"
        one.add_module("LaserScanner", robots, topic, max_dots=None, throttle=0)
        scanners.append(one)

hostile, shown = [], []
for url in os.environ.get("SAFETY_HOSTILE", "").split():
    one = webmap.Robot(f"h{len(hostile)}", webmap.svg.circle(cx=0, cy=0, r=0.2))
    one.set_odometry_topic(webmap.Bridge(url), "/odom")
    one.set_twist_topic(webmap.Bridge(url), "/cmd_vel", stops_within=0.5)
    hostile.append(one)
    if os.environ.get("SAFETY_SHOWN"):
        theirs = webmap.Bridge(url)
        one.set_tf(theirs)
        for module in ("Path", "Rosout", "Diagnostics"):
            one.add_module(module, theirs)
        one.add_module("PointCloud", theirs, "/points")
        for topic in ("/camera/image_raw", "/camera/image_raw/compressed"):
            one.add_module("Camera", theirs, topic, topic).watch(lambda: None)
        shown.append(theirs)


@webmap.page("/")
def main(page):
    """Show the selected robot, with teleoperation by keys."""
    map = webmap.Map(page.element("webmap_container"), 400, 300)
    map.add_module("Teleop", 1.0, 1.5)
    map.add_module("StopButton")
    map.scale(40, map.canvas_width * 0.5, map.canvas_height * 0.5)
    if maps is not None:
        map.add_module("OccupancyGrid", maps, "/huge")
    for theirs in shown:
        map.add_module("OccupancyGrid", theirs, "/map")
        map.add_module("Markers", theirs, "/markers")
    for one in [*scanners, *hostile]:
        map.add_robot(one)
    map.add_robot(bob)
    map.set_selected(bob)


webmap.run()
