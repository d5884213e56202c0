"""Several robots at once in a real browser: the box, the search, STOP and goals."""

import re
from contextlib import suppress

import pytest
from console_ready import count_presses, presses
from playwright.sync_api import Page, expect

from equipment.doc_buttons import PRESSES

pytestmark = [pytest.mark.browser, pytest.mark.slow]

AROUND = """() => {
  const map = document.querySelector("svg.webmap").getBoundingClientRect();
  const found = [...document.querySelectorAll(".robot")].map((robot) => {
    const { e, f } = robot.getScreenCTM();
    return [e, f];
  });
  const [xs, ys] = [0, 1].map((axis) => found.map((place) => place[axis]));
  return [
    Math.max(map.left + 2, Math.min(...xs) - 30),
    Math.max(map.top + 2, Math.min(...ys) - 30),
    Math.min(map.right - 2, Math.max(...xs) + 30),
    Math.min(map.bottom - 2, Math.max(...ys) + 30),
  ];
}"""
"""The corners of a box around all robots, in pixels of the window."""


def draw_box(page: Page) -> None:
    left, top, right, bottom = page.evaluate(AROUND)
    page.keyboard.down("Shift")
    page.mouse.move(right, bottom)
    page.mouse.down()
    page.mouse.move((left + right) / 2, (top + bottom) / 2)
    expect(page.locator(".webmap-several-box")).to_have_count(1)
    page.mouse.move(left, top)
    page.mouse.up()
    page.keyboard.up("Shift")
    expect(page.locator(".webmap-several-box")).to_have_count(0)


def view(page: Page) -> str:
    return page.locator("svg.webmap > .world").get_attribute("transform")


def test_a_box_selects_the_robots_in_it_and_stop_stops_them(demo, open_console):
    page = open_console()
    page.locator("#show-all").click()
    before = view(page)
    draw_box(page)
    bar = page.locator(".webmap-several")
    expect(bar.locator(".webmap-several-count")).to_have_text(f"{demo.robots} robots")
    assert view(page) == before, "the box does not move the view"
    bar.get_by_role("button", name="STOP these").click()
    for number in range(demo.robots):
        row = page.locator("#robots .row").nth(number)
        expect(row).to_have_attribute("data-state", "stopped")
    bar.get_by_role("button", name="Clear").click()
    expect(bar).to_be_hidden()
    expect(page.locator(".robot.selected")).to_have_count(1)
    reset = page.locator(".webmap-stop-list .webmap-reset")
    reset.click()
    expect(reset).to_have_class(re.compile("asking"))
    page.wait_for_timeout(600)  # a faster second press is a double click
    reset.click()
    expect(page.locator("#robots .row[data-state=stopped]")).to_have_count(0)


def test_all_robots_of_a_search_are_sent_and_their_goals_cancelled(demo, open_console):
    page = open_console()
    every = page.get_by_role("button", name="Select all shown")
    page.locator("#search").evaluate(
        """(field) => {
          field.value = "Robot";
          field.dispatchEvent(new Event("input"));
        }"""
    )
    every.click()
    bar = page.locator(".webmap-several")
    expect(bar.locator(".webmap-several-count")).to_have_text(f"{demo.robots} robots")
    page.locator("#show-all").click()
    navigating = page.locator("#robots .row[data-state^=navigating]")
    # On a busy machine a goal may be too old, and is then not sent.
    for _ in range(5):
        bar.get_by_role("button", name="Send goal…").click()
        expect(page.locator(".webmap-goal-word")).to_contain_text("Press on the map")
        page.keyboard.down("Alt")
        box = page.locator("svg.webmap").bounding_box()
        page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        page.mouse.down()
        # The goals of all robots are visible before the release.
        expect(page.locator(".webmap-goal-arrow")).to_have_count(demo.robots)
        page.mouse.up()
        page.keyboard.up("Alt")
        with suppress(AssertionError):
            expect(navigating.first).to_be_attached(timeout=5000)
            break
    expect(navigating.first).to_be_attached()
    bar.get_by_role("button", name="Cancel goals").click()
    expect(navigating).to_have_count(0)


def test_each_press_sends_the_next_of_several_robots(demo, open_console):
    page = open_console()
    page.locator("#show-all").click()
    count_presses(page)
    draw_box(page)
    page.locator(".webmap-several").get_by_role("button", name="Send goal…").click()
    box = page.locator("svg.webmap").bounding_box()
    robots = page.locator("#robots .row .name").all_text_contents()
    for number in range(demo.robots):
        words = re.compile(rf"\({number + 1} of {demo.robots}\): Press on the map")
        aiming = page.locator(".webmap-goal-word")
        expect(aiming).to_have_text(words)
        name = aiming.text_content().partition(" (")[0]
        robots.remove(name)
        x = box["x"] + box["width"] * (0.4 + 0.1 * number)
        page.mouse.move(x, box["y"] + box["height"] / 2)
        ground = page.locator(".webmap-ground-word")
        expect(ground).to_have_text(re.compile(rf"^{name}: (free|unknown|wall)$"))
        page.mouse.down()
        expect(page.locator(".webmap-goal-arrow.aimed")).to_have_count(1)
        page.mouse.up()
    assert robots == [], "each robot was placed once"
    more = PRESSES["Send five robots to five places"] - 5
    assert presses(page) == demo.robots + more
    expect(page.locator(".webmap-goal-go")).to_have_attribute("aria-pressed", "false")
    expect(page.locator(".webmap-ground-word")).to_be_hidden()
