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

ROBOTS = """
import webmap
from webmap import svg


@webmap.page("/")
def main(page):
    map = webmap.Map(page.element("webmap_container"))
    for number in (10, 2):
        robot = webmap.Robot(f"Robot {number}")
        scan = svg.g(svg.circle(r=1), class_="laserscan")
        robot.svg.append(scan.set("data-layer", f"/robot_{number}/scan"))
        robot.svg.classes.remove("unplaced")
        costmap = svg.g(svg.circle(r=1), class_="occupancy-grid costmap")
        map.world.append(costmap.set("data-layer-of", robot.id))
        map.add_robot(robot)
    map.add_module("LayerSwitches", several_off=["Costmaps"])
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
        page.locator(".webmap-layers > summary").click()
        rows = page.locator(".webmap-layers-row")
        robots = [f"/robot_{number}/scan" for number in range(1, 17)]
        note = "4 more: \N{LEFT DOUBLE QUOTATION MARK}Scans"
        note += "\N{RIGHT DOUBLE QUOTATION MARK} switches all of them"
        expect(rows).to_have_text(["Scans", *robots, note])


@pytest.mark.browser
def test_layers_are_grouped_by_robot_and_only_those_of_the_selected_one_are_left(
    chromium, tmp_path
):
    file = tmp_path / "robots.py"
    file.write_text(ROBOTS)
    with page_of(file) as url, watched_tab(chromium, 1280, 800) as page:
        page.goto(url)
        page.locator(".webmap-layers > summary").click()
        groups = page.locator(".webmap-layers-robot")
        expect(groups).to_have_text(["Robot 2", "Robot 10"])
        groups.first.locator("summary").click()
        row = groups.first.locator(".webmap-layers-row")
        expect(row).to_have_text(["Scans"])
        expect(row).to_have_attribute("title", "Scans: /robot_2/scan")
        scans = page.locator(".laserscan:visible")
        expect(scans).to_have_count(2)
        row.locator("input").uncheck()
        expect(scans).to_have_attribute("data-layer", "/robot_10/scan")
        row.locator("input").check()

        costmaps = page.locator(".costmap:visible")
        expect(costmaps).to_have_count(0)  # two robots have one
        page.get_by_role("checkbox", name="Costmaps").check()
        expect(costmaps).to_have_count(2)

        page.get_by_role("radio", name="Selected robot").check()
        expect(scans).to_have_count(0)
        page.locator("[data-name='Robot 10']").dispatch_event("click")
        expect(page.locator(".robot.selected")).to_have_count(1)
        expect(scans).to_have_attribute("data-layer", "/robot_10/scan")
        expect(costmaps).to_have_count(1)
