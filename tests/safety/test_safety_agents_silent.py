"""An agent and its gate fall silent while a page drives a robot without a timeout."""

import signal

import psutil
import pytest
from playwright.sync_api import expect

from equipment.chromium import hold, watched_tab
from equipment.processes import Process
from equipment.webmap_process import webmap
from webmap.testing import WitnessRobot

pytest.importorskip("zenoh")
pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]

SOON = 30_000

ALARM = (
    "Bob (bay3): may still be moving. Only the base's own timeout or the button on "
    "the robot can stop it"
)


@pytest.fixture
def agent(tmp_path):
    """An agent of a robot that never stops by itself, and the URL of its router."""
    with (
        WitnessRobot(timeout=None) as robot,
        webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
    ):
        bob = ("--name", "bay3", "--robot", "Bob:/odom:/cmd_vel:")
        agent = Process("agent", robot.url, "--router", router, *bob)
        try:
            agent.ready("The agent (bay3) is ready")
            family = psutil.Process(agent.popen.pid)
            yield [family, *family.children(recursive=True)], router
        finally:
            for each in family.children(recursive=True):
                each.send_signal(signal.SIGCONT)
            agent.popen.send_signal(signal.SIGCONT)
            agent.end(signal.SIGTERM)


def test_the_driver_of_a_robot_whose_agent_is_silent_gets_the_alarm_that_it_may_move(
    agent, chromium
):
    processes, router = agent
    options = ("--port", "0", "--no-browser")
    with (
        webmap("view", router, *options) as url,
        watched_tab(chromium, 1280, 800) as page,
    ):
        page.goto(url)
        row = page.locator("#robots .row").filter(has_text="Bob")
        expect(row).to_have_count(1, timeout=SOON)
        row.get_by_role("button").first.click()
        title = page.locator(".webmap-teleop-title")
        hold(page.keyboard, "w", lambda: title.text_content() == "You are driving")
        for each in processes:
            each.send_signal(signal.SIGSTOP)
        alarm = page.locator(".webmap-alarm")
        expect(alarm).to_contain_text("ROBOT MAY STILL BE MOVING", timeout=3_000)
        expect(alarm).to_contain_text(ALARM)
        detail = page.locator(".webmap-teleop-detail")
        expect(title).to_have_text("No connection: may still be moving")
        expect(detail).to_contain_text("No connection to the agent bay3")
        page.keyboard.up("w")
        expect(row).to_contain_text("No connection: may still be moving")
        for each in reversed(processes):
            each.send_signal(signal.SIGCONT)
        expect(alarm).to_have_count(0, timeout=SOON)


def test_the_panel_names_a_frozen_router_and_no_slow_connection(agent, chromium):
    _, router = agent
    options = ("--port", "0", "--no-browser")
    with (
        webmap("view", router, *options) as url,
        watched_tab(chromium, 1280, 800) as page,
    ):
        page.goto(url)
        row = page.locator("#robots .row").filter(has_text="Bob")
        expect(row).to_have_count(1, timeout=SOON)
        row.get_by_role("button").first.click()
        panel = page.locator(".webmap-teleop-state")
        expect(panel).to_contain_text("Free")
        (process,) = (
            each for each in psutil.Process().children() if "router" in each.cmdline()
        )
        process.send_signal(signal.SIGSTOP)
        try:
            expect(panel).to_contain_text("No connection to the agent bay3")
            expect(panel).to_contain_text("o connection to the router", timeout=SOON)
            expect(panel).not_to_contain_text("Slow connection")
            expect(panel).not_to_contain_text("Command too old")
        finally:
            process.send_signal(signal.SIGCONT)
        expect(panel).to_contain_text("Free", timeout=SOON)
