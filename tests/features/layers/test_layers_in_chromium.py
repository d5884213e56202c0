"""Layers in a real browser: their places on the screen and their colours."""

import io
import math
from collections.abc import Iterator
from pathlib import Path

import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect

from equipment.chromium import watched_tab
from equipment.waiting import wait_for
from equipment.webmap_process import page_of

pytestmark = pytest.mark.browser

HERE = Path(__file__).parents[1]
WALL, FREE, BLUE = (0, 0, 0), (255, 255, 255), (0, 0, 255)
LETHAL = pytest.approx((132, 126, 237), abs=3)

POINT = """([selector, x, y]) => {
  const m = document.querySelector(selector).getScreenCTM();
  return [m.a * x + m.c * y + m.e, m.b * x + m.d * y + m.f];
}"""


TOGETHER = """(robot) => {
  const on = (selector, x, y) => {
    const m = document.querySelector(selector).getScreenCTM();
    return [m.a * x + m.c * y + m.e, m.b * x + m.d * y + m.f];
  };
  const box = document.querySelector(".pointcloud > .dot").getBoundingClientRect();
  return {
    dot: [box.x + box.width / 2, box.y + box.height / 2],
    ahead: on(robot, 1, 0),
    corner: on(".polygon > polygon", 0.3, 0.2),
    left: on(robot, 0.3, 0.2),
  };
}"""
"""The parts of a moving robot and their places, read at one time."""


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    file = HERE / "scene_of_layers.py"
    with page_of(file, PYTHONPATH=str(HERE)) as found:
        yield found


@pytest.fixture
def tab(chromium: Browser, url: str) -> Iterator[Page]:
    with watched_tab(chromium, 900, 700) as page:
        page.goto(url)
        page.wait_for_selector(".occupancy-grid.map > image[href]", state="attached")
        page.wait_for_selector(".path > polyline[points]", state="attached")
        await_colours(page, [WALL, LETHAL], floor(0.5, 0.5), (-0.5, 1.1))
        yield page


def on_screen(tab: Page, x: float, y: float, of: str = "svg.webmap .world"):
    """Return where a point in an element's coordinates is on the screen."""
    return tab.evaluate(POINT, [of, x, y])


def colours(tab: Page, *places: tuple[float, float]) -> list[tuple[int, ...]]:
    """Return the colours now drawn at places of the world, in metres."""
    picture = Image.open(io.BytesIO(tab.screenshot())).convert("RGB")
    pixels = [on_screen(tab, x, y) for x, y in places]
    return [picture.getpixel((round(u), round(v))) for u, v in pixels]


def await_colours(tab: Page, wanted: list, *places: tuple[float, float]) -> None:
    """Wait until images are drawn; they have addresses before they have pixels."""
    wait_for(
        lambda: colours(tab, *places) == wanted,
        lambda: f"{wanted}, not {colours(tab, *places)}",
        page=tab,
    )


def floor(x: float, y: float) -> tuple[float, float]:
    """Return a place of the floor in the world, from its lower left corner."""
    cos, sin = math.cos(0.2), math.sin(0.2)
    return -3 + cos * x - sin * y, -2 + sin * x + cos * y


def test_the_map_is_drawn_in_place_while_it_is_updated(tab):
    corner = [(0.1, 0.1), (0.9, 0.1), (0.1, 0.9), (0.9, 0.9)]
    beside = [(1.1, 0.5), (0.5, 1.1), (0.1, 3.9), (5.0, 0.1)]
    for _ in range(3):  # the page is drawn again twenty times a second meanwhile
        assert colours(tab, *(floor(*at) for at in corner + beside)) == [
            *([WALL] * 4),
            *([FREE] * 4),
        ]


def test_costs_are_drawn_over_the_map_and_free_cells_are_transparent(tab):
    row = [(-0.7, 1.1), (-0.5, 1.1), (-0.3, 1.1)]
    assert colours(tab, *row) == [FREE, LETHAL, FREE]


def test_cube_and_text_markers_are_drawn_at_their_positions(tab):
    assert colours(tab, (-1.5, 0.25), (-1.5, 0.65)) == [BLUE, FREE]
    text = tab.locator(".marker.text > text")
    expect(text).to_have_text("<b>Küche</b>")
    box = text.bounding_box()
    x, y = on_screen(tab, 0, 0.4)
    assert abs(box["x"] + box["width"] / 2 - x) < 6
    assert abs(box["y"] + box["height"] / 2 - y) < 12
    assert box["width"] > box["height"], "the box is not upright"


def test_a_path_stays_while_a_cloud_and_a_footprint_move_with_the_robot(tab):
    robot = 'svg.webmap g.robot[data-name="Bob"]'
    before = on_screen(tab, 0, 0, robot)
    for _ in range(2):
        for at in [(1, -1), (2, 1)]:
            drawn = on_screen(tab, *at, of=".path > polyline")
            assert drawn == pytest.approx(on_screen(tab, *at), abs=0.5)
        found = tab.evaluate(TOGETHER, robot)
        assert found["dot"] == pytest.approx(found["ahead"], abs=2)
        assert found["corner"] == pytest.approx(found["left"], abs=0.5)
        tab.wait_for_function(
            "([selector, before]) => {"
            " const m = document.querySelector(selector).getScreenCTM();"
            " return Math.hypot(m.e - before[0], m.f - before[1]) > 9; }",
            arg=[robot, before],
        )


def test_an_invalid_costmap_gives_one_notice_and_the_last_costmap_stays(tab):
    tab.goto(tab.url + "broken")
    notice = tab.locator(".webmap-notice")
    expect(notice).to_contain_text("/costs: got 3 cells for a grid of 10 x 1 cells")
    expect(notice).to_have_count(1)
    await_colours(tab, [LETHAL], (-0.5, 1.1))
