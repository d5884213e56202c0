"""Driving in the console: the state, the stop test, and a robot that is blocked."""

import re
import time
from contextlib import suppress

import pytest
from console_ready import assert_free, expect_state, select, send_away, title, unfold
from playwright.sync_api import expect

from equipment.chromium import asleep, end_stops, hold, press_twice

# On a busy machine, a delayed page or robot stops.
pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.serial]

BLOCKED = "You are driving · not moving: blocked?"
NO_CONTROL = "Stop test: take control"


def test_the_bar_the_card_and_the_list_show_the_same_state(open_console):
    page = open_console()
    select(page, "Robot 1")
    expect_state(page, "Free")
    page.get_by_role("button", name="Take control of Robot 1").click()
    expect_state(page, "You have control")
    hold(page.keyboard, "a", lambda: title(page).text_content() == "You are driving")
    expect_state(page, "You are driving")
    page.keyboard.up("a")
    expect_state(page, "You have control")
    back = page.get_by_role("button", name="Release control of Robot 1")
    back.evaluate("e => e.click()")  # the button moves while the text beside it changes
    expect_state(page, "Free")


PLACES = """() => ["", " .state", " > .actions", " .cameras", " .more"].map((part) => {
  const { y, height } = document.querySelector("#card" + part).getBoundingClientRect();
  return [part, y, height];
})"""
"""The places and heights of the card and its parts."""


def test_the_card_and_its_parts_stay_in_place_in_each_state(open_console):
    page = open_console()
    select(page, "Robot 1")
    page.wait_for_function(
        "() => document.querySelector('.cameras img').naturalWidth === 320"
    )
    expect(page.get_by_role("region", name="Health")).to_contain_text("All OK")
    expect_state(page, "Free")
    places = page.evaluate(PLACES)
    hold(page.keyboard, "a", lambda: title(page).text_content() == "You are driving")
    assert page.evaluate(PLACES) == places
    page.keyboard.press("Escape")
    page.keyboard.up("a")
    expect_state(page, "STOP active")
    expect(page.locator("#card .reason")).to_have_text(
        "STOP by you is active: reset it first."
    )
    assert page.evaluate(PLACES) == places
    end_stops(page.locator(".webmap-stop-list .webmap-reset"))


def test_the_card_runs_a_stop_test_of_a_robot_with_a_stated_command_timeout(
    open_console,
):
    page = open_console()
    page.locator("#robots .row", has_text="Robot 2").locator("button").first.click()
    unfold(page)
    test = page.locator("[data-act=stop-test]")
    expect(test).to_have_text(NO_CONTROL, use_inner_text=True)
    expect(test).to_be_disabled()
    bound = page.locator("#card .own-stop")
    expect(bound).to_contain_text(re.compile(r"stops within \d\.\d\d s"))
    expect(bound).to_contain_text("(stated)")
    page.get_by_role("button", name="Take control of Robot 2").click()
    expect(page.get_by_role("img", name="Camera of Robot 2")).to_be_visible()
    page.wait_for_function(
        "() => document.querySelector('.cameras img').naturalWidth === 320"
    )
    # The figures are below the camera; the card must be scrolled to see them.
    figures = page.locator("#card .speeds")
    assert page.locator("#card").evaluate("e => e.scrollHeight > e.clientHeight + 40")
    figures.scroll_into_view_if_needed()
    assert_free(figures)
    tested = re.compile(r"\(tested \d{4}-\d\d-\d\d\)")
    take = page.get_by_role("button", name="Take control of Robot 2")
    for _ in range(8):
        # On a busy machine a late command ends the test, and the gate ends control.
        if take.is_visible():
            take.click()
        expect(test).to_have_text("Run stop test", use_inner_text=True)
        asked = press_twice(test)
        assert asked in ("Robot will move slowly: press again", NO_CONTROL)
        with suppress(AssertionError):
            expect(test).to_have_attribute("data-test", "running", timeout=5_000)
        expect(test).not_to_have_attribute("data-test", "running")
        with suppress(AssertionError):
            expect(bound).to_contain_text(tested, timeout=3_000)
            break
    expect(bound).to_contain_text(tested)
    expect(page.get_by_role("button", name="Run stop test", exact=True)).to_be_enabled()
    page.get_by_role("button", name="Release control of Robot 2").click()


def test_a_stop_test_runs_under_control_that_was_taken_for_a_goal(open_console):
    page = open_console()
    select(page, "Robot 1")
    send_away(page)
    page.locator("#card [data-act=cancel]").click()
    expect_state(page, "You have control")
    unfold(page)
    button = page.locator("[data-act=stop-test]")
    running = page.locator("#card .test", has_text="Stop test: ")
    tested = page.locator("#card .own-stop", has_text="(tested ")
    press_twice(button)
    expect(running.or_(tested).first).to_be_attached()
    expect(page.locator(".webmap-teleop-detail")).not_to_contain_text("Release all")
    page.get_by_role("button", name="Release control of Robot 1").click()


def test_a_robot_that_pushes_a_wall_is_shown_as_blocked(open_console):
    page = open_console()
    select(page, "Robot 2")
    state = title(page)
    for _ in range(8):  # a busy page stops driving
        hold(
            page.keyboard,
            "w",
            lambda: state.text_content() in ("You are driving", BLOCKED),
        )
        while state.text_content() == "You are driving":
            page.wait_for_timeout(100)
        with suppress(AssertionError):
            expect_state(page, BLOCKED, patience=2.0)
            break
        page.keyboard.up("w")
    else:
        raise AssertionError(f"never shown as blocked: {state.text_content()}")
    detail = page.locator(".webmap-teleop-detail")
    expect(detail).to_have_text(re.compile(r"^Sent: \d\.\d\d m/s.*Measured: 0\.00 m/s"))
    page.keyboard.up("w")
    hold(page.keyboard, "s", lambda: "-" in detail.text_content())
    page.keyboard.up("s")
    page.get_by_role("button", name="Release control of Robot 2").click()


def test_a_page_that_was_frozen_with_a_held_key_asks_to_release_it(open_console):
    page = open_console()
    select(page, "Robot 1")
    hold(page.keyboard, "a", lambda: title(page).text_content() == "You are driving")
    with asleep(page):
        time.sleep(2.0)
    blocked = "Input blocked: release all keys, then press again"
    expect(title(page)).to_have_text(blocked)
    page.wait_for_timeout(1000)
    expect(title(page)).to_have_text(blocked)
    page.keyboard.up("a")
    expect(title(page)).not_to_have_text(blocked)
    hold(page.keyboard, "a", lambda: title(page).text_content() == "You are driving")
    page.keyboard.up("a")
    page.get_by_role("button", name="Release control of Robot 1").click()
