"""Space is STOP at every element of the console that can have the focus.

The exceptions are the elements where text is typed, and a few kinds of control that the
Tab key reached, while the page has control of no robot and no goal of it is under way.
"""

import re
from collections.abc import Callable

import pytest
from console_ready import expect_state, select, send_away, shown_state, unfold
from playwright.sync_api import Page, expect

from equipment.chromium import end_stops

pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.serial]

PREPARE = """async () => {
  const base = document.querySelector('[src$="page.js"]').src;
  const { Drive } = await import(new URL("drive.js", base));
  const stop = Drive.prototype.stop;
  window.walk = { on: false, stops: 0, seen: new Set() };
  Drive.prototype.stop = function (robot) {
    if (!walk.on) return stop.call(this, robot);
    walk.stops += 1;
    return true;
  };
  // Neither a click nor a key changes the state of the page during a walk.
  addEventListener("click", (event) => {
    if (!walk.on) return;
    event.preventDefault();
    event.stopImmediatePropagation();
  }, { capture: true });
  for (const kind of ["keydown", "keyup"]) addEventListener(kind, (event) => {
    if (walk.on && event.key === " ") event.preventDefault();
  });
}"""
"""Count the STOPs of the page during a walk and send them otherwise."""

ELEMENTS = """(within) => {
  const all = "a[href], button, input, select, textarea, summary, [tabindex]";
  const found = [...document.querySelectorAll(within)].flatMap((root) => [
    ...root.querySelectorAll(all)
  ]);
  return found.flatMap((e) => {
    e.scrollIntoView?.({ block: "nearest" });
    const { x, y, width, height } = e.getBoundingClientRect();
    const at = [x + width / 2, y + height / 2];
    const hit = document.elementFromPoint(...at);
    return !e.disabled && hit && e.contains(hit) ? [[e, at]] : [];
  }).map(([e, at], i) => {
    e.dataset.walk = i;
    return at;
  });
}"""

TYPED = """(e) => e.matches(
  "textarea, input:not([type=checkbox], [type=radio], [type=range])")"""

KEPT = """(e) => e.matches(
  "input[type=checkbox], input[type=radio], input[type=range], select, summary, " +
  "[role=separator], [role=slider], [role=listbox]")"""

FOCUS = f"""() => {{
  const e = document.activeElement;
  const about = e.outerHTML.slice(0, 110);
  const first = !walk.seen.has(e);
  walk.seen.add(e);
  return {{ about, first, typed: ({TYPED})(e), kept: ({KEPT})(e) }};
}}"""


class Walker:
    """Presses Space at every element of a state, and notes where it is not STOP."""

    def __init__(self, page: Page) -> None:
        self.page = page
        self.wrong: list[str] = []
        self.pressed = self.tabbed = 0
        page.evaluate(PREPARE)

    def stops(self) -> bool:
        """Press Space; return whether that was STOP."""
        self.page.evaluate("walk.stops = 0")
        self.page.keyboard.press("Space")
        return self.page.evaluate("walk.stops") == 1

    def by_pointer(self, state: str, within: str = "body") -> None:
        """Press each element with the mouse, then Space."""
        self.page.evaluate("walk.on = true")
        for x, y in self.page.evaluate(ELEMENTS, within):
            self.page.mouse.click(x, y)
            if self.page.evaluate("document.activeElement.matches('select')"):
                # An open list of the browser receives all keys; Escape closes it.
                self.page.keyboard.press("Escape")
            stopped, focus = self.stops(), self.page.evaluate(FOCUS)
            self.pressed += 1
            if stopped == focus["typed"]:
                self.wrong.append(
                    f"{state}, pointer, STOP: {stopped}: {focus['about']}"
                )
        self.page.evaluate("walk.on = false")

    def by_tab(self, state: str, *, drives: bool = False) -> None:
        """Go to each element with the Tab key, then press Space."""
        self.page.evaluate("walk.on = true; walk.seen.clear()")
        for _ in range(200):
            self.page.keyboard.press("Tab")
            stopped, focus = self.stops(), self.page.evaluate(FOCUS)
            if not focus["first"]:
                break
            self.tabbed += 1
            keeps = focus["typed"] or (focus["kept"] and not drives)
            if stopped == keeps:
                self.wrong.append(f"{state}, Tab, STOP: {stopped}: {focus['about']}")
        self.page.evaluate("walk.on = false")

    def escape(self) -> None:
        """Close a menu if it is still open; Escape is no STOP here."""
        self.page.evaluate("walk.on = true")
        self.page.keyboard.press("Escape")
        self.page.evaluate("walk.on = false")

    def both(self, state: str, within: str = "body") -> None:
        self.by_pointer(state, within)
        self.by_tab(state)


