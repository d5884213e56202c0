"""Which layers can be switched."""

import pytest
from playwright.sync_api import expect

from equipment.chromium import watched_tab
from equipment.webmap_process import page_of
from webmap.base.errors import ConfigError

MANY = """
import webmap
from webmap import svg


@webmap.page("/")
def main(page):
    map = webmap.Map(page.element("webmap_container"))
    for number in range(20, 0, -1):
        scan = svg.g(class_="laserscan")
        map.world.append(scan.set("data-layer", f"/robot_{number}/scan"))
    map.add_module("LayerSwitches")
"""


def test_an_unknown_layer_in_off_is_refused_with_the_known_names(map):
    there_are = "no layer 'Scan'; there are Tiles, Maps, Pictures, Costmaps"
    with pytest.raises(ConfigError, match=there_are):
        map.add_module("LayerSwitches", off=["Scan"])


def test_layer_switches_accept_custom_layers_and_layers_that_are_off(map):
    switches = map.add_module("LayerSwitches", {"Dust": ".dust"}, off=["Dust"])
    assert switches in map.modules


def test_each_layer_element_has_the_topic_name_of_its_switch(map, link, robot):
    made = [
        robot.add_module("Range", link, "/bob/sonar/left"),
        robot.add_module("PoseWithCovariance", link, "/bob/amcl_pose"),
        map.add_module("Markers", link, "/bob/goals", robot=robot).layer,
        map.add_module("Markers", link, "/bob/zones").layer,
    ]
    names = [each.svg.get("data-layer") for each in made]
    assert names == ["sonar/left", "amcl_pose", "goals", "/bob/zones"]


@pytest.mark.browser
def test_switches_are_in_natural_order_and_a_note_counts_the_omitted_ones(
    chromium, tmp_path
):
    file = tmp_path / "many.py"
    file.write_text(MANY)
    with page_of(file) as url, watched_tab(chromium, 1280, 800) as page:
        page.allowed = ["WebSocket", "ERR_CONNECTION"]  # when the whole layer ends
        page.goto(url)
        page.locator(".webmap-layers summary").click()
        rows = page.locator(".webmap-layers-row")
        robots = [f"/robot_{number}/scan" for number in range(1, 17)]
        note = "4 more: \N{LEFT DOUBLE QUOTATION MARK}Scans"
        note += "\N{RIGHT DOUBLE QUOTATION MARK} switches all of them"
        expect(rows).to_have_text(["Scans", *robots, note])
