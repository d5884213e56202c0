"""The names of people on each other's pages, and one's own name in the bar."""

import re

import pytest
from console_ready import select, title, wait_until_ready
from playwright.sync_api import expect

from equipment.chromium import end_stops

pytestmark = pytest.mark.browser

ROBOTS = 1

RUTH = "\u05e8\u05d5\u05ea \u05dc\u05d5\u05d9 " * 25
"""200 characters from right to left."""

FORBIDDEN = """Object.defineProperty(window, "localStorage", {
  get() { throw new DOMException("blocked", "SecurityError"); },
});"""


def state_name(page, name, place=""):
    """Open the form in the bar and state a name."""
    page.locator("#operator summary").click()
    page.get_by_label("Your name on this page").last.fill(name)
    page.get_by_label("Place, such as room 2").fill(place)
    page.get_by_role("button", name="Save", exact=True).click()
    expect(page.locator("#operator form")).to_be_hidden()


def in_bar(page):
    return page.locator("#operator bdi")


def row(page):
    return page.locator("#robots .row .state")


def detail(page):
    return page.locator(".webmap-teleop-detail")


def test_others_see_the_name_and_the_person_is_you_on_each_own_page(open_console):
    mine, theirs = open_console(), open_console()
    expect(in_bar(mine)).to_have_text("Name?")
    state_name(mine, "Ana", "desk 4")
    expect(in_bar(mine)).to_have_text("Ana")
    second = mine.context.new_page()
    second.goto(mine.url)
    wait_until_ready(second)
    expect(in_bar(second)).to_have_text("Ana")
    for page in (mine, theirs, second):
        select(page, "Robot 0")
    mine.bring_to_front()
    mine.get_by_role("button", name="Take control of Robot 0").click()
    expect(title(mine)).to_have_text("You have control")
    expect(title(theirs)).to_have_text("Ana (desk 4) has control")
    expect(title(second)).to_have_text("Your other page has control")
    expect(row(theirs)).to_contain_text("Ana (desk 4) has control")
    expect(row(second)).to_contain_text("Your other page has control")
    # A new name is shown at once, and takes no control away.
    state_name(mine, "Eva", "desk 4")
    expect(title(theirs)).to_have_text("Eva (desk 4) has control")
    expect(title(mine)).to_have_text("You have control")
    expect(in_bar(second)).to_have_text("Eva")
    # Somebody else with the same name and place.
    state_name(theirs, "eva", "Desk 4")
    expect(in_bar(theirs)).to_have_text("eva 2")
    mine.get_by_role("button", name="STOP Robot 0").click()
    expect(detail(mine)).to_contain_text("By you,")
    expect(detail(second)).to_contain_text("By you, on another page")
    expect(detail(theirs)).to_contain_text("By Eva (desk 4)")
    expect(mine.locator("#card .reason")).to_contain_text("STOP by you is active")
    end_stops(mine.locator(".webmap-stop-list .webmap-reset"))


def test_the_page_keeps_the_name_after_a_reload_and_for_a_new_session(open_console):
    page = open_console()
    state_name(page, "Ana", "desk 5")
    page.reload()
    expect(in_bar(page)).to_have_text("Ana")
    page.evaluate("localStorage.setItem('webmap operator', '[7')")
    page.reload()
    expect(in_bar(page)).to_have_text("Ana")


def test_a_person_who_gives_no_name_is_not_asked_again(open_console):
    page = open_console()
    expect(in_bar(page)).to_have_text("Name?")
    state_name(page, "")
    expect(in_bar(page)).to_have_text("No name")
    page.reload()
    expect(in_bar(page)).to_have_text("No name")


def test_a_misleading_name_is_refused_with_the_reason(open_console):
    page = open_console()
    page.locator("#operator summary").click()
    page.get_by_label("Your name on this page").last.fill("You")
    page.keyboard.press("Enter")
    refused = "Other people could not tell whose name You is."
    expect(page.locator("#operator [role=status]")).to_have_text(refused)
    expect(page.locator("#operator summary")).to_have_attribute(
        "title",
        re.compile(r"You are an operator( \d)? at WebMap's computer \(no name\)"),
    )


def test_keys_and_stop_work_while_the_form_is_open(open_console):
    page = open_console()
    select(page, "Robot 0")
    page.locator("#operator summary").click()
    page.locator("svg.webmap").focus()
    page.keyboard.press("Space")
    expect(title(page)).to_contain_text("STOP")
    expect(page.locator("#operator form")).to_be_visible()
    end_stops(page.locator(".webmap-stop-list .webmap-reset"))


def test_without_storage_the_name_is_for_this_page(open_console, chromium, demo):
    context = chromium.new_context()
    context.add_init_script(FORBIDDEN)
    errors = []
    context.on("weberror", lambda error: errors.append(str(error.error)))
    page = context.new_page()
    page.goto(demo.url)
    wait_until_ready(page)
    state_name(page, "Ana", "desk 6")
    expect(in_bar(page)).to_have_text("Ana")
    context.close()
    assert errors == []


def test_a_name_of_200_characters_from_right_to_left_fits_the_bar_of_a_phone(
    open_console,
):
    page = open_console("phone")
    state_name(page, RUTH)
    expect(in_bar(page)).to_contain_text("\u2026")
    expect(page.locator("#operator summary")).to_have_attribute(
        "title", re.compile("\u2068\u05e8.*\u2026 \\(WebMap's computer\\)\u2069")
    )
    name, help = (
        page.locator(each).bounding_box() for each in ("#operator bdi", "#help-open")
    )
    assert 48 <= name["width"] <= 145
    assert name["x"] + name["width"] <= help["x"]
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    # The beginning of the name shows, at the right.
    assert in_bar(page).evaluate("e => getComputedStyle(e).direction") == "rtl"
