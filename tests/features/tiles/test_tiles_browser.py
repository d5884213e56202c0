"""Tiles in a real browser: their places, compared with GPS fixes."""

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect
from scene_of_tiles import DATUM, EAST, FIXES, colour, made_tiles, missing, number

from equipment.chromium import watched_tab
from equipment.webmap_process import page_of
from webmap.base.geometry import Affine
from webmap.base.local_plane import LocalPlane

pytestmark = pytest.mark.browser

HERE = Path(__file__).parents[1]
PLANE = LocalPlane(*DATUM, EAST)
CTM = """selector => {
  const m = document.querySelector(selector).getScreenCTM();
  return [m.a, m.b, m.c, m.d, m.e, m.f];
}"""


@pytest.fixture(scope="module")
def tiles(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("tiles")
    made_tiles(folder)
    return folder


@pytest.fixture(scope="module")
def url(tiles: Path) -> Iterator[str]:
    received = {"PYTHONPATH": str(HERE), "TILES": str(tiles)}
    with page_of(HERE / "scene_of_tiles.py", **received) as found:
        yield found


@pytest.fixture
def tab(chromium: Browser, url: str) -> Iterator[Page]:
    with watched_tab(chromium, 900, 700) as page:
        page.goto(url)
        page.locator("svg.webmap-view-control").wait_for()  # later the test moves it
        settled(page, 17)
        yield page


def settled(tab: Page, level: int) -> None:
    """Wait until all available tiles of one level are drawn, and no others."""
    tab.wait_for_function(
        """([level, missing]) => {
          const tiles = [...document.querySelectorAll('.tile')];
          if (tiles.length <= 5 || !tiles.every((tile) =>
            tile.dataset.tile.startsWith(level + '/') && tile.hasAttribute('href')))
            return false;
          const there = new Set([missing, ...tiles.map((tile) => tile.dataset.tile)]);
          const [, x, y] = tiles[0].dataset.tile.split('/').map(Number);
          const m = tiles[0].getScreenCTM().inverse();
          for (let u = 20; u < innerWidth; u += 40)
            for (let v = 20; v < innerHeight; v += 40) {
              const at = new DOMPoint(u, v).matrixTransform(m);
              const [column, row] = [x + Math.floor(at.x), y + Math.floor(at.y)];
              if (!there.has(`${level}/${column}/${row}`)) return false;
            }
          return true;
        }""",
        arg=[level, "/".join(map(str, missing()))],
    )
    tab.evaluate(
        """async () => {
          const tiles = [...document.querySelectorAll('.tile')];
          await Promise.all(tiles.map(async (tile) => {
            const image = new Image();
            image.src = tile.href.baseVal;
            await image.decode();
          }));
          await new Promise((done) => requestAnimationFrame(() =>
            requestAnimationFrame(done)));
        }"""
    )


def seen(tab: Page) -> np.ndarray:
    """Return the screen without the robots, of shape (h, w, 3)."""
    tab.evaluate(
        "for (const e of document.querySelectorAll('.robot'))"
        " e.style.visibility = 'hidden'"
    )
    return np.asarray(Image.open(io.BytesIO(tab.screenshot())).convert("RGB"))


def world(tab: Page) -> Affine:
    return Affine(*tab.evaluate(CTM, "svg.webmap .world"))


@pytest.mark.parametrize("level", [17, 18])
def test_tiles_and_satellite_fixes_are_drawn_at_their_true_positions(tab, level):
    if level == 18:
        for _ in range(2):
            before = tab.evaluate(CTM, "svg.webmap .world")[0]
            tab.mouse.move(450, 350)
            tab.mouse.wheel(0, -300)
            tab.wait_for_function(
                "before => document.querySelector('svg.webmap .world')"
                ".getScreenCTM().a !== before",
                arg=before,
            )
        settled(tab, 18)
    picture, view = seen(tab), world(tab)
    checked = 0
    for u in range(20, 880, 43):
        for v in range(20, 680, 37):
            lat, lon = PLANE.to_globe(*view.inverse.apply(u, v))
            x, y = number(level, lat, lon)
            near_an_edge = min(x % 1, y % 1, 1 - x % 1, 1 - y % 1) < 0.015
            tile = (level, int(x), int(y))
            if near_an_edge or tile == missing() or (picture[v, u] < 30).all():
                continue
            if v < 120 or (u > 700 and v > 600):  # the elements over the map
                continue
            assert np.abs(picture[v, u].astype(int) - colour(*tile)).max() <= 3, tile
            checked += 1
    assert checked > 150
    black = (picture < 40).all(axis=2)
    for number_, fix in enumerate(FIXES):
        selector = f'g.robot[data-name="{"AB"[number_]}"] .cross'
        matrix = tab.evaluate(CTM, selector)
        x, y = matrix[4], matrix[5]
        rows, columns = np.nonzero(
            black[int(y) - 12 : int(y) + 13, int(x) - 12 : int(x) + 13]
        )
        assert len(rows) > 20, fix
        off = (
            columns.mean() - 12 + int(x) + 0.5 - x,
            rows.mean() - 12 + int(y) + 0.5 - y,
        )
        assert np.hypot(*off) < 1.5, fix


def test_a_missing_tile_is_left_empty_without_a_notice(tab):
    z, x, y = missing()
    middle = (x + 0.5) / 2**z * 360 - 180
    lat = np.degrees(np.arctan(np.sinh(np.pi * (1 - 2 * (y + 0.5) / 2**z))))
    u, v = world(tab).apply(*PLANE.from_globe(float(lat), middle))
    assert tuple(seen(tab)[round(v), round(u)]) == (255, 255, 255)
    assert tab.locator(f'.tile[data-tile="{z}/{x}/{y}"]').count() == 0
    assert tab.locator(".webmap-notice").count() == 0


def test_the_attribution_of_tiles_is_shown_as_text(tab):
    expect(tab.locator(".webmap-attribution")).to_have_text("<b>Nobody's</b> tiles")


def test_a_moved_view_loads_other_tiles_within_the_limit(tab):
    before = tab.locator(".tile").evaluate_all("all => all.map((t) => t.dataset.tile)")
    tab.mouse.move(450, 350)
    tab.mouse.down()
    tab.mouse.move(100, 100, steps=5)
    tab.mouse.up()
    tab.wait_for_function(
        "before => [...document.querySelectorAll('.tile')].some((tile) =>"
        " !before.includes(tile.dataset.tile))",
        arg=before,
    )
    assert tab.locator(".tile").count() <= 30
