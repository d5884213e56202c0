"""The pixels that each type of marker covers in a real browser."""

import io
from collections.abc import Iterator
from pathlib import Path

import pytest
from PIL import Image
from playwright.sync_api import Browser
from shapes_of_markers import BLUE, RED, SHAPES

from equipment.chromium import watched_tab
from equipment.waiting import wait_for
from equipment.webmap_process import page_of

pytestmark = pytest.mark.browser

HERE = Path(__file__).parents[1]

PIXELS = """(places) => {
  const m = document.querySelector("svg.webmap .world").getScreenCTM();
  return places.map(([x, y]) => [m.a * x + m.c * y + m.e, m.b * x + m.d * y + m.f]);
}"""


@pytest.fixture(scope="module")
def colours(chromium: Browser) -> Iterator:
    """Return the colours at places of the world, in metres."""
    file = HERE / "scene_of_shapes.py"
    with (
        page_of(file, PYTHONPATH=str(HERE)) as url,
        watched_tab(chromium, 900, 700) as tab,
    ):
        tab.goto(url)
        shapes = tab.locator(".markers > .marker")
        shapes.nth(len(SHAPES) - 1).wait_for(state="attached")
        assert shapes.count() == len(SHAPES)
        tab.locator(".webmap-metre-grid").evaluate("grid => grid.remove()")

        def found(places) -> list[tuple[int, ...]]:
            picture = Image.open(io.BytesIO(tab.screenshot())).convert("RGB")
            pixels = tab.evaluate(PIXELS, list(places))
            return [picture.getpixel((round(u), round(v))) for u, v in pixels]

        wait_for(lambda: found([SHAPES["cube"].at]) == [BLUE], "a cube", page=tab)
        yield found


@pytest.mark.parametrize("name", SHAPES)
def test_a_marker_covers_only_the_pixels_of_its_shape(colours, name):
    shape = SHAPES[name]
    places = ((-3.4, -0.9), *shape.in_world(shape.blue + shape.red + shape.beside))
    empty, *found = colours(places)
    assert empty not in (RED, BLUE)
    assert found == [
        *([BLUE] * len(shape.blue)),
        *([RED] * len(shape.red)),
        *([empty] * len(shape.beside)),
    ]
