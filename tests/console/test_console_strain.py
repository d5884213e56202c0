"""The console with far too many robots, without robots, and without storage."""

import re
import signal
from pathlib import Path

import pytest
from console_ready import assert_free, halt_robots, select, wait_until_ready
from playwright.sync_api import Page, expect

from equipment.chromium import end_stops, watched_tab
from equipment.webmap_process import page_of, simulator

pytestmark = [pytest.mark.browser, pytest.mark.slow]

SITE = Path(__file__).with_name("strained_site.py")

ROBOTS = 10

STOP_ALL = ".webmap-stop-all"

NO_STORAGE = """() => {
  const refuse = () => { throw new DOMException("Denied.", "SecurityError"); };
  for (const name of ["localStorage", "sessionStorage"]) {
    Object.defineProperty(window, name, { get: refuse });
  }
}"""
"""Storage of a page that is not allowed to store data."""

FULL_STORAGE = """() => {
  Storage.prototype.setItem = () => {
    throw new DOMException("Full.", "QuotaExceededError");
  };
}"""
"""Storage without free space."""

CORNER = """(e) => {
  const { right, top } = e.getBoundingClientRect();
  return [innerWidth - right, top];
}"""
"""Pixels from an element to the right and the top edge of the window."""


COUNT_REMOVED = """() => {
  window.removed = 0;
  new MutationObserver((records) => {
    const nodes = records.flatMap(({ removedNodes }) => [...removedNodes]);
    window.removed += nodes.filter((node) => !node.isConnected).length;
  }).observe(document.querySelector("#robots"), { childList: true });
}"""
"""Counts the lines that are removed from the list."""


def rows(page: Page):
    return page.locator("#robots > .row:not(.filtered)")


CHANGES = """() => new Promise((done) => {
  let count = 0;
  const observer = new MutationObserver((records) => { count += records.length; });
  const options = { subtree: true, childList: true, attributes: true };
  observer.observe(document.querySelector("#attention"), options);
  const isWordless = (robot) => robot.classList.contains("wordless");
  const robots = [...document.querySelectorAll(".robot")];
  const before = robots.map(isWordless);
  const changed = (robot, index) => isWordless(robot) !== before[index];
  const look = () => { count += robots.filter(changed).length; };
  for (let ms = 100; ms <= 2000; ms += 100) setTimeout(look, ms);
  setTimeout(() => done(count), 2100);
})"""
"""The changes of the strip, and of which robots have words, in two seconds."""


def layouts(page: Page) -> float:
    """Return how often the page was laid out."""
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable")
    metrics = session.send("Performance.getMetrics")["metrics"]
    return next(each["value"] for each in metrics if each["name"] == "LayoutCount")


def test_five_hundred_robots_in_trouble_are_listed_found_and_the_page_rests(chromium):
    with (
        page_of(SITE, ROBOTS="500", STATE="stopped") as url,
        watched_tab(chromium, 1280, 800) as page,
    ):
        # A busy machine may not open the socket within the page's patience of 5 s.
        page.allowed = ["closed before the connection is established"]
        page.goto(url)
        wait_until_ready(page)
        expect(rows(page)).to_have_count(500, timeout=60_000)
        chips = page.locator("#attention > .chip")
        expect(chips).to_have_text(["500 stopped", "Next"], timeout=60_000)
        worded = page.locator(".robot:not(.wordless)")
        expect(worded).to_have_count(0, timeout=60_000)  # all are in circles
        page.wait_for_function(
            "() => [...document.querySelectorAll('.cluster title')].some("
            "(title) => title.textContent.includes('need someone'))"
        )
        for _ in range(6):
            page.locator("#zoom-in").dispatch_event("click")
        expect(worded).to_have_count(8, timeout=60_000)
        expect(page.locator(".webmap-notice")).to_be_visible(timeout=60_000)
        before = layouts(page)
        assert page.evaluate(CHANGES) == 0
        assert layouts(page) - before < 200
        page.keyboard.press("n")
        expect(page.locator("#card h2")).to_have_text("Robot 0", timeout=60_000)
        assert_free(page.locator(STOP_ALL))
        page.keyboard.press("Control+k")
        page.keyboard.type("robot 499")
        found = page.get_by_role("option", name="Robot 499").first
        expect(found).to_be_visible(timeout=60_000)
        page.keyboard.press("Enter")
        expect(page.locator("#card h2")).to_have_text("Robot 499", timeout=60_000)
        page.locator("#search").fill("robot 49")
        expect(rows(page)).to_have_count(11)
        assert_free(page.locator(STOP_ALL))


