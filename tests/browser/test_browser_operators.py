"""Several operators with one robot, and a display that is killed."""

import os
import re
import signal

import pytest
from playwright.sync_api import expect
from robots import Witness

from equipment.chromium import hold
from equipment.processes import BRIDGE, WEB, running
from equipment.waiting import wait_for

pytestmark = pytest.mark.browser

ODOM = "/robot_0/odom"


@pytest.fixture
def simulator():
    """One robot in a long corridor, with a base without a command timeout."""
    command = ("sim", "--robots", 1, "--seed", 7, "--port", 0, "--robot-timeout", 0)
    with running(*command, pattern=BRIDGE) as process:
        yield process.url


@pytest.fixture
def witness(simulator):
    witness = Witness(simulator)
    witness.follow(ODOM, "nav_msgs/Odometry")
    yield witness
    witness.close()


@pytest.fixture
def server(simulator):
    robot = "Bob:/robot_0/odom:/robot_0/cmd_vel:/robot_0/base_scan"
    command = ("view", simulator, "--robot", robot, "--port", 0, "--no-browser")
    with running(*command, pattern=WEB) as process:
        yield process


def open_and_drive(tab, server, witness):
    """Select the only robot in the list and hold S until it moves back."""
    tab.goto(server.url)
    tab.locator("#robots .row button").click()
    expect(tab.locator("#card h2")).to_have_text("Bob")
    tab.locator("svg.webmap").focus()
    hold(tab.keyboard, "s", lambda: witness.speed(ODOM)[0] < -0.1)


def standing(witness):
    return witness.speed(ODOM) == (0.0, 0.0)


def test_another_page_stops_a_driven_robot_with_stop_all(server, witness, tab, other):
    open_and_drive(tab, server, witness)
    other.goto(server.url)
    row = other.locator("#robots .row")
    expect(row).to_contain_text(re.compile("has control|is driving"))
    other.get_by_role("button", name="STOP ALL").click()
    wait_for(lambda: standing(witness), what="standing still")
    expect(row).to_contain_text("STOP active")
    tab.wait_for_timeout(700)
    assert standing(witness), "the key that is still held does not drive"
    tab.keyboard.up("s")


def test_keys_of_a_page_without_control_do_not_drive_the_robot(
    server, witness, tab, other
):
    # Load this page first: a page that loads may delay the page that drives.
    other.goto(server.url)
    other.locator("#robots .row button").click()
    expect(other.locator(".webmap-teleop")).to_have_attribute("data-state", "free")
    open_and_drive(tab, server, witness)
    expect(other.locator(".webmap-teleop")).to_have_attribute("data-state", "held")
    other.locator("svg.webmap").focus()
    other.keyboard.down("w")
    other.wait_for_timeout(600)
    assert witness.speed(ODOM)[0] <= 0, "the key on the other page has no effect"
    other.keyboard.up("w")
    tab.keyboard.up("s")
    wait_for(lambda: standing(witness), what="standing still")


def test_killing_the_display_stops_the_robot(server, witness, tab):
    open_and_drive(tab, server, witness)
    tab.allowed = ["WebSocket", "ERR_CONNECTION"]
    os.kill(server.popen.pid, signal.SIGKILL)
    wait_for(lambda: standing(witness), what="standing still")
    expect(tab.locator("html")).to_have_class(re.compile("disconnected"))
    expect(tab.locator(".webmap-teleop")).to_have_attribute("data-state", "lost")
    server.popen.wait()
