"""``webmap view`` draws all that simulated robots say, and nobody told it anything."""

import math
import re
import subprocess
import sys

import pytest
from playwright.sync_api import Browser
from running_simulators import simulators

from real_browser import watched_tab

pytestmark = pytest.mark.browser

VIEW = [sys.executable, "-m", "webmap", "view"]

# What each robot has; costmaps and markers are on the map.
OF_A_ROBOT = (
    ".laserscan > .dot[d]",
    ".pointcloud > .dot.band-7[d]",
    ".path > polyline",
    ".trail",
    ".posearray > .arrow[d]",
    ".covariance > .ellipse[rx]",
    ".polygon > polygon[points]",
    ".range > .cone[d]",
    ".navsatfix > .cross:not([visibility])",
    ".diagnostics.ok",
)
ON_THE_MAP = {
    ".occupancy-grid.map > image[href]": 1,
    ".occupancy-grid.costmap > image[href]": 2,
    ".markers": 2,
}


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_all_that_robots_say_is_drawn(chromium: Browser, dialect):
    with simulators(dialect) as found:
        world = found[dialect].world
        process = subprocess.Popen(
            [*VIEW, found[dialect].url, "--port", "0", "--no-browser"],
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            url = re.search(r"http\S+", process.stdout.readline())
            with watched_tab(chromium, 1000, 700) as tab:
                tab.set_default_timeout(20_000)
                tab.goto(url.group(0))
                for selector in OF_A_ROBOT:
                    for name in ("robot_0", "robot_1"):
                        inside = f'.robot[data-name="{name}"] {selector}'
                        tab.wait_for_selector(inside, state="attached")
                for selector, count in ON_THE_MAP.items():
                    tab.locator(selector).nth(count - 1).wait_for(state="attached")
                    assert tab.locator(selector).count() == count
                x, y = tab.evaluate(
                    PLACE, '[data-name="robot_1"] .covariance > .ellipse'
                )
                pose = world.robots[1].pose
                assert math.dist((x, y), (pose.x, pose.y)) < 0.05
                assert tab.locator(".webmap-notice").count() == 0
        finally:
            process.terminate()
            process.wait(10)
            process.stdout.close()


PLACE = """(selector) => {
  const world = document.querySelector("svg.webmap .world").getScreenCTM().inverse();
  const m = world.multiply(document.querySelector(selector).getScreenCTM());
  return [m.e, m.f];
}"""
