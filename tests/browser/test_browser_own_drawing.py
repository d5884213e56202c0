"""Own drawings of a program, on a page without an HTML file, are shown."""

import io

import pytest
from PIL import Image
from playwright.sync_api import expect

from equipment.chromium import watched_tab
from equipment.processes import WEB, running
from equipment.waiting import wait_for

pytestmark = pytest.mark.browser

RED, BLUE, GREEN = (200, 30, 30), (30, 30, 200), (30, 200, 30)

PROGRAM = """
import webmap
from webmap import html, svg


def picture(href):
    # In the world y is up, and an image has its top where y is least.
    place = {"x": -2, "y": -1, "width": 4, "height": 2}
    return svg.image(href=href, transform="scale(1 -1)", **place)


ann = webmap.Robot("Ann", picture("robot.png"))
bob = webmap.Robot("Bob", picture("nowhere.png"))
bob.svg.set_pose(0.0, 3.0, 0.0)


class Report:
    def __init__(self, map, words):
        self.map, self.words = map, words

    def on_view(self):
        place = self.map.get_bounding_rect()
        self.words.text = f"{place.left:.0f} {place.top:.0f}"


@webmap.page("/")
def main(page):
    words, cell = html.p(class_="words"), html.td()
    table = html.table(html.tr(html.td("to the left"), cell))
    page.element("webmap_container").append(table, words)
    map = webmap.Map(cell, 600, 400)
    map.scale(50)
    map.add_robot(ann)
    map.add_robot(bob)
    badge = svg.rect(class_="badge", x=10, y=20, width=30, height=40, fill="#1ec81e")
    map.root.append(badge)
    map.world.append(svg.rect(class_="slab", x=-5, y=-3, width=2, height=1))
    map.add_module(Report, words)


webmap.run()
"""


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    folder = tmp_path_factory.mktemp("drawing")
    picture = Image.new("RGB", (40, 20), BLUE)
    picture.paste(RED, (20, 0, 40, 20))  # its nose
    picture.save(folder / "robot.png")
    (folder / "drawing.py").write_text(PROGRAM)
    command = ("run", folder / "drawing.py", "--port", 0, "--no-browser")
    with running(*command, pattern=WEB) as process:
        yield process


@pytest.fixture(scope="module")
def page(server, chromium):
    with watched_tab(chromium, 900, 600) as tab:
        tab.allowed.append("404")  # the image that does not exist
        tab.goto(server.url)
        tab.locator(".robot").nth(1).wait_for(state="attached")
        yield tab


def colour(page, x, y):
    """Return the colour at a distance in pixels from the map's left and top."""
    shot = page.locator("svg.webmap").screenshot()
    return Image.open(io.BytesIO(shot)).convert("RGB").getpixel((x, y))


def test_an_image_file_beside_the_program_is_drawn_as_the_robot(page):
    # Two metres to each side of the middle, at 50 pixels to the metre.
    wait_for(lambda: colour(page, 230, 200) == BLUE, what="the rear")
    assert colour(page, 370, 200) == RED


def test_an_image_that_cannot_be_loaded_is_reported_on_the_page_and_in_the_log(
    page, server
):
    expect(page.locator(".webmap-notice")).to_contain_text("/nowhere.png could not be")
    wait_for(lambda: "image /nowhere.png could not be" in server.log, what="the log")


def test_css_nth_child_finds_robots_among_other_elements_of_the_world(page):
    assert page.evaluate(
        "['.robot:nth-child(1)', '.robot:nth-child(2)'].map((css) =>"
        " [...document.querySelectorAll(css)].map((robot) => robot.dataset.name))"
    ) == [["Ann"], ["Bob"]]


def test_elements_of_the_map_root_are_drawn_in_pixels(page):
    assert colour(page, 12, 22) == GREEN
    assert colour(page, 38, 58) == GREEN


def test_elements_of_the_world_are_drawn_in_metres(page):
    map = page.locator("svg.webmap").bounding_box()
    slab = page.locator(".slab").bounding_box()
    assert (slab["x"] - map["x"], slab["y"] - map["y"]) == pytest.approx((50, 300))
    assert (slab["width"], slab["height"]) == pytest.approx((100, 50))


def test_get_bounding_rect_returns_the_position_of_the_map_in_the_window(page):
    place = page.locator("svg.webmap").bounding_box()
    assert place["x"] > 20
    expect(page.locator(".words")).to_have_text(f"{place['x']:.0f} {place['y']:.0f}")
