"""The twelve-line program of the README runs as printed there."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import expect
from robots import Witness

from equipment.chromium import hold
from equipment.processes import BRIDGE, WEB, running

pytestmark = pytest.mark.browser

ROOT = Path(__file__).parents[2]


def program(page: str) -> str:
    """Return the program of a page of the docs, with another bridge."""
    text = (ROOT / page).read_text()
    blocks = re.findall(r"^```python\n(.*?)^```$", text, re.M | re.S)
    [found] = [block for block in blocks if "webmap.Bridge(" in block]
    return found


def test_the_readme_and_the_documentation_show_the_same_twelve_line_program():
    text = program("README.md")
    assert program("docs/index.md") == text
    assert len([line for line in text.splitlines() if line.strip()]) == 12


def test_the_program_of_the_readme_shows_a_robot_that_can_be_selected_and_driven(
    tab, tmp_path
):
    simulator = ("sim", "--flat", "--port", 0, "--seed", 7)
    file = tmp_path / "first.py"
    with running(*simulator, pattern=BRIDGE) as robot:
        text = program("README.md")
        assert text.count("ws://localhost:9090") == 1
        file.write_text(text.replace("ws://localhost:9090", robot.url))
        command = ("run", file, "--port", 0, "--no-browser")
        with running(*command, pattern=WEB) as process:
            tab.goto(process.url)
            expect(tab.locator(".dot[d]")).to_be_attached()
            circle = tab.locator(".robot circle").first
            expect(circle).to_be_in_viewport()
            assert circle.bounding_box()["width"] == pytest.approx(16, abs=1)
            circle.click()
            expect(tab.locator(".robot.selected")).to_be_attached()
            witness = Witness(robot.url)
            witness.follow("/odom", "nav_msgs/Odometry")
            hold(tab.keyboard, "w", lambda: witness.speed("/odom")[0] > 0.9)
            tab.keyboard.up("w")
            witness.close()
            expect(tab.locator(".webmap-metre-grid")).to_be_attached()
            tab.mouse.move(300, 200)
            tab.mouse.wheel(0, -480)
            tab.wait_for_function(
                "before => document.querySelector('.robot circle')"
                ".getBoundingClientRect().width > before * 1.2",
                arg=16,
            )
            # Without control, the panel for driving leaves most of a small map free.
            tab.get_by_role("button", name="Release control").click()
            tab.set_viewport_size({"width": 700, "height": 500})
            tab.wait_for_function(
                """() => {
                  const panel = document.querySelector(".webmap-teleop");
                  const { width, height } = panel.getBoundingClientRect();
                  return innerWidth === 700 && width * height < 0.2 * 700 * 500;
                }"""
            )
            tab.close()
