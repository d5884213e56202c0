"""Robots that are found at once or later, in a real browser."""

import subprocess
import sys

import pytest
from playwright.sync_api import expect
from websockets.sync.client import connect

from equipment.console_page import shown
from equipment.webmap_process import simulator

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def expect_two_robots_on_their_map(page, within=40_000):
    expect(page.locator("#robots .row")).to_have_count(2, timeout=within)
    expect(page.locator(".robot:not(.unplaced)")).to_have_count(2, timeout=within)
    expect(page.locator(".occupancy-grid.map image")).to_have_count(1, timeout=within)
    expect(page.locator(".laserscan > .dot").first).to_be_attached(timeout=within)


def test_the_page_shows_all_discovered_robots_with_map_and_scan(chromium, ros1):
    with shown(chromium, "view", ros1) as page:
        expect_two_robots_on_their_map(page)
        names = page.locator("#robots .row .name").all_inner_texts()
        assert names == ["robot_0", "robot_1"]


def test_the_page_shows_a_robot_option_with_the_layers_of_its_namespace(chromium, ros1):
    received = "Bob:/robot_0/odom:/robot_0/cmd_vel:"
    with shown(chromium, "view", ros1, "--robot", received) as page:
        expect(page.locator(".robot:not(.unplaced)")).to_have_count(1, timeout=15_000)
        for drawn in (
            ".occupancy-grid.map image",
            ".occupancy-grid.costmap image",
            ".robot .pointcloud",
            ".robot .path",
        ):
            expect(page.locator(drawn).first).to_be_attached(timeout=15_000)
        assert page.locator("#robots .row .name").all_inner_texts() == ["Bob"]
        assert page.locator(".laserscan").count() == 0, (
            "the option gives the robot no scan"
        )


def test_the_page_draws_the_layers_of_a_topic_list_without_rosapi(chromium, tmp_path):
    listed = tmp_path / "topics.txt"
    listed.write_text(
        "/odom nav_msgs/msg/Odometry\n"
        "/local_costmap/costmap nav_msgs/msg/OccupancyGrid\n"
    )
    with simulator("--port", "0", "--dialect", "ros2", "--flat") as url:
        with connect(url, proxy=None) as other:  # in ROS 2, this call ends rosapi
            other.send('{"op":"call_service","service":"/rosapi/message_details",'
                       '"args":{"type":"nav_msgs/Odometry"}}')  # fmt: skip
        with shown(chromium, "view", url, "--topics", str(listed)) as page:
            costmap = page.locator(".occupancy-grid.costmap image")
            expect(costmap).to_have_count(1, timeout=15_000)


def test_robots_of_a_bridge_that_starts_later_appear_on_the_open_page(
    chromium, later_port
):
    url = f"ws://127.0.0.1:{later_port}"
    with shown(chromium, "view", url, "--wait", "0") as page:
        expect(page.locator("#robots .row")).to_have_count(0)
        with simulator("--port", str(later_port)):
            expect_two_robots_on_their_map(page)


def test_the_page_shows_the_robots_and_title_of_a_fleet_file(chromium, ros1, tmp_path):
    file = tmp_path / "fleet.toml"
    found = subprocess.run(
        [sys.executable, "-m", "webmap", "discover", "--toml", ros1],
        capture_output=True,
        text=True,
        check=True,
    )
    file.write_text('title = "Two halls"\n' + found.stdout)
    with shown(chromium, "run", str(file)) as page:
        expect_two_robots_on_their_map(page)
        expect(page.locator("#title")).to_have_text("Two halls")
