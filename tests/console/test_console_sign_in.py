"""Named users in a browser: they sign in, drive by their role, and sign out."""

import os
import subprocess
import sys

import pytest
from console_ready import select, wait_until_ready
from playwright.sync_api import expect

from equipment.chromium import watched_tab
from equipment.webmap_process import webmap

pytestmark = pytest.mark.browser

PASSWORD = "correct horse battery"


def user(state, *arguments):
    """Run ``webmap user`` with the password on its standard input."""
    return subprocess.run(
        [sys.executable, "-m", "webmap", "user", *arguments],
        input=f"{PASSWORD}\n",
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "WEBMAP_STATE_DIR": str(state)},
    ).stdout


@pytest.fixture(scope="module")
def url(tmp_path_factory):
    """The address of a demo with an operator, a viewer and an operator of Robot 1."""
    state = tmp_path_factory.mktemp("state")
    user(state, "add", "ana", "--password-stdin")
    user(state, "add", "bob", "--role", "viewer", "--password-stdin")
    robots = ("--robots", "Robot 1", "--robots", "bay2/*")
    user(state, "add", "carla", *robots, "--password-stdin")
    options = ("demo", "-n", "2", "--quiet", "--port", "0", "--no-browser")
    with webmap(*options, WEBMAP_STATE_DIR=str(state)) as url:
        yield url, state


def sign_in(page, name):
    """Fill in the form, and wait for the page."""
    page.get_by_label("Name", exact=True).fill(name)
    page.get_by_label("Password").fill(PASSWORD)
    page.get_by_role("button", name="Sign in").click()
    wait_until_ready(page)


def test_a_person_signs_in_drives_and_signs_out(url, chromium):
    address, state = url
    assert "token" not in address
    with watched_tab(chromium, 1280, 720) as page:
        page.allowed += [r"\b401\b"]
        page.goto(address)
        sign_in(page, "ana")
        expect(page.locator("#operator bdi")).to_have_text("ana")
        assert "webmap_code" not in page.url
        assert " ana " in user(state, "sessions")
        select(page, "Robot 0")
        page.get_by_role("button", name="Take control of Robot 0").click()
        expect(page.locator(".webmap-teleop-title")).to_have_text("You have control")
        page.locator("#operator summary").click()
        page.get_by_role("button", name="Sign out").click()
        expect(page.get_by_label("Password")).to_be_visible()
        assert " ana " not in user(state, "sessions")


def test_a_viewer_sees_the_robots_and_drives_none(url, chromium):
    address, state = url
    with watched_tab(chromium, 1280, 720) as page:
        page.allowed += [r"\b401\b"]
        page.goto(address)
        sign_in(page, "bob")
        select(page, "Robot 0")
        page.locator("#operator summary").click()
        expect(page.locator("#operator form")).to_contain_text("You may look")
        page.locator("#operator summary").click()
        driving = page.locator(".webmap-teleop")
        expect(driving).to_contain_text("You may look and press STOP")
        expect(driving.get_by_role("button", name="Take control")).to_be_hidden()
        assert "1 session ended" in user(state, "end", "bob")
        page.allowed += ["WebSocket connection .* failed"]
        told = page.get_by_text("You are not signed in any more: load the page again")
        expect(told.first).to_be_visible()
        page.reload()
        expect(page.get_by_label("Password")).to_be_visible()


RAW = """
(message) => new Promise((answer) => {
  const key = Object.entries(localStorage).find(([name]) => name.includes("key"))[1];
  const url = new URL("/_webmap/drive?id=raw", location.href);
  const socket = new WebSocket(url.href.replace("http", "ws"), ["webmap", key]);
  socket.onmessage = ({ data }) => {
    const { op, what, why } = JSON.parse(data);
    if (op === "hello") socket.send(JSON.stringify(message));
    if (op === "refused") answer([what, why]);
  };
})
"""


def test_an_operator_of_one_robot_looks_at_the_others_and_can_stop_them(url, chromium):
    address, state = url
    assert "operator  carla of Robot 1, bay2/*" in user(state, "list")
    with watched_tab(chromium, 1280, 720) as page:
        page.allowed += [r"\b401\b"]
        page.goto(address)
        sign_in(page, "carla")
        select(page, "Robot 0")
        driving, card = page.locator(".webmap-teleop"), page.locator("#card")
        take = driving.get_by_role("button", name="Take control")
        expect(driving).to_contain_text("The robot's own operators can drive")
        expect(take).to_be_hidden()
        expect(card).to_contain_text("Only operators of this robot can drive it")
        expect(card.get_by_role("button", name="Send goal")).to_be_hidden()
        robot = card.get_attribute("data-robot")
        for message in ({"op": "take"}, {"op": "reset", "stop": "x"}):
            what, why = page.evaluate(RAW, {"robot": robot, **message})
            assert (what, "Its own operators" in why) == (message["op"], True)
        page.get_by_role("button", name="STOP Robot 0").click()
        expect(driving.locator(".webmap-teleop-title")).to_contain_text("STOP")
        expect(page.get_by_role("button", name="Reset")).to_have_count(0)
        select(page, "Robot 1")
        take.click()
        expect(page.locator(".webmap-teleop-title")).to_have_text("You have control")
        page.allowed += ["WebSocket connection .* failed"]
        changed = user(state, "role", "carla", "operator", "--robots", "Robot 0")
        assert changed == "carla may sign in as operator of Robot 0\n"
        told = page.get_by_text("You are not signed in any more: load the page again")
        expect(told.first).to_be_visible()
        page.reload()
        sign_in(page, "carla")
        select(page, "Robot 0")
        expect(page.get_by_role("button", name="Reset").first).to_be_visible()
