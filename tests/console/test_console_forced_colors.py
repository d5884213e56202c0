"""In forced colours, as the contrast themes of Windows, STOP keeps its look."""

import pytest
from console_ready import select
from playwright.sync_api import Page, expect

pytestmark = [pytest.mark.browser, pytest.mark.slow]

LOOK = """(e) => {
  const { backgroundColor, borderTopStyle, borderTopWidth } = getComputedStyle(e);
  const octagon = getComputedStyle(e, "::before");
  const shape = octagon.content === "none" ? null : octagon.backgroundColor;
  const border = borderTopStyle === "none" ? 0 : parseFloat(borderTopWidth);
  return { fill: backgroundColor, border, shape };
}"""

RED = "rgb(200, 16, 30)"
WHITE = "rgb(255, 255, 255)"


def force_colors(page: Page) -> None:
    page.emulate_media(forced_colors="active")
    assert page.evaluate("matchMedia('(forced-colors: active)').matches")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", ["desk", "phone"])
def test_forced_colors_leave_stop_its_fill_border_and_octagon(
    open_console, size, scheme
):
    page = open_console(size, scheme)
    if size == "phone":
        page.locator("#sheet").click()
    select(page, "Robot 1")
    force_colors(page)
    stop_all = page.get_by_role("button", name="STOP ALL")
    assert stop_all.evaluate(LOOK) == {"fill": RED, "border": 3, "shape": WHITE}
    one = page.get_by_role("button", name="STOP Robot 1", exact=True)
    assert one.evaluate(LOOK)["border"] == 3
    assert one.evaluate("(e) => getComputedStyle(e).borderTopColor") == RED
    # The mark of the state, the dot of the connection, and the selected row.
    mark = page.locator(".webmap-teleop-mark")
    assert mark.evaluate("(e) => getComputedStyle(e).forcedColorAdjust") == "none"
    dot = page.locator("#link > .dot")
    good = dot.evaluate("(e) => getComputedStyle(e).borderTopColor")
    assert dot.evaluate(LOOK)["fill"] == good
    bar = "(e) => getComputedStyle(e).borderLeftColor"
    rows = page.locator("#robots .row > button")
    expect(rows.nth(1)).to_have_attribute("aria-pressed", "true")
    assert rows.nth(1).evaluate(bar) != rows.nth(0).evaluate(bar)
