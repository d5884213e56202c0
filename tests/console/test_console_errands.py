"""The robots of the lively demo that drive on their own, under an operator."""

import pytest
from console_ready import expect_state, select, wait_until_ready
from playwright.sync_api import expect

from equipment.chromium import watched_tab
from equipment.webmap_process import webmap

pytestmark = [pytest.mark.browser, pytest.mark.slow]

PLACE = """() => {
  const { e, f } = document.querySelector(".robot.selected").getScreenCTM();
  return [Math.round(e), Math.round(f)];
}"""
PAUSE = 8000
"""Milliseconds in which a robot begins its next errand, unless errands are paused."""


@pytest.fixture
def tab(chromium, tmp_path):
    demo = ("demo", "--robots", "4", "--port", "0", "--no-browser")
    with (
        watched_tab(chromium, 1280, 800) as page,
        webmap(*demo, WEBMAP_STATE_DIR=str(tmp_path)) as url,
    ):
        page.allowed = ["WebSocket", "ERR_CONNECTION"]  # when the processes end
        page.goto(url)
        expect(page.locator(".robot:not(.unplaced)")).to_have_count(4)
        wait_until_ready(page)
        select(page, "Robot 2")
        expect_state(page, "Autonomous", 30)
        yield page


def expect_standing(page):
    """Expect that the selected robot does not move for longer than :data:`PAUSE`."""
    before = page.evaluate(PLACE)
    page.wait_for_timeout(PAUSE)
    assert page.evaluate(PLACE) == before


def test_taking_control_of_a_robot_with_errands_stops_it_until_the_release(tab):
    tab.locator(".webmap-teleop-lease").click()
    expect_state(tab, "You have control")
    expect_standing(tab)


def test_a_stop_of_a_robot_with_errands_holds(tab):
    tab.keyboard.press("Space")
    expect(tab.locator('.webmap-stop-verdict[data-state="confirmed"]')).to_be_visible()
    expect_standing(tab)
