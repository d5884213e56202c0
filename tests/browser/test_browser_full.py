"""A page beyond the limit of pages: it has no picture, and can still stop robots."""

import pytest
from playwright.sync_api import expect

from equipment.processes import WEB, running
from webmap.testing.witness import WitnessRobot

pytestmark = pytest.mark.browser

SCRIPT = """
import webmap

bridge = webmap.Bridge("{url}")
bob = webmap.Robot("Bob")
bob.set_odometry_topic(bridge, "/odom")
bob.set_twist_topic(bridge, "/cmd_vel")

@webmap.page("/")
def main(page):
    map = webmap.Map(page.element("webmap_container"))
    map.add_robot(bob)
    map.add_module("StopButton")

webmap.run(max_pages=1)
"""


@pytest.fixture
def server(tmp_path):
    """A server with one place, and one robot."""
    with WitnessRobot() as robot:
        script = tmp_path / "page.py"
        script.write_text(SCRIPT.format(url=robot.url))
        command = ("run", script, "--port", 0, "--no-browser")
        with running(*command, pattern=WEB) as process:
            yield process


@pytest.mark.parametrize("act", ["button", "Space", "Shift+Escape"])
def test_a_page_without_a_place_stops_all_robots(server, tab, other, act):
    tab.goto(server.url)
    tab.wait_for_selector("svg.webmap")
    other.goto(server.url)
    expect(other.get_by_text("too many open pages")).to_be_visible()
    stop = other.get_by_role("button", name="STOP ALL")
    expect(stop).to_be_visible()
    if act == "button":
        stop.click()
    else:
        other.keyboard.press(act)
    for page in (tab, other):
        expect(page.get_by_text("STOP active: Bob")).to_be_visible()
