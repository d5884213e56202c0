"""STOP and STOP ALL can be pressed and do not move, in every state and size."""

from collections.abc import Callable

import pytest
from playwright.sync_api import Page, expect

from equipment.chromium import end_stops, hold

pytestmark = pytest.mark.browser

ROBOTS = 10
"""Enough robots for a long list of stopped robots."""

SIZES = [
    (320, 480),
    (390, 844),
    (512, 300),
    (720, 450),
    (768, 1024),
    (844, 390),
    (932, 430),
    (897, 600),
    (1024, 600),
    (1180, 820),
    (1280, 800),
    (1440, 900),
    (3840, 2160),
]
"""Width and height in pixels: both sides of each breakpoint of the layout, and 1024x600
and 1440x900 at a zoom of 200 %."""

LOOK = """async () => {
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  const look = (name, label) => {
    const button = document.querySelector(name);
    const { x, y, width, height } = button.getBoundingClientRect();
    const hit = document.elementFromPoint(x + width / 2, y + height / 2);
    const stop = hit?.closest(".webmap-stop-button");
    const hits = stop && label.test(stop.textContent);
    const what = hits ? "" : (hit?.outerHTML.slice(0, 120) ?? "nothing");
    return { box: [x, y, width, height].map(Math.round), covered: what };
  };
  return {
    all: look(".webmap-stop-all", /^stop all$/i),
    one: look(".webmap-teleop-stop", /^stop$/i),
  };
}"""
"""The places of both buttons, and the element that covers the centre, if any."""

DRIVE = """async (change) => {
  const { page } = await import(document.querySelector('[src$="page.js"]').src);
  const { drive } = page;
  drive._receiveUnchanged ??= drive._receive;
  drive._receive = (message) =>
    drive._receiveUnchanged(
      message.op === "robot" ? { ...message, ...change } : message);
  for (const report of drive.robots.values()) {
    drive._receive({ op: "robot", ...report });
  }
}"""
"""Change fields in all reports that this page receives from the gate."""

LOSE_SIGN_IN = """async () => {
  const { page } = await import(document.querySelector('[src$="page.js"]').src);
  for (const name of Object.keys(localStorage)) {
    if (name.startsWith("webmap key")) localStorage.setItem(name, "lost");
  }
  page._link.renew();
  page.drive._link.lose();
}"""
"""Cut both connections and replace the key, so that the page has to sign in again."""


SOME_SIZES = [(390, 844), (1024, 600), (1440, 900)]
"""A phone, a small window and a desk."""


class Walk:
    """Checks a state of the page at some sizes."""

    def __init__(self, page: Page, sizes: list[tuple[int, int]]) -> None:
        self.page = page
        self.sizes = sizes
        self.boxes: dict[tuple[int, int], tuple] = {}
        self.wrong: list[str] = []

    def look(self, state: str) -> None:
        """Check at every size that both buttons can be pressed and have not moved."""
        for size in self.sizes:
            self.page.set_viewport_size({"width": size[0], "height": size[1]})
            seen = self.page.evaluate(LOOK)
            at = f"{state} at {size[0]}x{size[1]}"
            for name, button in seen.items():
                if button["covered"]:
                    self.wrong.append(f"{at}: {name} is covered by {button['covered']}")
                x, y, width, height = button["box"]
                if x < 0 or y < 0 or x + width > size[0] or y + height > size[1]:
                    self.wrong.append(f"{at}: {name} is out of sight: {button['box']}")
                if min(width, height) < 44:
                    self.wrong.append(f"{at}: {name} is too small: {button['box']}")
            boxes = tuple(button["box"] for button in seen.values())
            before = self.boxes.setdefault(size, boxes)
            if boxes != before:
                self.wrong.append(f"{at}: moved from {before} to {boxes}")
        self.page.set_viewport_size({"width": 1280, "height": 800})


def open_all(selector: str) -> str:
    return f"for (const e of document.querySelectorAll('{selector}')) e.open = true"


def close_all(selector: str) -> str:
    return f"for (const e of document.querySelectorAll('{selector}')) e.open = false"


def select(page: Page) -> None:
    page.locator("#robots .row", has_text="Robot 1").locator("button").first.click()
    expect(page.locator("#card")).to_be_visible()


def camera(page: Page) -> None:
    picture = page.get_by_role("img", name="Camera of Robot 1").first
    picture.scroll_into_view_if_needed()
    picture.click()
    expect(page.locator(".camera-panel")).to_be_visible()


