"""Robots that are gone, or that another program moves."""

import json
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from playwright.sync_api import expect
from websockets.sync.client import connect

from equipment.chromium import watched_tab
from equipment.webmap_process import page_of, simulator

pytestmark = pytest.mark.browser

PROGRAM = """
import webmap
from webmap import console
from webmap.core import robot_state

robot_state.GONE = 3.0
bridge = webmap.Bridge({url!r})
ghost = dict(name="Ghost", bridge=bridge.url, odometry="/ghost/odom", **{more!r})
robot = dict(name="Robot", bridge=bridge.url, odometry="/odom")
robots = [webmap.RobotConfig.from_dict(each) for each in (ghost, robot)]
console.open_console([bridge], robots)
"""


@contextmanager
def odometry(url: str, speed: float = 0.0) -> Iterator[None]:
    """Publish the odometry of a robot until the context ends; ``speed`` is in m/s."""
    pose = {"position": {"x": 1, "y": 2, "z": 0}, "orientation": {"w": 1}}
    message = {
        "header": {"frame_id": "odom", "stamp": {"secs": 0, "nsecs": 0}},
        "child_frame_id": "base_link",
        "pose": {"pose": pose},
        "twist": {"twist": {"linear": {"x": speed}}},
    }
    ended = threading.Event()
    topic = {"topic": "/ghost/odom"}
    with connect(url) as link:

        def publish() -> None:
            while not ended.wait(0.1):
                link.send(json.dumps({"op": "publish", **topic, "msg": message}))

        kind = "nav_msgs/Odometry"
        link.send(json.dumps({"op": "advertise", **topic, "type": kind}))
        thread = threading.Thread(target=publish)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()


def test_a_gone_robot_fades_and_can_be_removed_until_its_poses_return(
    chromium, tmp_path
):
    file = tmp_path / "gone.py"
    with simulator("--flat") as url, watched_tab(chromium, 1280, 800) as page:
        page.allowed = ["WebSocket", "ERR_CONNECTION"]  # when all of it ends
        file.write_text(PROGRAM.format(url=url, more={}))
        with page_of(file) as address:
            row = page.locator("#robots .row", has_text="Ghost")
            drawn = page.locator('.robot[data-name="Ghost"]')
            remove = page.get_by_role("button", name="Remove from page")
            with odometry(url):
                page.goto(address)
                expect(page.locator(".robot:not(.unplaced)")).to_have_count(2)
                row.locator("button").first.click()
                expect(page.locator("#card .state")).to_contain_text("View only")
                expect(remove).to_be_hidden()
            since = re.compile(r"No pose since \d\d:\d\d")
            inner = {"use_inner_text": True}
            expect(page.locator("#card .state")).to_contain_text(since, **inner)
            expect(row).to_contain_text(since, **inner)
            expect(drawn).to_have_css("opacity", "0.25")
            remove.click()
            expect(row).to_have_count(0)
            expect(drawn).to_have_count(0)
            expect(page.locator("#card")).to_be_hidden()
            expect(page.locator("#robots .row")).to_have_count(1)
            page.reload()
            expect(page.locator("#robots .row")).to_have_count(1)
            with odometry(url):
                expect(row).to_have_count(1)
                expect(drawn).to_have_count(1)
                expect(drawn).not_to_have_attribute("data-state", "gone")


def test_a_robot_that_moves_by_itself_is_not_shown_as_free(chromium, tmp_path):
    file = tmp_path / "moves.py"
    with simulator("--flat") as url, watched_tab(chromium, 1280, 800) as page:
        page.allowed = ["WebSocket", "ERR_CONNECTION"]  # when all of it ends
        file.write_text(PROGRAM.format(url=url, more={"twist": "/ghost/cmd_vel"}))
        with page_of(file) as address, odometry(url, speed=0.3):
            page.goto(address)
            row = page.locator("#robots .row", has_text="Ghost")
            row.locator("button").first.click()
            state = "Moved by another program"
            expect(row).to_contain_text(state)
            expect(page.locator("#card .state")).to_contain_text(state)
            expect(page.locator(".webmap-teleop-title")).to_have_text(state)
            speed = page.locator("#card tr", has_text="Speed").locator("td").last
            expect(speed).to_have_text("0.30")
