"""A program for ``webmap run``: the console with the robots of ``busy_robots``.

``FLEET_URL`` is the address of their rosbridge, ``FLEET_ROBOTS`` their number, and
``FLEET_BEAMS`` the beams of a scan; 0 for robots without scans. For each line of
its input, it prints the number of messages that it has received.
"""

import os
import sys
import threading
from typing import Any

import webmap
import webmap.console

URL = os.environ["FLEET_URL"]
SCANS = int(os.environ["FLEET_BEAMS"]) > 0


def config(number: int) -> webmap.RobotConfig:
    """Return a robot with the configuration of a robot that ``webmap view`` finds."""
    topics = f"/robot_{number}"
    modules: list[dict[str, Any]] = [{"name": "Trail", "options": {"length": 10.0}}]
    if SCANS:
        arguments = [{"bridge": URL}, f"{topics}/base_scan"]
        options = {"max_dots": {"none": True}, "throttle": 100}
        modules.append({"name": "LaserScanner", "args": arguments, "options": options})
    data = {
        "name": f"robot {number}",
        "bridge": URL,
        "odometry": {"topic": f"{topics}/odom", "type": "nav_msgs/Odometry"},
        "twist": {"topic": f"{topics}/cmd_vel", "stops_within": 0.25},
        "modules": modules,
    }
    return webmap.RobotConfig.from_dict(data)


def answer() -> None:
    """Print the number of messages for each line of the input."""
    for _ in sys.stdin:
        print(bridge.stats.frames, flush=True)


bridge = webmap.Bridge(URL)
threading.Thread(target=answer, daemon=True).start()
robots = [config(number) for number in range(int(os.environ["FLEET_ROBOTS"]))]
webmap.console.open_console([bridge], robots, title="Benchmark")
webmap.run()
