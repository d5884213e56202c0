"""Holonomic and other bases in a fleet file."""

import json
import re
import time

import pytest
from playwright.sync_api import expect

from equipment.console_page import shown

FLEET = """\
[bridges]
hall = "URL"

[[robots]]
name = "Omni"
odometry = "/robot_0/odom"
twist = { topic = "/robot_0/cmd_vel", holonomic = true, stops_within = 0.5 }

[[robots]]
name = "Plain"
odometry = "/robot_1/odom"
twist = { topic = "/robot_1/cmd_vel", stops_within = 0.5 }
"""


@pytest.mark.browser
def test_the_q_key_moves_only_a_holonomic_robot_sideways(chromium, ros1, tmp_path):
    file = tmp_path / "fleet.toml"
    file.write_text(FLEET.replace("URL", ros1))
    sent_frames, seen = [], []
    with shown(chromium, "run", str(file)) as page:

        def listen(link):
            link.on("framesent", lambda frame: sent_frames.append(frame))
            link.on("framereceived", lambda frame: seen.append(frame))

        page.on("websocket", listen)
        page.reload()
        sideways = page.get_by_role("button", name="Sideways")

        def select(name):
            row = page.locator("#robots .row", has_text=name).locator("button").first
            row.click()
            expect(row).to_have_attribute("aria-pressed", "true")
            expect(page.locator(f'.robot[data-name="{name}"]')).to_have_class(
                re.compile("selected")
            )

        def drive(name, *keys):
            """Hold keys until the gate sends a velocity; press them again if needed.

            Inputs must be at rest before a press counts, and a page that is too slow
            does not drive.
            """
            for _ in range(5):
                page.wait_for_timeout(500)
                for key in keys:
                    page.keyboard.down(key)
                patience = time.monotonic() + 3.0
                while not written(name) and time.monotonic() < patience:
                    page.wait_for_timeout(50)
                for key in reversed(keys):
                    page.keyboard.up(key)
                if written(name):
                    return
            raise AssertionError(f"{keys} moved nothing: {sent_frames[-3:]}")

        def asked(axis):
            return any(one[axis] for one in received(sent_frames, "drive"))

        def written(name):
            """Return the velocities other than zero that the gate sent to a robot."""
            words = [
                one["sent"] for one in received(seen, "robot") if one["name"] == name
            ]
            return [sent for sent in words if any(sent)]

        select("Omni")
        page.get_by_role("button", name="Stick", exact=True).click()
        expect(sideways).to_be_visible()
        drive("Omni", "q")
        assert all(x == turn == 0 and y > 0 for x, y, turn, *_ in written("Omni"))
        select("Plain")
        expect(sideways).to_be_hidden()
        sent_frames.clear()
        drive("Plain", "q", "w")
        assert not asked("y")
        assert all(x > 0 and y == 0 for x, y, *_ in written("Plain"))
        page.keyboard.press("?")
        help_ = page.get_by_role("dialog", name="Keys and gestures")
        expect(help_.get_by_text("Sideways to the left, right")).to_be_visible()


def received(frames, op):
    """Return the messages of one kind in the frames of a page."""
    found = (json.loads(frame) for frame in frames if str(frame)[:1] == "{")
    return [one for one in found if one.get("op") == op]
