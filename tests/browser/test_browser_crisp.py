"""A map has sharp pixels when zoomed in, and keeps its walls when zoomed out."""

import io

import pytest
from PIL import Image
from playwright.sync_api import expect

from equipment.chromium import watched_tab
from equipment.processes import WEB, running
from equipment.waiting import wait_for

pytestmark = pytest.mark.browser

SIZE, CELL, APART = 640, 0.05, 40
"""Pixels on each side of the picture, metres across one, and pixels between walls."""

MAPS = [("one", ".images > image"), ("two", ".map-file > image")]
both = pytest.mark.parametrize(("map", "image"), MAPS)

PROGRAM = f"""
from pathlib import Path

import webmap

SIDE = {SIZE * CELL}


@webmap.page("/", html="index.html")
def main(page):
    one = webmap.Map(page.element("one"), 400, 400)
    one.add_image("map.png", -SIDE / 2, -SIDE / 2, SIDE, SIDE)
    other = webmap.Map(page.element("two"), 400, 400)
    other.add_module("MapFile", Path(__file__).with_name("map.yaml"))

    def fit(side):
        for map in (one, other):
            map.fit(-side / 2, -side / 2, side, side)

    page.element("near").on("click", lambda event: fit(2.5))
    page.element("far").on("click", lambda event: fit(4 * SIDE))


webmap.run()
"""

PAGE = """<!doctype html>
<title>Maps</title>
<link rel="stylesheet" href="style.css">
<button id="near">Near</button><button id="far">Far</button>
<div id="one"></div>
<div id="two"></div>
"""

YAML = f"""
image: map.png
resolution: {CELL}
origin: [{-SIZE * CELL / 2}, {-SIZE * CELL / 2}, 0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.25
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("maps")
    picture = Image.new("L", (SIZE, SIZE), 255)
    for x in range(APART // 2, SIZE, APART):
        picture.paste(0, (x, 0, x + 1, SIZE))  # a wall that is one pixel thick
    picture.save(folder / "map.png")
    (folder / "map.yaml").write_text(YAML)
    (folder / "maps.py").write_text(PROGRAM)
    (folder / "index.html").write_text(PAGE)
    (folder / "style.css").write_text("")
    return folder


@pytest.fixture(scope="module")
def server(folder):
    command = ("run", folder / "maps.py", "--port", 0, "--no-browser")
    with running(*command, pattern=WEB) as process:
        yield process


@pytest.fixture
def page(server, chromium):
    with watched_tab(chromium, 900, 900) as tab:
        tab.goto(server.url)
        for _, image in MAPS:
            expect(tab.locator(f"{image}[href]")).to_be_attached()
        yield tab


def look(page, how):
    page.get_by_role("button", name=how).click()
    sized = 150.0 if how == "Near" else 4.0
    wait_for(
        lambda: page.evaluate(
            "sized => [...document.querySelectorAll('.world')].every(world =>"
            "  (world.getCTM().a > 100) === (sized > 100))",
            sized,
        ),
        what=how,
    )


def rendering(page, image):
    return page.locator(image).evaluate("e => getComputedStyle(e).imageRendering")


def row(page, map):
    """Return the grey of the pixels across the middle of a map."""
    shot = page.locator(f"#{map} svg.webmap").screenshot()
    picture = Image.open(io.BytesIO(shot)).convert("L")
    return [picture.getpixel((x, 200)) for x in range(picture.width)]


@both
def test_a_zoomed_in_map_has_sharp_edges(page, map, image):
    look(page, "Near")
    assert rendering(page, image) == "pixelated"
    assert len(set(row(page, map)[40:-40])) == 2, "no grey between wall and floor"


@both
def test_a_zoomed_out_map_shows_every_wall(page, map, image):
    look(page, "Far")
    assert rendering(page, image) == "auto"
    greys = row(page, map)
    side = SIZE * CELL * page.locator(f"#{map} .world").evaluate("e => e.getCTM().a")
    found = 0
    for wall in range(SIZE // APART):
        x = 200 - side / 2 + side * (APART / 2 + wall * APART) / SIZE
        around = greys[int(x) - 1 : int(x) + 3]
        found += min(around) < max(around) - 5
    assert found == SIZE // APART
    look(page, "Near")
    assert rendering(page, image) == "pixelated"


def test_a_css_rule_of_the_page_overrides_the_image_rendering(page, folder):
    (folder / "style.css").write_text("svg.webmap image { image-rendering: auto; }")
    try:
        page.reload()
        look(page, "Near")
        for _, image in MAPS:
            assert rendering(page, image) == "auto"
    finally:
        (folder / "style.css").write_text("")