def in_one_state_each(page: Page, look: Callable[[str], None]) -> None:
    """Open each part of the console, one after the other, beside the card."""
    page.locator("#card .button", has_text="Send goal…").click()
    expect(page.locator(".webmap-goal-word")).not_to_be_empty()
    look("choosing a goal")
    page.keyboard.press("g")
    expect(page.locator(".webmap-goal-word")).to_be_empty()
    panels = ".map details, #bridges > details"
    for index in range(page.locator(panels).count()):
        page.evaluate(f"document.querySelectorAll('{panels}')[{index}].open = true")
        look(f"panel {index}")
        page.evaluate(close_all(panels))
    page.evaluate(open_all(panels))
    look("every panel at once")
    page.locator("#bridges > details > summary").focus()
    page.evaluate(open_all("#bridges > details"))
    page.get_by_role("button", name="Check").first.click()
    expect(page.locator(".doctor:popover-open")).to_be_visible()
    look("the doctor's report")
    page.get_by_role("button", name="Close the report").click()
    page.evaluate(close_all(panels))
    save = page.locator(".webmap-export-go").first
    save.click()
    expect(save).to_have_attribute("aria-expanded", "true")
    look("the menu of saving")
    save.click()
    page.keyboard.press("?")
    expect(page.get_by_role("dialog", name="Keys and gestures")).to_be_visible()
    look("help")
    page.locator("#help-close").click()
    page.evaluate("document.querySelector('#sheet').click()")
    look("the sheet of a phone")
    page.evaluate("document.querySelector('#sheet').click()")
    camera(page)
    for button in ("side", "below", "float", "wall", "full"):
        page.evaluate(f"document.querySelector('.camera-{button}').click()")
        look(f"the camera, {button}")
    page.locator(".camera-close").click()


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize("sizes", [SOME_SIZES, SIZES], ids=["some sizes", "all sizes"])
def test_both_stop_buttons_can_be_pressed_and_do_not_move_in_every_state(
    open_console, sizes
):
    page = open_console()
    walk = Walk(page, sizes)
    walk.look("no robot selected")
    select(page)
    walk.look("selected")
    hold(page.keyboard, "a", page.locator("#card .state .you").is_visible)
    walk.look("driving")
    page.keyboard.up("a")
    in_one_state_each(page, walk.look)
    page.keyboard.press("Escape")
    expect(page.locator("#card .state .holder")).to_have_text("STOP active")
    walk.look("stopped")
    page.evaluate(DRIVE, {"alarm": "moves at 1.00 m/s although it was sent zero"})
    expect(page.locator(".webmap-alarm")).to_be_visible()
    walk.look("the alarm")
    page.evaluate(DRIVE, {"alarm": None})
    expect(page.locator(".webmap-alarm")).to_have_count(0)
    open_console.allowed += ["WebSocket connection to", "401"]
    page.evaluate(LOSE_SIGN_IN)
    expect(page.get_by_text("not signed in")).to_be_visible()
    expect(page.locator("html.disconnected")).to_have_count(1)
    walk.look("sign-in lost")
    assert not walk.wrong, "\n".join(walk.wrong[:20])


@pytest.mark.parametrize("size", SOME_SIZES)
def test_the_stop_buttons_of_the_alarm_are_at_the_same_places_and_send_stop(
    open_console, size
):
    page = open_console()
    page.set_viewport_size({"width": size[0], "height": size[1]})
    places = {
        name: page.locator(button).bounding_box()
        for name, button in (
            ("all", ".webmap-stop-all"),
            ("one", ".webmap-teleop-stop"),
        )
    }
    page.locator("#robots .row button").nth(2).evaluate("e => e.click()")
    expect(page.locator(".webmap-teleop-stop")).to_be_enabled()
    page.evaluate(DRIVE, {"alarm": "moves at 1.00 m/s although it was sent zero"})
    alarm = page.locator(".webmap-alarm")
    expect(alarm).to_be_visible()
    twins = alarm.locator(".webmap-stop-twin")
    expect(twins).to_have_count(2)
    # There is only one STOP ALL.
    expect(alarm.get_by_role("button", name="STOP ALL")).to_have_count(1)
    seen = alarm.get_by_role("button", name="Acknowledge")
    expect(seen).to_be_in_viewport(ratio=1)
    sent = """async () => {
      const { page } = await import(document.querySelector('[src$="page.js"]').src);
      page.sentStops ??= [];
      page.drive.on("stop", (robot) => page.sentStops.push(robot));
    }"""
    page.evaluate(sent)
    for box in places.values():
        page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    stops = page.evaluate(
        """async () => (await import(
          document.querySelector('[src$="page.js"]').src)).page.sentStops"""
    )
    assert stops[0] == "*"
    assert len(stops) == 2
    assert stops[1] not in {"*", ""}
    seen.click()
    expect(alarm).to_have_count(0)
    end = page.locator(".webmap-stop-list .webmap-reset")
    expect(end).to_be_visible()
    page.evaluate(DRIVE, {"alarm": None})
    end.evaluate(
        """async (e) => {
          e.click();
          await new Promise((done) => setTimeout(done, 450));
          e.click();
        }"""
    )


@pytest.mark.parametrize("size", ["phone", "on its side", "small phone"])
def test_the_results_of_stop_cover_no_list_on_a_phone(open_console, size):
    page = open_console(size)
    page.locator("#sheet").click()
    page.keyboard.press("Shift+Escape")
    results = page.locator(".webmap-stop-list")
    expect(results).to_contain_text(f"{ROBOTS} of {ROBOTS} stopped, confirmed")
    one, other = results.bounding_box(), page.locator("#panel").bounding_box()
    apart = max(
        other[start] - one[start] - one[size]
        for start, size in (("x", "width"), ("y", "height"))
    )
    beside = one["x"] - other["x"] - other["width"]
    assert max(apart, beside) >= 0
    assert other["height"] > 90  # some of the list is left
    end_stops(page.locator(".webmap-stop-list .webmap-reset"))
