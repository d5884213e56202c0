"""WebMap as a part of another application, under a prefix."""

import re
import subprocess
import sys

import pytest
from robots import Witness

from equipment.chromium import hold
from equipment.processes import BRIDGE, running
from equipment.waiting import wait_for

pytestmark = pytest.mark.browser

HOST = """
import contextlib, sys
import fastapi, uvicorn, webmap

bridge = webmap.Bridge(sys.argv[1])
bob = webmap.Robot("Bob")
bob.set_odometry_topic(bridge, "/odom")
bob.set_twist_topic(bridge, "/cmd_vel", stops_within=0.25)

@webmap.page("/")
def main(page):
    map = webmap.Map(page.element("webmap_container"))
    map.add_module("MouseViewControl")
    map.add_module("Teleop", 1.0, 1.5)
    map.add_robot(bob)
    map.scale(20)
    map.follow(bob)

@contextlib.asynccontextmanager
async def lifespan(app):
    webmap.start()
    yield
    webmap.stop()

app = fastapi.FastAPI(lifespan=lifespan)

@app.get("/")
def home() -> dict:
    return {"hello": "host"}

fleet = webmap.asgi_app()
app.mount("/robots/lab", fleet)
print("token", fleet.settings.token, flush=True)
uvicorn.run(app, port=0, log_level="info", ws="websockets-sansio")
"""


@pytest.fixture(scope="module")
def simulator():
    with running("sim", "--flat", "--port", 0, "--seed", 7, pattern=BRIDGE) as process:
        yield process.url


@pytest.fixture(scope="module")
def host(simulator, tmp_path_factory):
    script = tmp_path_factory.mktemp("host") / "host.py"
    script.write_text(HOST)
    process = subprocess.Popen(
        [sys.executable, str(script), simulator],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    token = process.stdout.readline().split()[1]
    for line in process.stderr:
        found = re.search(r"running on (http://127\.0\.0\.1:\d+)", line)
        if found:
            break
    yield found[1], token
    process.terminate()
    _, rest = process.communicate(timeout=60)  # the machine may be busy
    assert "Traceback" not in rest, rest


def test_a_page_mounted_under_a_prefix_shows_and_drives_a_robot(host, simulator, tab):
    url, token = host
    witness = Witness(simulator)
    witness.follow("/odom", "nav_msgs/Odometry")
    tab.goto(f"{url}/robots/lab/?token={token}")
    assert tab.url == f"{url}/robots/lab/"
    robot = tab.locator(".robot:not(.unplaced)")
    robot.wait_for(state="attached")
    tab.get_by_role("button", name="STOP").wait_for()
    (cookie,) = tab.context.cookies()
    assert cookie["path"] == "/robots/lab/"
    assert cookie["httpOnly"]
    assert cookie["sameSite"] == "Strict"
    tab.locator(".robot .model").click()
    tab.locator(".robot.selected").wait_for()
    hold(tab.keyboard, "w", lambda: witness.speed("/odom")[0] > 0.2)
    tab.keyboard.up("w")
    wait_for(lambda: witness.speed("/odom") == (0.0, 0.0), what="standing still")
    witness.close()


def test_the_host_application_keeps_its_own_pages(host, tab):
    url, _ = host
    tab.allowed.append("404")  # the host has no icon
    tab.goto(url)
    assert "hello" in tab.content()
