"""A page that was just opened shows "Preparing input" until a press drives."""

import threading

import pytest
from playwright.sync_api import Route, expect

from equipment.waiting import wait_for

pytestmark = pytest.mark.browser

READY = """() => {
  const shown = document.querySelector(".getting-ready").checkVisibility();
  const title = document.querySelector(".webmap-teleop-title")?.textContent;
  const now = performance.now();
  if (shown || title !== "Free") window.notReadyAt = now;
  return now - (window.notReadyAt ??= now) > 300;
}"""
"""Whether the page has shown for 300 ms that a press drives.

A page that was blocked while it loaded shows this for about 30 ms before it detects
that the last ticks of the gate were late. No person can react in that time.
"""


def test_the_page_shows_preparing_input_until_teleop_is_loaded(chromium, demo):
    come = threading.Event()
    held: list[Route] = []
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    page = context.new_page()
    page.route(
        "**/web/drive.js*",
        lambda r: r.continue_() if come.is_set() else held.append(r),
    )
    page.goto(demo.url, wait_until="commit")
    status = page.locator(".getting-ready")
    row = page.locator("#robots .row", has_text="Robot 1").locator("button").first
    row.click()
    expect(row).to_have_attribute("aria-pressed", "true")
    expect(status).to_be_visible()
    expect(status).to_contain_text("Preparing input")
    page.keyboard.down("w")
    come.set()
    for route in held:
        route.continue_()
    expect(status).to_be_hidden()
    title = page.locator(".webmap-teleop-title")
    expect(title).to_have_text("Free")
    page.keyboard.down("w")  # the keyboard repeats the key
    expect(title).to_have_text("Input blocked: release all keys, then press again")
    page.keyboard.up("w")
    expect(title).to_have_text("Free")
    context.close()


@pytest.mark.serial  # a delayed page stops driving
def test_the_first_press_drives_when_preparing_input_is_no_longer_shown(chromium, demo):
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    page = context.new_page()
    page.goto(demo.url, wait_until="commit")
    page.locator("#robots .row", has_text="Robot 2").locator("button").first.click()
    page.wait_for_function(READY, polling=10)
    page.keyboard.down("a")
    title = page.locator(".webmap-teleop-title")
    seen = set()

    def drives():
        seen.add(title.text_content())
        return "You are driving" in seen

    wait_for(drives, lambda: f"a driven robot: {seen}", page=page)
    assert "Input blocked: release all keys, then press again" not in seen
    page.keyboard.up("a")
    context.close()
