"""The report of the readiness check, as an operator requests and reads it."""

import re

import pytest
from playwright.sync_api import expect

from equipment.chromium import watched_tab
from equipment.webmap_process import webmap

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def open_report(page):
    page.locator("#bridges summary").click()
    page.get_by_role(
        "button", name=re.compile("^Check .* for problems with driving$")
    ).click()
    return page.locator(".doctor:popover-open")


def test_a_bridge_is_checked_on_request_and_each_finding_shows_its_level(
    open_console,
):
    page = open_console()
    assert page.locator(".finding").count() == 0, "no check runs without a request"
    report = open_report(page)
    expect(report.locator(".status")).to_contain_text("Listening for 3 s")
    expect(report.get_by_role("button", name="Check again")).to_be_disabled()
    # The number of warnings depends on the load of the machine.
    checked = re.compile(r"^Checked \d.* ago\. .*\d+ notes, \d+ good$")
    expect(report.locator(".status")).to_have_text(checked, timeout=20_000)
    velocity = report.locator(".finding").filter(
        has_text="/robot_0/cmd_vel has the type Twist"
    )
    expect(velocity).to_have_attribute("data-level", "good")
    expect(velocity.locator("strong")).to_have_text("Good:")
    notes = report.locator('.finding[data-level="note"]')
    expect(notes.locator("strong").first).to_have_text("Note:")
    shape = "path.solid, path.cut"
    good, note = (
        line.locator(shape).evaluate_all("all => all.map(e => e.getAttribute('d'))")
        for line in (velocity, notes.first)
    )
    assert good != note, "the levels differ in shape, not only in colour"
    expect(report.get_by_role("heading", name="Robot 2")).to_be_attached()
    expect(page.get_by_role("button", name="STOP ALL")).to_be_in_viewport(ratio=1)

    page.context.grant_permissions(["clipboard-read", "clipboard-write"])
    report.get_by_role("button", name="Copy as text").click()
    expect(report.get_by_text("Copied", exact=True)).to_be_visible()
    text = page.evaluate("navigator.clipboard.readText()")
    assert text.startswith("ws://127.0.0.1:")
    assert (
        "  good     /robot_0/cmd_vel has the type Twist, and WebMap sends this type."
        in text
    )

    page.keyboard.press("Escape")
    expect(report).to_be_hidden()

    other = open_console("phone")
    report = open_report(other)
    expect(report.locator(".finding").first).to_be_visible()
    expect(report.locator(".status")).to_contain_text("Checked")
    expect(other.get_by_role("button", name="STOP ALL")).to_be_in_viewport(ratio=1)
    assert other.evaluate("document.documentElement.scrollWidth") == 390


def test_the_slow_call_test_runs_from_the_report_and_its_result_is_shown_there(
    open_console,
):
    page = open_console()
    report = open_report(page)
    expect(report.locator(".status")).to_contain_text("Checked", timeout=20_000)
    report.get_by_role("button", name="Test for delays").click()
    question = report.get_by_role("group", name="Test for delays")
    expect(question).to_contain_text("advertises a service of its own")
    expect(question).to_contain_text("test while nobody drives")
    question.get_by_role("button", name="Run test").click()
    received = report.locator(".finding").filter(has_text="no other call (tried)")
    expect(received).to_have_attribute("data-level", "good")
    expect(question).to_be_hidden()


def test_without_clipboard_access_the_report_is_shown_as_selected_text(open_console):
    page = open_console()
    report = open_report(page)
    page.evaluate(
        """() => {
            Object.defineProperty(navigator, "clipboard", {value: undefined});
            document.execCommand = () => false;
        }"""
    )
    report.get_by_role("button", name="Copy as text").click()
    expect(report.locator("pre")).to_be_visible()
    chosen = page.evaluate("getSelection().toString()")
    assert "robot_0/cmd_vel" in chosen


def test_an_unreachable_bridge_can_also_be_checked(chromium):
    robot = "Bob:/odom:/cmd_vel:"
    view = ("view", "ws://127.0.0.1:1", "--robot", robot, "--port", "0")
    with (
        webmap(*view, "--no-browser") as url,
        watched_tab(chromium, 1280, 720) as page,
    ):
        page.goto(url)
        report = open_report(page)
        expect(report.locator(".status")).to_contain_text("1 wrong")
        finding = report.locator('.finding[data-level="wrong"]')
        expect(finding).to_contain_text("Wrong: The rosbridge cannot be reached")
        expect(finding.locator(".advice")).to_contain_text("Start rosbridge_server")
        report.get_by_role("button", name="Check again").click()
        expect(report.locator(".status")).to_contain_text("1 wrong")
