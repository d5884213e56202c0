"""When a page of the console can be used, and what several tests do with one."""

import math
import re
import time

from playwright.sync_api import Page, expect

READY = """async () => {
  const { page } = await import(document.querySelector("script[type=module]").src);
  const halves = [...page.halves._attached.values()];
  const styles = [...document.querySelectorAll("link[rel=stylesheet]")];
  return halves.every(({ half }) => half) && styles.every(({ sheet }) => sheet);
}"""
"""Whether every module of the page is there and listens, and every style sheet."""


def wait_until_ready(page: Page) -> None:
    """Wait for what the page loads once it knows its modules, each on its own."""
    deadline = time.monotonic() + 30
    while not page.evaluate(READY):
        assert time.monotonic() < deadline, "a module of the page does not come"
        page.wait_for_timeout(50)


BESIDE = 30
"""Pixels beside a robot, to the right and down."""

UNCOVERED = f"""([x, y]) =>
  !!document.elementFromPoint(x + {BESIDE}, y + {BESIDE})?.closest("svg.webmap")"""
"""Whether the map is to be seen at a place of the window."""

GOING = re.compile("Goal (sent|accepted|under way)")


def send_away(page: Page) -> None:
    """Send the selected robot to beside another one, far enough to be seen."""
    here, *others = page.evaluate(
        """() => [".robot.selected", ".robot:not(.selected)"].flatMap((kind) =>
          [...document.querySelectorAll(kind)]
            .map((robot) => robot.getScreenCTM())
            .map(({ e, f }) => [e, f]))"""
    )
    others.sort(key=lambda place: -math.dist(here, place))
    for x, y in others:  # a page that is too busy sends nothing
        if not page.evaluate(UNCOVERED, [x, y]):
            continue
        page.get_by_role("button", name="Send to").click()
        expect(page.locator(".webmap-goal-word")).not_to_be_empty()
        page.mouse.click(x + BESIDE, y + BESIDE)
        try:
            expect(page.locator("#card .goal")).to_contain_text(GOING)
        except AssertionError:
            page.keyboard.press("g")
        else:
            return
    raise AssertionError(page.locator("#card").inner_text())
