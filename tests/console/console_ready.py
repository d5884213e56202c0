"""Wait until a page of the console is ready, and steps that several tests share."""

import re
import signal
from collections.abc import Callable
from contextlib import suppress

import psutil
from playwright.sync_api import Locator, Page, expect

from equipment.waiting import wait_for

READY = """async () => {
  const { page } = await import(document.querySelector('[src$="page.js"]').src);
  const parts = [...page.parts._attached.values()];
  const styles = [...document.querySelectorAll("link[rel=stylesheet]")];
  return parts.every(({ part }) => part) && styles.every(({ sheet }) => sheet);
}"""
"""Whether every module of the page is attached and every style sheet is loaded."""


def wait_until_ready(page: Page) -> None:
    """Wait until the page has loaded all its modules and style sheets."""
    wait_for(lambda: page.evaluate(READY), "all modules of the page", 30.0, page)


def halt_robots(process: psutil.Process, page: Page, lost: Callable[[], None]) -> None:
    """Halt a simulator until each robot has an alert; ``lost`` asserts this.

    A halted bridge answers no ping. If the bridge is lost before the poses of its
    robots are old, all of them have one alert: then it is halted once more.
    """
    for _ in range(4):
        process.send_signal(signal.SIGSTOP)
        with suppress(AssertionError):
            lost()
            return
        process.send_signal(signal.SIGCONT)
        page.wait_for_timeout(5000)
    process.send_signal(signal.SIGSTOP)
    lost()


def count_presses(page: Page) -> None:
    """Count the presses from now on."""
    page.evaluate("""() => {
      window.presses = 0;
      addEventListener("pointerdown", () => { window.presses += 1; }, true);
    }""")


def presses(page: Page) -> int:
    """Return the number of presses since the last call."""
    return page.evaluate("() => { const n = presses; window.presses = 0; return n; }")


BESIDE = 30
"""Pixels beside a robot, to the right and down."""

PLACES = f"""() => {{
  const place = (robot) => {{
    const {{ e, f }} = robot.getScreenCTM();
    return [e + {BESIDE}, f + {BESIDE}];
  }};
  const [x, y] = place(document.querySelector(".robot.selected"));
  return [...document.querySelectorAll(".robot:not(.selected)")]
    .map(place)
    .filter((at) => document.elementFromPoint(...at)?.closest("svg.webmap"))
    .sort(([a, b], [c, d]) => Math.hypot(c - x, d - y) - Math.hypot(a - x, b - y));
}}"""
"""Places of the window beside other robots where the map is visible. The place farthest
from the selected robot is first."""

NAVIGATING = re.compile("Navigating to goal.*to go")


def send_away(page: Page) -> None:
    """Send the selected robot to a place beside a robot that is far away."""
    goal = page.locator("#card .goal")
    without_path: set[tuple[float, ...]] = set()
    # A busy page may send nothing, and some places cannot be reached.
    for _ in range(12):
        page.get_by_role("button", name="Send goal…").click()
        expect(page.locator(".webmap-goal-word")).to_contain_text("Press on the map")
        # Read the places now: the text moved the panel, and robots may move, too.
        places = page.evaluate(PLACES)
        x, y = next(place for place in places if tuple(place) not in without_path)
        page.mouse.click(x, y)
        try:
            expect(goal).to_contain_text(NAVIGATING, timeout=5_000)
        except AssertionError:
            if "Goal failed" in goal.inner_text():
                without_path.add((x, y))
        else:
            return
    raise AssertionError(page.locator("#card").inner_text())


def select(page: Page, name: str) -> None:
    page.locator("#robots .row", has_text=name).locator("button").first.click()
    expect(page.locator("#card h2")).to_have_text(name)


def unfold(page: Page) -> None:
    """Show the part of the card that is folded under More."""
    page.locator("#card .more > summary").click()
    expect(page.locator("#card .more[open]")).to_be_visible()


def title(page: Page):
    return page.locator(".webmap-teleop-title")


def shown_state(page: Page):
    return page.locator("#card .state span:not(.old):visible").first


def expect_state(page: Page, text: str | re.Pattern, patience: float = 15.0) -> None:
    """Check that the bar, the card and the list show a state of the selected robot."""
    if isinstance(text, str):
        text = re.compile(f"^(Stale data)?{re.escape(text)}$")
    line = page.locator("#robots .row:has([aria-pressed=true]) .state")
    for where in (title(page), page.locator("#card .state"), line):
        expect(where).to_have_text(text, timeout=patience * 1000, use_inner_text=True)


COVERED = """(e, reach) => {
  const box = e.getBoundingClientRect();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  const [across, down] = [reach * box.width / 2, reach * box.height / 2];
  return [[0, 0], [across, 0], [-across, 0], [0, down], [0, -down]]
    .map(([dx, dy]) => document.elementFromPoint(x + dx, y + dy))
    .filter((hit) => hit === null || !e.contains(hit))
    .map((hit) => hit?.outerHTML.slice(0, 80) ?? "nothing");
}"""
"""The elements that cover an element at its middle or near its four edges."""


def assert_free(what: Locator, reach: float = 0.9) -> None:
    """Check that no other element covers an element."""
    expect(what).to_be_in_viewport(ratio=0.99)
    for _ in range(20):  # the layout may still change after an opening
        covered = what.evaluate(COVERED, reach)
        if not covered:
            return
        what.page.wait_for_timeout(100)
    raise AssertionError(covered)
