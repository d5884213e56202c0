"""A recording in a real browser is shown and labelled, and cannot be driven."""

import re

import pytest
from playwright.sync_api import expect

from equipment.bag_files import FRAMES, GRID, ODOMETRY, TWIST, Made
from equipment.console_page import shown

pytestmark = pytest.mark.browser


def test_a_recording_shows_the_robot_at_its_pose_and_allows_no_driving(
    chromium, tmp_path
):
    made = Made("ros2")
    moments = [step / 10 for step in range(200)]
    bag = made.bag(
        tmp_path / "office",
        ("/map", GRID, 0.0, made.grid([0, 100])),
        ("/tf_static", FRAMES, 0.0, made.frame("laser")),
        ("/cmd_vel", TWIST, 0.0, made.message(TWIST)),
        *(("/odom", ODOMETRY, at, made.odometry(at, 1.5)) for at in moments),
    )
    with shown(chromium, "play", bag, "--loop", "--rate", "2") as page:
        expect(page.locator(".robot:not(.unplaced)")).to_have_count(1, timeout=15_000)
        page.locator("#robots .row").click()
        card = page.locator("#card")
        expect(card.locator("h2")).to_have_text("office")
        expect(card.locator(".facts").first).to_contain_text("1.50")
        expect(card.locator(".state")).to_contain_text("View only")
        expect(card.locator(".age")).not_to_contain_text(re.compile(r"[1-9]\d+ s"))
        expect(page.locator("#title")).to_have_text("Recording office")
        expect(page.locator(".webmap-player-badge")).to_have_text("RECORDING")
        expect(page.locator(".webmap-player-time")).to_have_text(
            re.compile(r"0:\d\d\.\d / 0:19\.9")
        )
        expect(page.get_by_label("Speed")).to_have_value("2")
        expect(page.locator("#bridges")).to_contain_text("Bridge connected")
        card.locator(".more > summary").click()
        for name in ("Send goal…", "Cancel goal", "Set pose"):
            button = card.get_by_role("button", name=name)
            expect(button).to_be_disabled()
            expect(button).to_have_attribute(
                "title", re.compile("^No .* is set for this robot$")
            )
        page.keyboard.down("w")
        expect(page.locator(".webmap-teleop")).to_be_hidden()
        page.keyboard.up("w")
        expect(card.locator(".state")).to_contain_text("View only")


def test_a_looping_recording_causes_no_problems_or_notices(chromium, tmp_path):
    made = Made("ros2")
    moments = [step / 10 for step in range(20)]
    bag = made.bag(
        tmp_path / "round",
        ("/tf_static", FRAMES, 0.0, made.frame("laser")),
        *(("/odom", ODOMETRY, at, made.odometry(at, 3 * at)) for at in moments),
    )
    with shown(chromium, "play", bag, "--loop") as page:
        expect(page.locator(".robot:not(.unplaced)")).to_have_count(1, timeout=15_000)
        page.locator("#robots .row").click()
        page.evaluate(
            """() => {
              window.seen = new Set();
              setInterval(() => {
                const problems = document.querySelector("#card .problems").textContent;
                const notices = document.querySelector(".webmap-notices")?.textContent;
                for (const text of [problems, notices]) if (text) window.seen.add(text);
              }, 50);
            }"""
        )
        page.wait_for_timeout(5000)
        assert page.evaluate("[...window.seen]") == []