def walk_beside_a_robot(walker: Walker) -> None:
    """Walk through one state: a robot is selected."""
    select(walker.page, "Robot 1")
    walker.both("a robot is selected")
    assert walker.pressed > 25
    assert walker.tabbed > 25


def walk_all(walker: Walker) -> None:
    """Walk through all states of the console."""
    page = walker.page
    walker.both("no robot is selected")
    select(page, "Robot 1")
    unfold(page)
    walker.both("a robot is selected")
    panels = page.evaluate("document.querySelectorAll('details').length")
    for index in range(panels):
        opened = page.evaluate(
            """(index) => {
              const e = document.querySelectorAll("details")[index];
              e.open = e.querySelector("summary").checkVisibility();
              e.dataset.walked = index;
              return e.open;
            }""",
            index,
        )
        if opened:
            walker.both(f"panel {index} is open", f"[data-walked='{index}']")
            page.evaluate(f"document.querySelectorAll('details')[{index}].open = false")
    page.locator(".webmap-teleop-fold").click()
    walker.by_pointer("figures are shown", ".drive-bar")
    page.locator("#robots .row .besides").nth(2).click()
    walker.both("two robots are selected")
    page.get_by_role("button", name="Clear", exact=True).click()
    page.locator(".webmap-export-go").first.click()
    walker.both("the menu of saving is open", ".webmap-export-group, [role=menu]")
    walker.escape()
    page.keyboard.press("Control+k")
    walker.both("the palette is open", "#palette")
    walker.escape()
    page.keyboard.press("?")
    walker.both("the help is open", "#help")
    page.locator("#help-close").click()
    page.get_by_role("img", name="Camera of Robot 1").first.click()
    expect(page.locator(".camera-panel")).to_be_visible()
    walker.both("a camera is large", ".camera-panel, #card")
    page.locator(".camera-close").click()
    page.get_by_role("button", name=re.compile("^Take control")).click()
    expect_state(page, "You have control")
    walker.by_pointer("this page has control", "#card, #panel, .drive-bar, .bar")
    walker.by_tab("this page has control", drives=True)
    page.keyboard.press("Shift+Escape")
    expect_state(page, "STOP active")
    walker.both("STOP is active")
    end_stops(page.locator(".webmap-stop-list .webmap-reset"))
    assert walker.pressed > 150
    assert walker.tabbed > 300


@pytest.mark.timeout(300)
@pytest.mark.parametrize("walk", [walk_beside_a_robot, walk_all], ids=["one", "all"])
def test_space_is_stop_at_every_element_of_every_state(open_console, walk):
    walker = Walker(open_console())
    walk(walker)
    assert walker.wrong == []


def click_layers_twice(page: Page) -> None:
    for _ in range(2):
        page.locator(".webmap-layers > summary").click()


def tick_another(page: Page) -> None:
    page.locator("#robots .row .besides input").nth(2).click(force=True)


def send_a_goal_then_tab(page: Page) -> None:
    send_away(page)
    page.get_by_role("button", name=re.compile("^Release control")).click()
    for _ in range(80):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.matches('summary')"):
            return
    raise AssertionError("the Tab key reaches no section")


@pytest.mark.parametrize(
    "act", [click_layers_twice, tick_another, send_a_goal_then_tab]
)
def test_space_stops_the_selected_robot_after(
    open_console, act: Callable[[Page], None]
):
    page = open_console()
    select(page, "Robot 1")
    expect(shown_state(page)).not_to_have_text("STOP active")
    act(page)
    page.keyboard.press("Space")
    expect(shown_state(page)).to_have_text("STOP active")
    expect(page.locator(".webmap-layers")).not_to_have_attribute("open", "")
    end_stops(page.locator(".webmap-stop-list .webmap-reset"))
