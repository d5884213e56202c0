"""Robots are in a separate group: CSS can count them, and layers keep their order."""

import io

import pytest
from PIL import Image
from playwright.sync_api import expect

from equipment.chromium import watched_tab
from equipment.processes import WEB, running

pytestmark = pytest.mark.browser

FIRST, SECOND, OTHERS = "rgb(200, 30, 30)", "rgb(30, 30, 200)", "rgb(90, 90, 90)"
UNDER, OVER = "rgb(30, 200, 30)", "rgb(200, 200, 30)"

PROGRAM = """
from dataclasses import dataclass

import webmap
from webmap import html, svg
from webmap.core.map import Layer


class Band(Layer):
    # A band through the robots' middles, 0.2 m high.

    def __init__(self, name, y):
        super().__init__()
        self.svg.append(svg.rect(class_=name, x=-8, y=y, width=16, height=0.2))

    def start(self):
        pass


def robot(name, x):
    made = webmap.Robot(name, svg.circle(r=0.5))
    made.svg.set_pose(x, 0.0, 0.0)
    return made


ann, bob, cid = robot("Ann", -2), robot("Bob", 0), robot("Cid", 2)


@webmap.page("/", html="index.html")
def main(page):
    map = webmap.Map(page.element("one"), 400, 200)
    map.scale(40)
    map.add_image("floor.png", -4, -2, 8, 4)
    map.add_robot(ann)
    map.add_layer(Band.shared("under", -0.1), order=99)
    map.add_layer(Band.shared("over", 0.2), order=101)
    map.add_robot(bob)
    map.add_robot(cid)
    other = webmap.Map(page.element("two"), 400, 200)
    other.scale(40)
    for each in (cid, ann):
        other.add_robot(each)

    def again(event):
        map.remove_robot(ann)
        map.add_robot(ann)

    page.element("again").on("click", again)


webmap.run()
"""

PAGE = """<!doctype html>
<title>Robots</title>
<link rel="stylesheet" href="style.css">
<div id="one"></div>
<div id="two"></div>
<button id="again">Again</button>
"""

STYLE = f"""
.robot {{ fill: {OTHERS}; }}
.robot:nth-child(1) {{ fill: {FIRST}; }}
.robot:nth-child(2) {{ fill: {SECOND}; }}
.under {{ fill: {UNDER}; }}
.over {{ fill: {OVER}; }}
"""


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    folder = tmp_path_factory.mktemp("robots")
    Image.new("RGB", (8, 4), "white").save(folder / "floor.png")
    (folder / "robots.py").write_text(PROGRAM)
    (folder / "index.html").write_text(PAGE)
    (folder / "style.css").write_text(STYLE)
    command = ("run", folder / "robots.py", "--port", 0, "--no-browser")
    with running(*command, pattern=WEB) as process:
        yield process


@pytest.fixture
def page(server, chromium):
    with watched_tab(chromium, 900, 600) as tab:
        tab.goto(server.url)
        expect(tab.locator(".robot")).to_have_count(5)
        expect(tab.locator(".over")).to_have_count(1)
        yield tab


def fills(page, map):
    """Return the robots' names in the order of the group, and their colours."""
    return page.evaluate(
        "map => [...document.querySelectorAll(`#${map} .robots > *`)].map("
        "  robot => [robot.dataset.name, getComputedStyle(robot).fill])",
        map,
    )


def colour(page, x, y):
    """Return the colour at a place of the first map, in metres."""
    shot = page.locator("#one svg.webmap").screenshot()
    picture = Image.open(io.BytesIO(shot)).convert("RGB")
    return "rgb({}, {}, {})".format(*picture.getpixel((200 + 40 * x, 100 - 40 * y)))


def test_css_nth_child_counts_robots_in_the_order_they_were_added(page):
    assert fills(page, "one") == [["Ann", FIRST], ["Bob", SECOND], ["Cid", OTHERS]]
    assert page.locator("#one .robot:nth-child(1)").count() == 1


def test_each_map_has_its_own_order_of_robots(page):
    assert fills(page, "two") == [["Cid", FIRST], ["Ann", SECOND]]


def test_a_robot_that_is_removed_and_added_again_becomes_the_last_robot(page):
    first = page.locator("#one .robot:nth-child(1)")
    page.get_by_role("button", name="Again").click()
    expect(first).to_have_attribute("data-name", "Bob")
    assert fills(page, "one") == [["Bob", FIRST], ["Cid", SECOND], ["Ann", OTHERS]]
    assert fills(page, "two") == [["Cid", FIRST], ["Ann", SECOND]]
    page.reload()
    expect(first).to_have_attribute("data-name", "Bob")
    assert fills(page, "one") == [["Bob", FIRST], ["Cid", SECOND], ["Ann", OTHERS]]


def test_layers_are_drawn_under_or_over_all_robots_by_their_order(page):
    for x, robot in ((-2, FIRST), (0, SECOND), (2, OTHERS)):
        assert colour(page, x, 0.0) == robot  # over the band of order 99
        assert colour(page, x, 0.3) == OVER
    assert colour(page, -1.0, 0.0) == UNDER
    assert page.evaluate(
        "[...document.querySelectorAll('#one .world > g')].map(g =>"
        "  g.querySelector('rect')?.getAttribute('class') ?? g.getAttribute('class'))"
    ) == ["images", "under", "robots", "over"]
