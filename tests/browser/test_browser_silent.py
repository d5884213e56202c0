"""The page and the log report a robot that vanishes while its bridge is open."""

import re
from contextlib import ExitStack

import pytest
from playwright.sync_api import expect

from equipment.processes import WEB, running
from equipment.waiting import wait_for
from webmap.testing.witness import WitnessRobot

pytestmark = pytest.mark.browser

STALE = re.compile(r"\bstale\b")


@pytest.fixture
def robots():
    """Bob and Ann, each behind a separate rosbridge."""
    with ExitStack() as stack:
        yield [stack.enter_context(WitnessRobot()) for _ in range(2)]


@pytest.fixture
def server(robots):
    urls = [robot.url for robot in robots]
    received = ("--robot", "1@Bob:/odom:/cmd_vel:", "--robot", "2@Ann:/odom:/cmd_vel:")
    command = ("view", *urls, *received, "--only-given", "--port", 0, "--no-browser")
    with running(*command, pattern=WEB) as process:
        yield process


def test_a_robot_without_odometry_becomes_stale_on_the_page_and_in_the_log(
    robots, server, tab
):
    bob = robots[0]
    tab.goto(server.url)
    rows = {name: tab.locator("#robots .row", has_text=name) for name in ("Bob", "Ann")}
    drawn = {name: tab.locator(f'.robot[data-name="{name}"]') for name in rows}
    rows["Bob"].locator("button").click()
    expect(tab.locator("#card h2")).to_have_text("Bob")
    old = [rows["Bob"].get_by_text("Stale data"), tab.locator("#card .state .old")]

    def bob_looks(*, is_old: bool) -> None:
        for element in old:
            expect(element).to_be_visible(visible=is_old)
        if is_old:
            expect(drawn["Bob"]).to_have_class(STALE)
        else:
            expect(drawn["Bob"]).not_to_have_class(STALE)
        # The other robot is still updated.
        expect(drawn["Ann"]).not_to_have_class(STALE)
        expect(rows["Ann"].get_by_text("Stale data")).to_be_hidden()
        expect(rows["Ann"].locator(".age")).to_have_text(re.compile(r"^0\.\d s$"))

    bob_looks(is_old=False)
    bob.sends_telemetry = False
    bob_looks(is_old=True)
    wait_for(lambda: "Bob: no pose for 3 s" in server.log, what="a line in the log")
    bob_looks(is_old=True)
    bob.sends_telemetry = True
    bob_looks(is_old=False)
    wait_for(lambda: "Bob: poses again" in server.log, what="another line")
    assert "Ann: no pose" not in server.log
    assert "the connection ended" not in server.log
