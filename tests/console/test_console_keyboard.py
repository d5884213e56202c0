"""Each task of the operator's manual, done with only the keyboard."""

import re

import pytest
from console_ready import expect_state, shown_state, title
from playwright.sync_api import Page, expect

from equipment.chromium import hold

# On a busy machine, a delayed page or robot stops.
pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.serial]

ROBOTS = 3

GOAL_MARK = ".webmap-goal-mark"


def find(page: Page, text: str) -> None:
    """Search in the palette and press the first result."""
    page.keyboard.press("Control+k")
    expect(page.get_by_role("dialog", name="Find")).to_be_visible()
    page.keyboard.type(text)
    page.keyboard.press("Enter")
    expect(page.get_by_role("dialog", name="Find")).to_be_hidden()


def reset(page: Page) -> None:
    """End a STOP; the button needs two deliberate presses."""
    find(page, "control reset")
    page.wait_for_timeout(500)
    page.keyboard.press("Enter")


def select(page: Page, robot: str) -> None:
    """Select a robot, and end the control or the STOP that an earlier test left."""
    find(page, robot)
    expect(page.locator("#card h2")).to_have_text(robot.capitalize())
    expect(shown_state(page)).to_have_text(re.compile("Free|STOP active"))
    if shown_state(page).text_content() == "STOP active":
        reset(page)
        expect_state(page, "Free")


def test_a_robot_is_selected_driven_stopped_and_released(open_console):
    page = open_console()
    select(page, "robot 1")
    expect(page.locator("#card h2")).to_have_text("Robot 1")
    find(page, "take control")
    expect_state(page, "You have control")
    hold(page.keyboard, "a", lambda: title(page).text_content() == "You are driving")
    page.keyboard.up("a")
    expect_state(page, "You have control")
    page.keyboard.press("Space")
    expect_state(page, "STOP active")
    reset(page)
    expect_state(page, "Free")
    page.keyboard.press("Shift+Escape")
    expect_state(page, "STOP active")
    expect(page.locator(".webmap-stop-standing")).to_contain_text("3 robots")
    all_ = page.get_by_role("button", name="Reset all")
    all_.focus()
    page.keyboard.press("Enter")
    page.wait_for_timeout(500)
    page.keyboard.press("Enter")
    expect_state(page, "Free")
    find(page, "take control")
    expect_state(page, "You have control")
    find(page, "release control")
    expect_state(page, "Free")


def test_a_goal_is_placed_with_arrow_keys_turned_sent_and_cancelled(open_console):
    page = open_console()
    select(page, "robot 1")
    before = page.locator(".robot.selected").get_attribute("transform")
    for _ in range(5):  # a page that is too busy sends nothing
        page.keyboard.press("g")
        expect(page.locator(".webmap-goal-word")).to_contain_text("arrows move")
        for _ in range(8):
            page.keyboard.press("ArrowDown")
        page.keyboard.press("Shift+ArrowLeft")
        assert page.locator(".robot.selected").get_attribute("transform") == before
        expect(shown_state(page)).to_have_text("Free")
        page.keyboard.press("Enter")
        goal = page.locator("#card .goal")
        try:
            expect(goal).to_contain_text(re.compile("Goal|Navigating"), timeout=5000)
            break
        except AssertionError:
            continue
    expect(goal).to_contain_text(re.compile("Navigating|reached"))
    find(page, "cancel goal")
    expect(goal).to_contain_text(re.compile("cancelled|reached"))


def test_arrow_keys_move_the_mark_of_a_goal_and_not_the_robot_in_control(open_console):
    page = open_console()
    select(page, "robot 1")
    find(page, "take control")
    expect_state(page, "You have control")
    expect(page.locator(".webmap-teleop-detail")).not_to_contain_text("Preparing")
    page.keyboard.press("g")
    expect(page.locator(".webmap-goal-word")).to_contain_text("arrows move")
    place = "() => document.querySelector('.robot.selected').getCTM().f"
    before = page.evaluate(place)
    page.keyboard.down("ArrowDown")
    page.wait_for_timeout(1500)
    page.keyboard.up("ArrowDown")
    assert page.evaluate(place) == pytest.approx(before, abs=0.01)
    expect(page.locator(f"{GOAL_MARK}:visible")).to_have_count(1)
    page.keyboard.press("Escape")


