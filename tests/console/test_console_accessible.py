"""axe-core finds no violation in any state of the console."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from equipment.chromium import hold

pytestmark = [pytest.mark.browser, pytest.mark.slow]

AXE = Path(__file__).parents[2] / "node_modules/axe-core/axe.min.js"

RUN = """async () => {
  const options = { resultTypes: ["violations"], preload: false };
  const { violations } = await axe.run(document, options);
  return violations.map(({ id, nodes }) =>
    `${id}: ${nodes.map(({ html }) => html.slice(0, 160)).join(" | ")}`);
}"""

OF_AXE = "Applying inline style"
"""The warning of the browser about a style that axe-core tries to set."""


class Looker:
    """Runs axe-core in each state of the page."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.found: list[str] = []
        self.states = 0
        page.evaluate(AXE.read_text(encoding="utf-8"))

    def look(self, state: str) -> None:
        self.states += 1
        self.found += [f"{state}: {each}" for each in self.page.evaluate(RUN)]


def open_all(page: Page, selector: str, *, on: bool = True) -> None:
    page.evaluate(
        "([selector, on]) => { for (const e of document.querySelectorAll(selector)) "
        "e.open = on; }",
        [selector, on],
    )


def test_no_state_of_the_console_has_an_accessibility_violation(open_console):
    page = open_console()
    open_console.allowed.append(OF_AXE)
    looker = Looker(page)
    look = looker.look
    look("no robot selected")
    page.locator("#robots .row", has_text="Robot 1").locator("button").first.click()
    expect(page.locator("#card")).to_be_visible()
    look("a robot is selected")
    you = page.locator("#card .state .you")
    hold(page.keyboard, "a", lambda: you.text_content() == "You are driving")
    look("it is driven")
    page.keyboard.up("a")
    page.get_by_role("button", name="Send goal…").click()
    expect(page.locator(".webmap-goal-word")).not_to_be_empty()
    look("a goal is chosen")
    page.keyboard.press("g")
    for name, panel in (
        ("the bridges", "#bridges > details"),
        ("the layers", ".webmap-layers"),
        ("the log", ".webmap-rosout, details:has(.webmap-rosout-lines)"),
        ("the route", ".webmap-route"),
        ("the alerts", ".webmap-alerts"),
        ("more of the card", "#card .more"),
    ):
        open_all(page, panel)
        page.wait_for_timeout(300)
        look(f"{name} is open")
        open_all(page, panel, on=False)
    page.locator(".webmap-teleop-fold").click()
    look("the figures are shown")
    page.locator(".webmap-teleop-fold").click()
    page.keyboard.press("Control+k")
    look("the palette is open")
    page.keyboard.type("no such name")
    look("the palette found nothing")
    page.keyboard.press("Escape")
    page.locator("#robots .row .besides").nth(2).click()
    look("two robots are selected")
    page.get_by_role("button", name="Clear", exact=True).click()
    page.locator(".webmap-export-go").first.click()
    look("the menu of saving is open")
    page.keyboard.press("Escape")
    page.keyboard.press("?")
    expect(page.get_by_role("dialog", name="Keys and gestures")).to_be_visible()
    look("the help is open")
    page.locator("#help-close").click()
    picture = page.get_by_role("img", name="Camera of Robot 1").first
    picture.scroll_into_view_if_needed()
    picture.click()
    expect(page.locator(".camera-panel")).to_be_visible()
    look("the camera is large")
    page.locator(".camera-close").click()
    page.keyboard.press("Escape")
    expect(page.locator("#card .state .holder")).to_have_text("STOP active")
    look("it is stopped")
    assert looker.states == 18
    assert looker.found == []


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_console_on_a_phone_has_no_accessibility_violation(open_console, scheme):
    page = open_console("phone", scheme)
    open_console.allowed.append(OF_AXE)
    looker = Looker(page)
    looker.look("the sheet is closed")
    page.locator("#sheet").click()
    looker.look("the sheet is open")
    page.locator("#robots .row", has_text="Robot 1").locator("button").first.click()
    expect(page.locator("#card")).to_be_visible()
    looker.look("a robot is selected")
    assert looker.found == []


def test_the_accessible_name_of_a_robot_contains_its_battery(open_console):
    page = open_console()
    line = page.get_by_role("button", name="Robot 1").first
    expect(line).to_have_accessible_name(re.compile(r"battery \d+ %"))


def test_the_sign_in_page_has_no_accessibility_violation(chromium, demo):
    context = chromium.new_context()
    page = context.new_page()
    page.goto(demo.url.partition("?")[0])
    looker = Looker(page)
    looker.look("signed out")
    context.close()
    assert looker.found == []


def test_forced_colours_keep_the_buttons_and_the_robots_visible(chromium, demo):
    context = chromium.new_context(forced_colors="active", reduced_motion="reduce")
    page = context.new_page()
    page.goto(demo.url)
    page.locator("#robots .row", has_text="Robot 1").locator("button").first.click()
    expect(page.locator("#card h2")).to_have_text("Robot 1")
    page.get_by_role("button", name="STOP ALL").wait_for()
    page.locator(".robot .model").first.wait_for(state="attached")
    seen = page.evaluate(
        """() => {
          const colours = (one, name) => getComputedStyle(one)[name];
          const robot = document.querySelector(".robot .model");
          const map = document.querySelector(".map");
          const all = document.querySelector(".webmap-stop-all");
          const moves = [...document.querySelectorAll(".button, .webmap-button")]
            .filter((e) => !["0s", ""].includes(colours(e, "transitionDuration")));
          return {
            robot: colours(robot, "fill") !== colours(map, "backgroundColor"),
            stop: colours(all, "color") !== colours(all, "backgroundColor"),
            moves: moves.length,
          };
        }"""
    )
    context.close()
    assert seen == {"robot": True, "stop": True, "moves": 0}
