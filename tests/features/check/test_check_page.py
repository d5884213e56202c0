"""A robot that demands a check drives slowly until a person has checked it."""

import json

import pytest
from playwright.sync_api import expect

from equipment.chromium import end_stops, watched_tab
from equipment.webmap_process import page_of, simulator

pytestmark = pytest.mark.browser

FLEET = """
check_every = "12h"

[bridges]
sim = "{bridge}"

[[robots]]
name = "Bob"
odometry = "/robot_0/odom"
twist = {{ topic = "/robot_0/cmd_vel", stops_within = 0.25, v_max = 0.8 }}
"""


def test_a_robot_drives_at_its_own_limit_after_a_check(chromium, tmp_path):
    file = tmp_path / "fleet.toml"
    with simulator("--robots", "1") as bridge:
        file.write_text(FLEET.format(bridge=bridge))
        state = tmp_path / "state"
        site = page_of(file, WEBMAP_STATE_DIR=str(state))
        with site as url, watched_tab(chromium, 1280, 800) as page:
            page.goto(url)
            page.locator("#robots .row button").first.click()
            bar = page.locator(".drive-bar")
            expect(bar).to_contain_text("not checked within 12 h")
            check = page.get_by_role("region", name="Check before driving")
            expect(check).to_contain_text("A check is due")
            check.get_by_role("button", name="Check before driving").click()
            expect(check).to_contain_text("Press Reset", timeout=15_000)
            expect(check).to_contain_text("STOP: OK, confirmed after")
            end_stops(page.locator(".webmap-teleop .webmap-reset"))
            expect(check).to_contain_text("The check has passed", timeout=15_000)
            expect(bar).not_to_contain_text("not checked")
            expect(bar).to_contain_text("0.80 m/s")
        (kept,) = (state / "checks").iterdir()
        result = json.loads(kept.read_text())
        assert result["passed"]
        assert [line["name"] for line in result["lines"]][:3] == [
            "Connection",
            "Odometry",
            "STOP",
        ]
