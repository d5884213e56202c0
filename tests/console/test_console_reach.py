"""STOP, the stick and what is said of motion are in reach, whatever is open."""

import re

import pytest
from playwright.sync_api import Locator, expect

from real_browser import end_stops

pytestmark = [pytest.mark.browser, pytest.mark.slow]

ROBOTS = 10
"""So many that the list of stopped robots is long."""

COVERED = """(e, reach) => {
  const box = e.getBoundingClientRect();
  const [x, y] = [box.x + box.width / 2, box.y + box.height / 2];
  const [across, down] = [reach * box.width / 2, reach * box.height / 2];
  return [[0, 0], [across, 0], [-across, 0], [0, down], [0, -down]]
    .map(([dx, dy]) => document.elementFromPoint(x + dx, y + dy))
    .filter((hit) => hit === null || !e.contains(hit))
    .map((hit) => hit?.outerHTML.slice(0, 80) ?? "nothing");
}"""
"""What is hit in place of an element, at its middle and near its four edges."""

PANELS = """() => [...document.querySelectorAll("details")]
  .filter((e) => e.checkVisibility()).length"""

OPEN_PANEL = """(index) => [...document.querySelectorAll("details")]
  .filter((e) => e.checkVisibility())
  .forEach((e, i) => { e.open = index === null || i === index; })"""


def assert_free(what: Locator, reach: float = 0.9) -> None:
    """See that nothing lies over a thing."""
    expect(what).to_be_in_viewport(ratio=0.99)
    for _ in range(20):  # what was opened just now may still be laid out
        covered = what.evaluate(COVERED, reach)
        if not covered:
            return
        what.page.wait_for_timeout(100)
    raise AssertionError(covered)


@pytest.mark.parametrize("size", ["desk", "phone", "on its side", "small phone"])
def test_stop_is_hit_and_works_whatever_is_open(open_console, size):
    page = open_console(size)
    every = page.get_by_role("button", name="STOP ALL")
    one = page.get_by_role("button", name="STOP Robot 1", exact=True)
    stops = [every] if size == "desk" else [every, one]
    if size != "desk":
        page.locator("#sheet").click()
        assert_free(every)
    page.locator("#robots .row", has_text="Robot 1").locator("button").first.click()
    # With the sheet open, on a phone.
    for stop in (every, one):
        assert_free(stop)
    if size != "desk":
        page.locator("#sheet").click()
        assert_free(page.locator(".webmap-stick"))
    for index in [*range(page.evaluate(PANELS)), None]:
        page.evaluate(OPEN_PANEL, index)
        for stop in stops:
            assert_free(stop)
    page.evaluate(OPEN_PANEL, -1)
    page.keyboard.press("?")
    help_ = page.get_by_role("dialog", name="Keys and gestures")
    expect(help_).to_be_visible()
    for stop in stops:
        assert_free(stop)

    def reset() -> None:
        end_stops(page.locator(".webmap-stop-list .webmap-reset"))
        expect(page.locator("#card .state .holder")).to_have_text("Free")

    every.click()
    expect(page.locator(".webmap-stop-verdict")).to_have_count(ROBOTS)
    expect(page.locator(".webmap-stop-standing")).to_contain_text(f"{ROBOTS} robots")
    expect(help_).to_be_hidden()
    reset()
    # Esc closes the help first, and is STOP then.
    page.keyboard.press("?")
    expect(help_).to_be_visible()
    page.keyboard.press("Escape")
    expect(help_).to_be_hidden()
    expect(page.locator("#card .state .holder")).to_have_text("Free")
    page.keyboard.press("Escape")
    expect(page.locator("#card .state .holder")).to_have_text("STOP active")
    expect(page.locator(".webmap-stop-standing")).to_contain_text(
        "STOP active: Robot 1"
    )
    reset()


@pytest.mark.parametrize(
    ("size", "keyboard"), [("phone", 300), ("on its side", 160), ("small phone", 250)]
)
def test_a_keyboard_on_the_screen_leaves_stop_in_reach(open_console, size, keyboard):
    page = open_console(size)
    viewport = page.locator("meta[name=viewport]").get_attribute("content")
    assert "interactive-widget=resizes-content" in viewport
    page.locator("#sheet").click()
    page.locator("#robots .row", has_text="Robot 1").locator("button").first.click()
    page.locator("#search").focus()
    # This browser has none; what it would leave of the page is known.
    left = page.viewport_size["height"] - keyboard
    page.set_viewport_size({"width": page.viewport_size["width"], "height": left})
    for name in ("STOP ALL", "STOP Robot 1"):
        stop = page.get_by_role("button", name=name, exact=True)
        assert_free(stop)
        assert stop.bounding_box()["width"] >= 44


def test_two_fingers_beside_the_map_do_not_zoom_the_page(open_console):
    page = open_console("phone")
    bar = page.locator("header.bar").bounding_box()
    y = bar["y"] + bar["height"] / 2
    touch = page.context.new_cdp_session(page)
    for way in range(20, 170, 15):
        kind = "touchStart" if way == 20 else "touchMove"
        points = [{"x": 195 - way, "y": y, "id": 0}, {"x": 195 + way, "y": y, "id": 1}]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    page.wait_for_timeout(200)  # in which it would be zoomed
    assert page.evaluate("visualViewport.scale") == 1


@pytest.mark.serial  # a late command ends the stop test
def test_the_card_tests_whether_a_robot_of_which_that_is_stated_stops(open_console):
    page = open_console()
    page.locator("#robots .row", has_text="Robot 2").locator("button").first.click()
    test = page.locator("[data-act=stop-test]")
    expect(test).to_have_text(re.compile("Stop test: take control"))
    expect(test).to_be_disabled()
    bound = page.locator("#card .own-stop")
    expect(bound).to_contain_text(re.compile(r"stops within \d\.\d\d s"))
    expect(bound).to_contain_text("(stated)")
    page.get_by_role("button", name="Take control of Robot 2").click()
    # With a camera above them the figures would lie below the edge of the card.
    expect(page.get_by_role("img", name="Camera of Robot 2")).to_be_visible()
    page.wait_for_function(
        "document.querySelector('.cameras img').naturalWidth === 320"
    )
    figures = page.locator("#card .speeds")
    assert page.locator("#card").evaluate("e => e.scrollHeight > e.clientHeight + 40")
    assert_free(figures)
    tested = re.compile(r"\(tested \d{4}-\d\d-\d\d\)")
    for _ in range(8):
        for words in ("Run stop test", "Robot will move slowly: press again"):
            button = page.get_by_role("button", name=words, exact=True)
            page.wait_for_timeout(450)
            button.click()
        expect(test).not_to_have_attribute("data-test", "asking")
        page.wait_for_timeout(300)
        expect(test).to_have_attribute("data-test", "ready")
        # On a busy machine a late command ends it, which the card says.
        ended = page.locator("#card .test", has_text="Stop test: ")
        expect(ended.or_(bound.filter(has_text=tested)).first).to_be_attached()
        if tested.search(bound.inner_text()):
            break
    expect(bound).to_contain_text(tested)
    expect(page.get_by_role("button", name="Run stop test", exact=True)).to_be_enabled()
    page.get_by_role("button", name="Release control", exact=True).last.click()
