"""WebMap runs on machines with an unusual environment."""

import re
import subprocess
import sys

import pytest
from playwright.sync_api import expect

from equipment.chromium import end_stops, watched_tab
from equipment.environment import unusual_environment

pytestmark = [pytest.mark.browser, pytest.mark.slow]


@pytest.fixture
def url(tmp_path):
    command = [sys.executable, "-m", "webmap", "demo", "--robots", "1", "--quiet"]
    # Without a folder for its state WebMap lets nobody drive.
    state = {"WEBMAP_STATE_DIR": str(tmp_path / "own state")}
    with subprocess.Popen(
        [*command, "--port", "0", "--no-browser"],
        stdout=subprocess.PIPE,
        text=True,
        env=unusual_environment(tmp_path) | state,
        umask=0o077,
    ) as demo:
        yield re.search(r"ready at (\S+)", demo.stdout.readline())[1]
        demo.terminate()
        demo.wait(60)


def test_a_robot_is_driven_and_stopped_in_an_unusual_environment(chromium, url):
    with watched_tab(chromium, 1280, 800) as page:
        page.goto(url)
        page.locator("#robots .row button").first.click()
        page.locator(".webmap-teleop-lease").click()
        title = page.locator(".webmap-teleop-title")
        expect(title).to_have_text("You have control")
        page.locator(".webmap-teleop-stop").click()
        expect(title).to_have_text("STOP active")
        end_stops(page.locator(".webmap-teleop .webmap-reset"))
