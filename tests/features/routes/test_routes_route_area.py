"""An area is drawn on the map in a real browser and becomes points of a route."""

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from equipment.chromium import watched_tab
from equipment.webmap_process import page_of

pytestmark = pytest.mark.browser

FIELD = [(14.0, 4.0), (20.0, 4.0), (20.0, 6.9), (14.0, 6.9)]
"""The corners of the area in metres, to the right of the panel."""

NEAR = 0.08
"""The rounding of corners to pixels, in metres; directions are rounded, too."""

SCREEN = """([x, y]) => {
  const m = document.querySelector('svg.webmap .world').getScreenCTM();
  return [m.a * x + m.c * y + m.e, m.b * x + m.d * y + m.f];
}"""


@pytest.fixture(scope="module")
def state(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("state")


@pytest.fixture(scope="module")
def url(state) -> Iterator[str]:
    where = {"WEBMAP_STATE_DIR": str(state)}
    with page_of(Path(__file__).parents[1] / "page_of_route.py", **where) as url:
        yield url


@pytest.fixture
def tab(chromium: Browser, url: str) -> Iterator[Page]:
    with watched_tab(chromium, 1200, 800) as page:
        page.goto(url)
        page.locator(".webmap-route > summary").click()
        page.get_by_role("button", name="Area", exact=True).click()
        yield page


def press(tab: Page, *corners: tuple[float, float]) -> None:
    for corner in corners:
        tab.mouse.click(*tab.evaluate(SCREEN, corner))


def status(tab: Page):
    return tab.locator(".webmap-route > .webmap-tool-body > .webmap-route-word")


def swept(tab: Page) -> list[float]:
    """Return x and y of the ends of each sweep that is drawn."""
    drawn = tab.locator(".webmap-area-sweeps").get_attribute("d") or ""
    return [float(number) for number in re.findall(r"-?[\d.]+(?:e-?\d+)?", drawn)]


def test_an_area_pressed_on_the_map_becomes_points_of_the_route(tab, state):
    press(tab, *FIELD)
    three = [14.5, 4.5, 19.5, 4.5, 19.5, 5.45, 14.5, 5.45, 14.5, 6.4, 19.5, 6.4]
    assert swept(tab) == pytest.approx(three, abs=NEAR)
    press(tab, FIELD[0])
    expect(status(tab)).to_have_text("6 points, 3 sweeps.")
    assert swept(tab) == pytest.approx(three, abs=NEAR)
    box = tab.locator(".webmap-area-sweeps").bounding_box()
    middle = [box["x"] + box["width"] / 2, box["y"] + box["height"] / 2]
    assert middle == pytest.approx(tab.evaluate(SCREEN, (17, 5.45)), abs=3)

    tab.get_by_role("button", name="Across").click()
    expect(status(tab)).to_have_text("12 points, 6 sweeps.")
    tab.get_by_role("button", name="Across").click()
    tab.get_by_label("Spacing in m").fill("0")
    expect(status(tab)).to_have_text("Got 0 m, expected a spacing of 0.2 to 20 m.")
    expect(tab.get_by_role("button", name="Add to route")).to_be_disabled()
    tab.get_by_label("Spacing in m").fill("1.5")
    expect(status(tab)).to_have_text("4 points, 2 sweeps.")
    tab.get_by_role("button", name="Add to route").click()
    expect(tab.locator(".webmap-route-point")).to_have_count(4)
    expect(tab.locator(".webmap-area")).to_be_hidden()
    assert swept(tab) == []

    tab.locator(".webmap-route-name").fill("Field")
    tab.locator(".webmap-route-save").click()
    expect(tab.locator(".webmap-route-saved")).to_contain_text("Saved as Field.")
    (file,) = (state / "routes").glob("*.json")
    points = json.loads(file.read_text())["routes"]["Field"]["points"]
    places = [coordinate for point in points for coordinate in (point["x"], point["y"])]
    two = [14.75, 4.75, 19.25, 4.75, 19.25, 6.15, 14.75, 6.15]
    assert places == pytest.approx(two, abs=NEAR)
    headings = [math.cos(point["yaw"]) for point in points]
    assert headings == pytest.approx([1, 1, -1, -1], abs=0.01)


def test_an_invalid_area_is_refused_with_a_reason_and_escape_discards_an_area(tab):
    first, second, third, fourth = FIELD
    press(tab, first, second)
    # The element has the focus, so that the keyboard continues there.
    expect(tab.get_by_role("button", name="Done")).to_be_focused()
    tab.keyboard.press("Enter")
    expect(status(tab)).to_have_text("Got 2 corners, expected at least 3. Add corners.")
    press(tab, fourth, third)
    tab.evaluate("document.activeElement.blur()")
    tab.keyboard.press("Enter")
    expect(status(tab)).to_contain_text("Sides 2 and 4 cross or touch")
    for _ in range(2):
        tab.get_by_role("button", name="Undo").click()
    press(tab, third)
    tab.evaluate("document.activeElement.blur()")
    tab.keyboard.press("Enter")
    expect(tab.get_by_role("button", name="Add to route")).to_be_enabled()
    tab.keyboard.press("Escape")
    expect(tab.get_by_role("button", name="Area", exact=True)).to_be_visible()
    expect(tab.locator(".webmap-area-outline")).to_have_attribute("d", "")
    expect(tab.locator(".webmap-route-point")).to_have_count(0)


def test_route_points_persist_after_a_reconnect(tab):
    press(tab, *FIELD, FIELD[0])
    tab.get_by_role("button", name="Add to route").click()
    expect(tab.locator(".webmap-route-point")).to_have_count(6)
    # The old elements are removed when the map is drawn again.
    tab.evaluate("document.querySelector('.webmap-route').dataset.old = 'yes'")
    tab.evaluate("import('/_webmap/web/page.js').then(({page}) => page._link.renew())")
    expect(tab.locator(".webmap-route[open]:not([data-old])")).to_be_visible()
    expect(tab.locator(".webmap-route-point")).to_have_count(6)
    expect(tab.locator(".webmap-route-list li")).to_have_count(6)
