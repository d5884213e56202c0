"""STOP, the stick and the state of motion are visible, whatever else is open."""

import pytest
from console_ready import assert_free
from playwright.sync_api import expect

from equipment.chromium import end_stops
from equipment.waiting import polls

pytestmark = [pytest.mark.browser, pytest.mark.slow]

ROBOTS = 10
"""Enough robots for a long list of stopped robots."""

PANELS = """() => [...document.querySelectorAll("details")]
  .filter((e) => e.querySelector("summary").checkVisibility()).length"""

OPEN_PANEL = """(index) => [...document.querySelectorAll("details")]
  .filter((e) => e.querySelector("summary").checkVisibility())
  .forEach((e, i) => { e.open = index === null || i === index; })"""


@pytest.mark.parametrize("size", ["desk", "phone", "on its side", "small phone"])
def test_stop_can_be_pressed_and_works_with_any_panel_open(open_console, size):
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
    expect(page.locator(".webmap-stop-verdict")).to_contain_text(f"of {ROBOTS} stopped")
    expect(page.locator(".webmap-stop-standing")).to_contain_text(f"{ROBOTS} robots")
    expect(help_).to_be_hidden()
    reset()
    # The first Esc closes the help; the next Esc is STOP.
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


ON_ITS_SIDE = """() => {
  const box = (name) => document.querySelector(name).getBoundingClientRect();
  const stop = document.querySelector(".webmap-stop-all");
  const word = document.createRange();
  word.selectNodeContents(stop);
  const { left, right } = word.getBoundingClientRect();
  const edges = stop.getBoundingClientRect();
  const octagon = parseFloat(getComputedStyle(stop, "::before").width);
  return {
    "STOP is at the left": edges.left < 16 && edges.bottom > innerHeight - 16,
    "STOP ALL has room": left - octagon - edges.left > 10 && edges.right - right > 5,
    "the stick is at the right": box(".webmap-stick").right > innerWidth - 20,
    "the map fills the screen": box("#map").width === innerWidth,
    "the list is behind a button": !document.querySelector("#robots").checkVisibility(),
  };
}"""


def test_a_phone_on_its_side_has_stop_left_the_stick_right_and_the_map_between(
    open_console,
):
    page = open_console("on its side")
    page.locator("#sheet").click()
    page.locator("#robots .row", has_text="Robot 1").locator("button").first.click()
    page.locator("#sheet").click()
    for width, height in [(844, 390), (915, 412), (932, 430), (956, 440)]:
        page.set_viewport_size({"width": width, "height": height})
        # The page lays itself out after the change.
        for _ in polls(f"the layout in {width} x {height}"):
            seen = page.evaluate(ON_ITS_SIDE)
            if all(seen.values()):
                break
            page.wait_for_timeout(50)
    # A small desktop window, and a tablet with an open keyboard.
    for width, height in [(932, 600), (1180, 420)]:
        page.set_viewport_size({"width": width, "height": height})
        expect(page.locator("#robots")).to_be_visible()


@pytest.mark.parametrize(
    ("size", "keyboard"), [("phone", 300), ("on its side", 160), ("small phone", 250)]
)
def test_an_on_screen_keyboard_does_not_cover_stop(open_console, size, keyboard):
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
