"""The driver reads on the console which other program drives the same robot."""

import json
import threading

import pytest
from playwright.sync_api import expect
from websockets.sync.client import connect

from equipment.chromium import hold, watched_tab
from equipment.webmap_process import webmap
from webmap.testing import WitnessRobot

pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.serial]

NAMED = "nother program publishes to /cmd_vel (0.10 m/s, 0.00 rad/s): /teleop_node"

SOON = 30_000


@pytest.fixture
def robot():
    """A robot to which a second program writes 0.1 m/s."""
    over = threading.Event()

    def write(port):
        none = {"x": 0.0, "y": 0.0, "z": 0.0}
        twist = {"linear": {**none, "x": 0.1}, "angular": none}
        message = {"op": "publish", "topic": "/cmd_vel", "msg": twist}
        with connect(f"ws://127.0.0.1:{port}", compression=None) as socket:
            while not over.wait(0.1):
                socket.send(json.dumps(message))

    with WitnessRobot(timeout=0.5) as robot:
        nodes = ["/rosbridge_websocket", "/teleop_node"]
        robot._bridge.publishers["/cmd_vel"] = nodes
        thread = threading.Thread(target=write, args=(robot.port,))
        thread.start()
        yield robot
        over.set()
        thread.join(10)


def test_the_bar_names_another_program_while_one_drives_and_the_alarm_afterwards(
    robot, chromium, tmp_path
):
    options = ("--port", "0", "--no-browser")
    with (
        webmap("view", robot.url, *options, WEBMAP_STATE_DIR=str(tmp_path)) as url,
        watched_tab(chromium, 1024, 600) as page,
    ):
        page.goto(url)
        row = page.locator("#robots .row")
        expect(row).to_have_count(1, timeout=SOON)
        row.get_by_role("button").first.click()
        title = page.locator(".webmap-teleop-title")
        moved = "Moved by another program: /teleop_node"
        expect(title).to_have_text(moved, timeout=SOON)
        expect(row.locator(".state")).to_contain_text(moved)
        driving = "You are driving · moved by another program: /teleop_node"
        hold(page.keyboard, "w", lambda: title.text_content() == driving)
        detail = page.locator(".drive-bar .webmap-teleop-detail")
        expect(detail).to_be_visible()
        expect(detail).to_contain_text(NAMED)
        box = detail.bounding_box()
        assert box["x"] >= 0
        assert box["x"] + box["width"] <= 1024
        page.keyboard.up("w")
        # The robot goes on, by the other program alone.
        alarm = page.locator(".webmap-alarm")
        expect(alarm).to_contain_text("ROBOT NOT OBEYING", timeout=5_000)
        expect(alarm).to_contain_text(NAMED)
