"""Buttons on a robot's card, pressed in a real browser, on a real rosbridge."""

import re
import threading
from collections.abc import Iterator
from dataclasses import dataclass

import pytest
from button_robot import RobotNode, robot_node
from playwright.sync_api import Browser, Page, expect

from equipment.chromium import watched_tab
from equipment.waiting import wait_for
from equipment.webmap_process import page_of, simulator

pytestmark = pytest.mark.browser

FLEET = """\
[bridges]
hall = "{url}"

[[robots]]
name = "Bob"
odometry = "/robot_0/odom"
twist = "/robot_0/cmd_vel"

[[robots.buttons]]
label = "Dock"
service = "/dock"
type = "std_srvs/Trigger"
confirm = "Is the dock free?"

[[robots.buttons]]
label = "Wait"
service = "/wait"
type = "std_srvs/Trigger"
timeout = 60

[[robots.buttons]]
label = "Light"
topic = "/light"
type = "std_msgs/ColorRGBA"
message = {{ a = 1.0 }}
form = true
"""


@dataclass
class Bench:
    url: str
    node: RobotNode
    waiting: threading.Event


@pytest.fixture(scope="module")
def bench(tmp_path_factory) -> Iterator[Bench]:
    waiting = threading.Event()

    def wait(args: dict) -> dict:
        waiting.wait(60)
        return {"success": False, "message": "nobody came"}

    services = {
        "/dock": ("std_srvs/Trigger", lambda args: {"success": True, "message": "in"}),
        "/wait": ("std_srvs/Trigger", wait),
    }
    file = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    with (
        simulator("--robots", "1") as bridge,
        robot_node(bridge, services, {"/light": "std_msgs/ColorRGBA"}) as node,
    ):
        file.write_text(FLEET.format(url=bridge))
        with page_of(file) as url:
            try:
                yield Bench(url, node, waiting)
            finally:
                waiting.set()


@pytest.fixture
def tab(chromium: Browser, bench: Bench) -> Iterator[Page]:
    with watched_tab(chromium, 1280, 800) as page:
        page.goto(bench.url)
        page.locator("#robots .row").click()
        page.locator("#card .more > summary").click()
        expect(page.locator("#card .more[open]")).to_be_visible()
        expect(page.locator(".robot-button")).to_have_count(3)
        expect(page.locator("#link")).to_have_attribute("data-link", "open")
        yield page


def button(tab: Page, label: str):
    return tab.locator(f'.robot-button[data-label="{label}"]')


def test_a_button_with_confirm_asks_first_and_then_shows_the_result(tab, bench):
    dock = button(tab, "Dock")
    dock.locator(".go").click()
    expect(dock.locator(".question")).to_contain_text("Is the dock free?")
    dock.locator(".no").click()
    expect(dock.locator(".question")).to_be_hidden()
    assert bench.node.calls == []
    dock.locator(".go").focus()
    tab.keyboard.press("Enter")
    expect(dock.locator(".yes")).to_be_visible()
    tab.wait_for_timeout(400)  # a new question accepts no answer at first
    dock.locator(".yes").press("Enter")
    expect(dock.locator(".result")).to_have_text("Done: in")
    assert bench.node.calls == [("/dock", {})]


def test_a_running_call_shows_progress_and_disables_the_button(tab, bench):
    wait = button(tab, "Wait")
    expect(wait.locator("progress")).to_be_hidden()
    wait.locator(".go").click()
    expect(wait.locator("progress")).to_be_visible()
    expect(wait.locator(".since")).to_have_text(re.compile(r"\d.* s"))
    expect(wait.locator(".go")).to_be_disabled()
    bench.waiting.set()
    expect(wait.locator(".result")).to_have_text("Failed: nobody came")
    expect(wait.locator(".go")).to_be_enabled()


def test_a_form_marks_an_invalid_field_and_publishes_valid_values(tab, bench):
    light = button(tab, "Light")
    light.locator(".go").click()
    expect(light.locator("[data-field=a]")).to_have_value("1.0")
    light.locator("[data-field=r]").fill("1e39")
    light.locator("[data-field=g]").fill("0.5")
    light.locator(".yes").click()
    expect(light.locator(".result")).to_have_text(
        "Not done: r: got 1e+39, expected a number"
    )
    expect(light.locator("[data-field=r]")).to_have_attribute("aria-invalid", "true")
    assert bench.node.received == []
    light.locator("[data-field=r]").fill("0.25")
    light.locator(".yes").click()
    expect(light.locator(".result")).to_have_text("Published")
    assert wait_for(lambda: bench.node.received, "the message", page=tab) == [
        ("/light", {"r": 0.25, "g": 0.5, "b": 0.0, "a": 1.0})
    ]
    expect(light.locator(".sheet")).to_be_hidden()


def test_buttons_are_disabled_while_stop_is_active_and_show_the_reason(tab):
    tab.locator(".webmap-stop-all").click()
    dock = button(tab, "Dock")
    expect(dock.locator(".go")).to_be_disabled()
    expect(dock.locator(".go")).to_have_attribute(
        "title", "Not available: STOP is active: reset it first"
    )