def test_a_page_without_robots_shows_the_next_step_and_stays_as_large(chromium):
    with page_of(SITE, ROBOTS="0") as url, watched_tab(chromium, 1280, 800) as page:
        page.goto(url)
        wait_until_ready(page)
        expect(page.locator(".no-robots")).to_be_visible()
        assert_free(page.locator(STOP_ALL))
        page.wait_for_timeout(2000)
        nodes = "() => document.querySelectorAll('*').length"
        before = page.evaluate(nodes)
        page.wait_for_timeout(4000)
        assert page.evaluate(nodes) == before


def test_a_robot_that_vanishes_again_and_again_changes_no_other_robot(chromium):
    with (
        simulator("--robots", "3") as bridge,
        page_of(SITE, ROBOTS="3", BRIDGE=bridge) as url,
        watched_tab(chromium, 1280, 800) as page,
    ):
        page.goto(url)
        wait_until_ready(page)
        select(page, "Robot 1")
        corner = page.locator(STOP_ALL).evaluate(CORNER)
        page.evaluate(COUNT_REMOVED)
        page.wait_for_function("() => window.removed >= 3", timeout=30_000)
        assert page.locator(STOP_ALL).evaluate(CORNER) == corner
        expect(page.locator("#card h2")).to_have_text("Robot 1")
        expect(page.locator(".robot.selected")).to_have_count(1)
        page.locator("#robots .row", has_text="Robot 2").locator("button").first.click()
        expect(page.locator("#card h2")).not_to_have_text("Robot 1")
        page.wait_for_function("() => document.querySelector('#card').hidden")
        expect(page.locator("#robots .row")).to_have_count(3)


def test_all_robots_in_trouble_leave_the_map_and_the_stop_buttons_free(
    open_console, halt
):
    page = open_console()
    corner = page.locator(STOP_ALL).evaluate(CORNER)
    # Some seconds after their poses, the connection for commands ends too, and that of
    # the bridge, which is one more alert.
    some = "|".join(str(n) for n in range(ROBOTS, 2 * ROBOTS + 2))
    badge = page.locator(".webmap-alert-badge")
    halt_robots(
        halt, page, lambda: expect(badge).to_have_text(re.compile(f"^({some})$"))
    )
    expect(page.locator(".chip").first).to_have_text(
        re.compile(f"^{ROBOTS} (lost|without a connection)")
    )
    page.locator(STOP_ALL).click()
    page.locator(".webmap-alerts > summary").click()
    alerts = page.locator("[aria-label='New alerts'] > li")
    expect(alerts.nth(ROBOTS - 1)).to_be_attached()
    select(page, "Robot 7")
    for stop in (STOP_ALL, ".webmap-teleop-stop"):
        assert_free(page.locator(stop).first)
    assert page.locator(STOP_ALL).evaluate(CORNER) == corner
    assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth")
    halt.send_signal(signal.SIGCONT)
    stopped = f"{ROBOTS} stopped"  # after the next attempts to connect
    expect(page.locator(".chip").first).to_have_text(stopped, timeout=60_000)
    end_stops(page.locator(".webmap-stop-list .webmap-reset"))


@pytest.mark.parametrize("storage", [NO_STORAGE, FULL_STORAGE], ids=["none", "full"])
def test_a_browser_that_stores_nothing_shows_and_changes_everything(
    demo, chromium, storage
):
    with watched_tab(chromium, 1280, 800) as page:
        page.add_init_script(f"({storage})()")
        page.goto(demo.url)
        wait_until_ready(page)
        select(page, "Robot 1")
        page.locator(".webmap-layers > summary").click()
        page.get_by_label("Scans", exact=True).uncheck()
        expect(page.locator(".laserscan").first).to_be_hidden()
        page.get_by_role("button", name="List of robots").click()
        expect(page.locator("#panel")).to_be_hidden()
        page.get_by_role("button", name="List of robots").click()
        edge = page.get_by_role("separator", name="Width of the list")
        edge.focus()
        page.keyboard.press("ArrowRight")
        page.get_by_role("button", name="Take control of Robot 1").click()
        expect(page.locator("#card .state .you")).to_have_text("You have control")
