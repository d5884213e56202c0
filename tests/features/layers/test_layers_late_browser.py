"""Data from a slow link is drawn as old, although it arrived just now."""

import re
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, Page, expect
from running_simulators import simulators

from equipment.chromium import watched_tab
from equipment.webmap_process import webmap
from webmap.testing import FaultProxy, Shape

pytestmark = pytest.mark.browser

LATE = 1.6
"""The delay of all messages from the robots, in seconds."""

DRAWN = (".robot", ".laserscan", ".range")


def test_data_of_a_slow_link_is_drawn_as_stale_with_its_age(chromium: Browser):
    with (
        simulators("ros2") as found,
        FaultProxy(urlsplit(found["ros2"].url).port) as link,
        webmap(
            "view", f"ws://127.0.0.1:{link.port}", "--port", "0", "--no-browser"
        ) as url,
        watched_tab(chromium, 1000, 700) as tab,
    ):
        tab.set_default_timeout(20_000)
        tab.goto(url)
        for drawn in DRAWN:
            # Of both robots: an element without data has no age.
            tab.locator(f"{drawn}:not(.stale)").nth(1).wait_for(state="attached")
        assert age_of(tab, ".robot") < 1.0
        link.shape(Shape(latency=LATE), "down")
        for drawn in DRAWN:
            tab.wait_for_selector(f"{drawn}.stale", state="attached")
        tab.wait_for_timeout(2 * 1000 * LATE)  # messages now arrive late and often
        assert tab.evaluate(LEAST_AGES, list(DRAWN)) >= 0.9 * LATE
        line = tab.locator("#robots .age").first
        expect(line).to_have_text(re.compile(r"^[1-3]\.\d s$"))
        link.shape(Shape(), "down")
        for drawn in DRAWN:
            tab.wait_for_selector(f"{drawn}:not(.stale)", state="attached")


def age_of(tab: Page, selector: str) -> float:
    return tab.evaluate(LEAST_AGES, [selector])


# Read for a second, so that elements drawn as new in between are found.
LEAST_AGES = """async (selectors) => {
  let least = Infinity;
  const end = performance.now() + 1000;
  while (performance.now() < end) {
    for (const selector of selectors) {
      for (const element of document.querySelectorAll(selector)) {
        least = Math.min(least, Number(element.dataset.age));
      }
    }
    await new Promise(requestAnimationFrame);
  }
  return least;
}"""
