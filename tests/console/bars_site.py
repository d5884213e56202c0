"""A console whose bars have long texts, for `webmap run`.

The environment has ``BRIDGE``, the address of a simulator with three robots. Two other
bridges cannot be reached, the names of the site and of two robots have 200 characters,
and messages are refused every ten seconds.
"""

import asyncio
import os

import webmap
from webmap.console import open_console
from webmap.console.bar import now

WIDE, RIGHT_TO_LEFT = "W" * 200, "\u05e8\u05d5\u05ea \u05dc\u05d5\u05d9 " * 25
NAMES = ("Robot 0", WIDE, RIGHT_TO_LEFT)

addresses = [os.environ["BRIDGE"], "ws://127.0.0.1:9", "ws://127.0.0.1:10"]
configs = [
    webmap.RobotConfig.from_dict(
        {
            "name": name,
            "bridge": addresses[0],
            "odometry": f"/robot_{number}/odom",
            "twist": f"/robot_{number}/cmd_vel",
            "cameras": [{"topic": f"/robot_{number}/camera/image/compressed"}],
        }
    )
    for number, name in enumerate(NAMES)
]
console = open_console([webmap.Bridge(a) for a in addresses], configs, title=WIDE)


async def refuse() -> None:
    """Count refused messages repeatedly, as they are shown for a minute only."""
    while True:
        webmap.refusals.note(WIDE, 100, "drive: too old (over 300 ms)", now())
        await asyncio.sleep(10)


class Refuse:
    """A module of maps that starts when the first page opens."""

    task: asyncio.Task[None] | None = None

    def __init__(self, map: webmap.Map) -> None:
        if Refuse.task is None:
            Refuse.task = asyncio.get_running_loop().create_task(refuse())


console.add_module(Refuse)
webmap.run()
