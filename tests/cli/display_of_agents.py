"""A display without pages: watches the cameras of all robots and prints changes.

Run with the URL of a router. Each line is a JSON list of all robots with their cameras,
problems and pictures. A line on standard input ends the watching; a second line ends
the process.
"""

import io
import json
import sys
import threading
import time

from PIL import Image

from webmap.console import Console
from webmap.core.pictures import pictures
from webmap.core.runtime import runtime
from webmap.features.cameras.camera_panel import cameras_of
from webmap.fleet.remote_robots import find_agents


def seen(robot):
    """Return what pages show about a robot."""
    images = [each for each in robot.svg.walk() if getattr(each, "tag", "") == "image"]
    return {
        "name": robot.name,
        "cameras": {each.name: picture(each) for each in cameras_of(robot)},
        "problems": sorted(robot.problems.values()),
        "pictures": [
            pictures.get(each.get("href").rpartition("/")[2]).media_type
            for each in images
        ],
    }


def picture(camera):
    """Return the red value and the age in seconds of a camera's newest picture."""
    if camera.url is None:
        return None
    image = Image.open(io.BytesIO(pictures.get(camera.url.rpartition("/")[2]).data))
    return [image.getpixel((8, 6))[0], round(time.monotonic() - camera.stamp, 3)]


def main(router):
    console, watching, ended = Console(), {}, threading.Event()

    def look(last):
        for robot in console.robots:
            for camera in cameras_of(robot):
                if camera not in watching and not ended.is_set():
                    watching[camera] = camera.watch(lambda: None)
        if ended.is_set():
            for each in watching.values():
                each.remove()
            watching.clear()
        now = [seen(robot) for robot in console.robots]
        if now != last:
            print(json.dumps(now), flush=True)
        runtime._loop.call_later(0.05, look, now)

    for agents in find_agents([router], []):
        agents.show_on(console)
    runtime.start()
    runtime.call(look, None)
    sys.stdin.readline()
    ended.set()
    sys.stdin.readline()
    runtime.stop()


if __name__ == "__main__":
    main(sys.argv[1])
