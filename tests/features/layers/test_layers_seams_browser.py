"""Tiles of a large grid have no seams in a real browser, near, far and turned."""

import io
import math
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect

from equipment.chromium import watched_tab
from equipment.webmap_process import page_of

pytestmark = pytest.mark.browser

HERE = Path(__file__).parents[1]

TILES = ".occupancy-grid > image[href]"


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    file = HERE / "page_of_grid_tiles.py"
    with page_of(file, PYTHONPATH=str(HERE)) as found:
        yield found


SCALED = """([scale, middle]) => {
  const svg = document.querySelector("svg.webmap");
  const world = svg.querySelector(".world");
  svg.style.background = "#000";
  const matrix = `matrix(${scale} 0 0 ${-scale} ${middle} ${middle})`;
  world.setAttribute("transform", matrix);
  for (const image of world.querySelectorAll("image"))
    image.toggleAttribute("data-far", 0.05 * scale < 1);
}"""

ZOOMS = [0.13, 0.21, 0.37, 1.0, 3.3]
"""The screen pixels per cell."""

SIDE = 900
"""The size of the screen, in pixels."""


@pytest.mark.parametrize(("path", "yaw"), [("", 0.0), ("turned", 0.3)])
def test_no_line_is_visible_between_tiles(chromium: Browser, url, path, yaw):
    """The background is black and all cells are white, so a seam would be grey."""
    darkest = {}
    with watched_tab(chromium, SIDE, SIDE) as tab:
        tab.goto(url)
        tab.goto(url.partition("?")[0] + path)
        expect(tab.locator(TILES)).to_have_count(9, timeout=30_000)
        for zoom in ZOOMS:
            tab.evaluate(SCALED, [zoom / 0.05, SIDE / 2 + 0.3])
            deadline = time.monotonic() + 15  # until the pictures are loaded
            while (found := darkest_of(tab, inside(zoom, yaw))) != 255:
                if time.monotonic() > deadline:
                    break
            darkest[zoom] = found
    assert darkest == dict.fromkeys(ZOOMS, 255)


def darkest_of(tab: Page, where: np.ndarray) -> int:
    picture = Image.open(io.BytesIO(tab.screenshot())).convert("L")
    seen = np.asarray(picture)[where]
    assert len(seen) > 1000
    return int(seen.min())


def inside(zoom: float, yaw: float) -> np.ndarray:
    """Return the pixels of the grid without its edge and covered parts."""
    y, x = np.mgrid[:SIDE, :SIDE] - SIDE / 2
    along = abs(x * math.cos(yaw) - y * math.sin(yaw))
    across = abs(x * math.sin(yaw) + y * math.cos(yaw))
    on_screen = (abs(x) < SIDE / 2 - 60) & (abs(y) < SIDE / 2 - 60)
    return on_screen & (along < 590 * zoom) & (across < 540 * zoom)
