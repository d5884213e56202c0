"""Cameras over HTTP and pictures of robots: a router, an agent and two displays."""

import json
import os
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from equipment.camera_server import CameraServer
from equipment.waiting import wait_for
from equipment.webmap_process import simulator, webmap
from webmap.base.tasks import LoopThread

pytestmark = pytest.mark.slow

pytest.importorskip("zenoh")

FLEET = """
[bridges]
forklift = "{bridge}"

[[robots]]
name = "Forklift"
odometry = "/robot_0/odom"
cameras = [
  {{ url = "{front}", name = "Front", throttle = 50 }},
  {{ url = "{gone}", name = "Rear" }},
]

[robots.picture]
file = "forklift.svg"
width = 1.2
height = 0.8
"""

SVG = '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 3 2"><path d="M0 0"/></svg>'

SVG_TYPE = "image/svg+xml; charset=utf-8"

USERS = """
[users.bay3]
password = "one"
agent = "bay3"

[users.west]
password = "two"
drives = ["bay3"]
"""


@pytest.fixture
def camera():
    """A camera server in a separate thread."""
    thread = LoopThread("camera")
    server = CameraServer()
    thread.call(server.__aenter__())
    yield server
    thread.call(server.__aexit__())
    thread.end()


def as_user(name, password):
    return {"WEBMAP_ROUTER_USER": name, "WEBMAP_ROUTER_PASSWORD": password}


class Display:
    """A display without pages, as a separate process."""

    def __init__(self, process):
        self._process = process
        self.robots = []
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self._process.stdout:
            self.robots = json.loads(line)

    @property
    def robot(self):
        empty = {"cameras": {}, "problems": [], "pictures": []}
        return self.robots[0] if self.robots else empty

    @property
    def front(self):
        return self.robot["cameras"].get("Front")

    def look_away(self):
        self._process.stdin.write("\n")
        self._process.stdin.flush()


@contextmanager
def display(router, **environment):
    file = Path(__file__).with_name("display_of_agents.py")
    with subprocess.Popen(
        [sys.executable, file, router],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | environment,
    ) as process:
        try:
            yield Display(process)
        finally:
            process.terminate()
            process.wait(60)


def test_displays_show_cameras_and_the_picture_that_only_the_agent_reaches(
    camera, tmp_path
):
    camera.scripts["/gone"] = (b"HTTP/1.1 404 No\r\n\r\n", True)
    front = camera.at("/stream?topic=/front").replace("//", "//me:secret@", 1)
    (tmp_path / "forklift.svg").write_text(SVG)
    users, file = tmp_path / "users.toml", tmp_path / "bay3.toml"
    users.write_text(USERS)
    west = as_user("west", "two")
    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0", "--users", users) as router,
        simulator("--robots", "1") as url,
    ):
        text = FLEET.format(bridge=url, front=front, gone=camera.at("/gone"))
        file.write_text(text)
        options = ("--router", router, "--name", "bay3")
        state = {"WEBMAP_STATE_DIR": str(tmp_path)}
        with (
            webmap("agent", file, *options, **as_user("bay3", "one"), **state),
            display(router, **west) as ann,
            display(router, **west) as ben,
        ):
            for each in (ann, ben):
                wait_for(lambda each=each: each.front and each.robot["problems"])
                wait_for(lambda each=each: each.robot["pictures"])
                assert each.robot["pictures"] == [SVG_TYPE]
                (problem,) = each.robot["problems"]
                gone = camera.at("/gone")
                assert problem == (
                    f"Rear at {gone} through the agent bay3: it answers 404: there is "
                    "nothing at this address"
                )
            # The agent, which has the password, opens one stream for both displays.
            streams = [head for head in camera.asked if "/stream" in head]
            assert (len(streams), "Authorization: Basic " in streams[0]) == (1, True)
            reds = {ann: set(), ben: set()}

            def both_get_pictures():
                for each, found in reds.items():
                    found.add(each.front and each.front[0])
                return min(map(len, reds.values())) > 5

            wait_for(both_get_pictures)
            # A frozen camera is detected by the growing age of its picture.
            camera.frozen = True
            wait_for(lambda: ann.front[1] > 1.0 and ben.front[1] > 1.0)
            camera.frozen = False
            wait_for(lambda: ann.front[1] < 1.0)
            ann.look_away()
            wait_for(lambda: ann.front is None)
            before = ben.front
            wait_for(lambda: ben.front != before)
            ben.look_away()
            wait_for(lambda: camera.open == 0)
            asked = len(camera.asked)
            time.sleep(1.0)
            assert len(camera.asked) == asked
