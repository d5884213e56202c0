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
    """The address of a demo with an operator and a viewer."""
    state = tmp_path_factory.mktemp("state")
    user(state, "add", "ana", "--password-stdin")
    user(state, "add", "bob", "--role", "viewer", "--password-stdin")
    options = ("demo", "-n", "1", "--quiet", "--port", "0", "--no-browser")
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