def test_a_place_is_found_by_name_and_a_robot_is_sent_there(open_console):
    page = open_console()
    select(page, "robot 2")
    page.keyboard.press("l")
    where = page.locator("svg.webmap").bounding_box()
    # The pointer sets the position of the new label; the task is to send a robot there.
    page.mouse.click(
        where["x"] + where["width"] * 0.5, where["y"] + where["height"] * 0.5
    )
    page.get_by_label("Name", exact=True).fill("Charging dock")
    page.keyboard.press("Enter")
    expect(page.locator(".labels > .label")).to_have_count(1)
    find(page, "charging dock")
    send = page.get_by_role("button", name="Send goal here")
    expect(send).to_be_focused()
    for _ in range(5):  # a page that is too busy sends nothing
        page.keyboard.press("Enter")
        try:
            expect(page.locator("#card .goal")).to_contain_text(
                re.compile("Goal|Navigating"), timeout=5000
            )
            break
        except AssertionError:
            find(page, "charging dock")
    page.keyboard.press("Space")
    expect_state(page, "STOP active")
    reset(page)
    expect_state(page, "Free")


def test_the_view_the_layers_and_the_help_need_no_mouse(open_console):
    page = open_console()
    find(page, "zoom in")
    find(page, "show everything")
    find(page, "layer scans")
    scans = page.locator(".webmap-layers-row", has_text="Scans").locator("input")
    expect(scans.first).not_to_be_checked()
    find(page, "layer scans")
    expect(scans.first).to_be_checked()
    find(page, "help")
    expect(page.get_by_role("dialog", name="Keys and gestures")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog", name="Keys and gestures")).to_be_hidden()
    find(page, "list of robots")
    expect(page.locator("#panel-turn")).to_be_focused()
    expect(page.locator("#panel")).to_be_hidden()
    find(page, "list of robots")
    expect(page.locator("#panel")).to_be_visible()


def test_help_that_closes_does_not_take_the_focus_from_the_palette(open_console):
    page = open_console()
    find(page, "help")
    page.evaluate(
        """() => {
          document.querySelector("#help").close();
          document.querySelector("#palette-open").click();
        }"""
    )
    expect(page.locator("#help-open")).to_have_attribute("aria-expanded", "false")
    expect(page.locator("#palette-field")).to_be_focused()


def test_a_pose_is_set_with_arrow_keys(open_console):
    page = open_console()
    select(page, "robot 1")
    for _ in range(5):  # a page that is too busy sends nothing
        page.keyboard.press("i")
        page.keyboard.press("ArrowDown")
        page.keyboard.press("Shift+ArrowLeft")
        page.keyboard.press("Enter")
        try:
            expect(page.locator(".webmap-locate-word")).to_have_text("Pose sent.")
        except AssertionError:
            continue
        return
    raise AssertionError(page.locator(".webmap-locate-word").inner_text())


def tab_to(page: Page, name: str) -> None:
    """Press Tab until the focus is on the button whose name begins with ``name``."""
    focused = "() => document.activeElement?.innerText ?? ''"
    for _ in range(60):
        page.keyboard.press("Tab")
        if page.evaluate(focused).startswith(name):
            return
    raise AssertionError(f"the Tab key does not reach {name}")


def test_a_route_is_made_with_arrow_keys_and_started_and_ended(open_console):
    page = open_console()
    select(page, "robot 1")
    find(page, "tool route")
    tab_to(page, "Add points")
    page.keyboard.press("Enter")
    points = page.locator(".webmap-route-list > li")
    for count in (1, 2):
        for _ in range(4):
            page.keyboard.press("ArrowDown")
        page.keyboard.press("Enter")
        expect(points).to_have_count(count)
    page.keyboard.press("Escape")
    expect(page.get_by_role("button", name="Add points")).to_be_visible()
    tab_to(page, "Start route")
    page.keyboard.press("Enter")
    status = page.locator(".webmap-route > .webmap-tool-body > .webmap-route-word")
    expect(status).to_contain_text("Robot 1")
    tab_to(page, "End route")
    page.keyboard.press("Enter")
    expect(page.get_by_role("button", name="End route")).to_be_hidden()


def test_a_camera_is_shown_large_and_small(open_console):
    page = open_console()
    select(page, "robot 1")
    expect(page.locator("#card [data-camera-id]").first).to_be_visible()
    find(page, "camera")
    expect(page.locator(".camera-panel")).to_be_visible()
    find(page, "camera")
    expect(page.locator(".camera-panel")).to_be_hidden()


def test_control_is_requested_and_handed_over(open_console):
    mine, theirs = open_console(), open_console()
    for page in (mine, theirs):
        select(page, "robot 2")
    mine.bring_to_front()
    find(mine, "take control")
    expect_state(mine, "You have control")
    theirs.bring_to_front()
    find(theirs, "request control")
    mine.bring_to_front()
    expect(mine.get_by_role("button", name="Hand over")).to_be_visible()
    tab_to(mine, "Hand over")
    mine.keyboard.press("Enter")
    theirs.bring_to_front()
    expect_state(theirs, "You have control")
