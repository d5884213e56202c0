"""A page whose robot sends plans with a NaN until a key is pressed.

Run by ``webmap run``; the messages are decoded as those of a robot are.
"""

import asyncio
import math

from module_fakes import Link, header, pose

import webmap

link = Link()
ann = webmap.Robot("Ann")
for topic in ("/plan", "/plan_of_ann"):
    ann.add_module("Path", link, topic)
broken = {"/plan": True, "/plan_of_ann": False}
PERIOD = 0.05


def plan(number: int, last_y: float) -> dict:
    """Return a plan that begins at the robot, which moves all the time."""
    points = [(number * 0.013, 0.5), (2.0 + number * 0.1, last_y)]
    poses = [{"header": header(), "pose": pose(*at)} for at in points]
    return {"header": header(), "poses": poses}


async def go_on() -> None:
    for number in range(100_000):
        for topic, bad in broken.items():
            link.publish(topic, plan(number, math.nan if bad else 1.0))
        await asyncio.sleep(PERIOD)


going: set[asyncio.Task] = set()


def press(event) -> None:
    """Break or repair the first plan, or break the second plan."""
    if event.key == "m":
        broken["/plan"] = not broken["/plan"]
    if event.key == "b":
        broken["/plan_of_ann"] = True


@webmap.page("/")
def build(page) -> None:
    map = webmap.Map(page.element("webmap_container"))
    map.add_robot(ann)
    map.add_module("MeasureTool")
    map.on(map.root, "keydown", press)
    map.fit(-3.5, -2.5, 7, 5)
    if not going:
        going.add(asyncio.get_running_loop().create_task(go_on()))
