"""The texts of the console are true, and the same everywhere."""

import re
from pathlib import Path

import pytest
from console_ready import (
    expect_state,
    select,
    send_away,
    shown_state,
    title,
    unfold,
    wait_until_ready,
)
from playwright.sync_api import expect

from equipment.chromium import end_stops, hold, watched_tab
from equipment.webmap_process import simulator, webmap

pytestmark = [pytest.mark.browser, pytest.mark.slow]

ROBOTS = 10
"""Enough robots for a list with a search."""

PLACE = """() => {
  const { e, f } = document.querySelector(".robot.selected").getScreenCTM();
  return [e, f];
}"""
"""The place of the selected robot in the window."""

HAS_GONE = f"""([x, y, far]) => {{
  const [e, f] = ({PLACE})();
  return Math.hypot(e - x, f - y) > far;
}}"""


def test_a_robot_with_a_goal_is_autonomous_and_its_cancel_names_the_operator(
    open_console,
):
    page = open_console()
    select(page, "Robot 2")
    send_away(page)
    expect_state(page, re.compile("^Autonomous"))
    page.locator("#card").get_by_role("button", name="Cancel goal").click()
    goal = page.locator("#card .goal")
    expect(goal).to_contain_text("Goal cancelled: by ")
    expect(goal).not_to_contain_text("another program")
    expect_state(page, "You have control")


def test_the_card_of_the_selected_robot_is_shown_after_a_reload(open_console):
    page = open_console()
    select(page, "Robot 3")
    page.reload()
    wait_until_ready(page)
    expect(page.locator("#card h2")).to_have_text("Robot 3")
    expect(page.locator("#card")).to_be_visible()
    page.get_by_role("button", name="Deselect the robot").click()
    expect(page.locator("#card")).to_be_hidden()
    select(page, "Robot 3")


def test_the_view_uncovers_a_robot_that_is_selected_in_the_list(
    open_console,
):
    page = open_console()
    select(page, "Robot 4")
    card = page.locator("#card").bounding_box()
    x, y = page.evaluate(PLACE)
    # The card of the robot covers the robot now.
    page.mouse.move(300, 400)
    page.mouse.down()
    page.mouse.move(
        300 + card["x"] + card["width"] / 2 - x,
        400 + card["y"] + card["height"] / 2 - y,
        steps=4,
    )
    page.mouse.up()
    page.locator("#robots .row", has_text="Robot 5").locator("button").first.click()
    expect(page.locator("#card h2")).to_have_text("Robot 5")
    page.locator("#robots .row", has_text="Robot 4").locator("button").first.click()
    page.wait_for_function(
        """() => {
          const robot = document.querySelector(".robot.selected");
          if (robot?.dataset.name !== "Robot 4") return false;
          const { e, f } = robot.getScreenCTM();
          const there = document.elementFromPoint(e, f);
          return !!there?.closest("svg.webmap");
        }"""
    )


def test_set_pose_on_the_page_does_not_report_a_jump_of_the_pose(chromium):
    # The demo draws robots by their odometry, which no initial pose changes.
    view = ("--stops-within", "0.25", "--port", "0", "--no-browser")
    with (
        watched_tab(chromium, 1280, 800) as page,
        simulator("--robots", "2") as robots,
        webmap("view", robots, *view) as url,
    ):
        page.goto(url)
        page.allowed = ["WebSocket", "ERR_CONNECTION"]  # when all of it ends
        expect(page.locator(".robot:not(.unplaced)")).to_have_count(2)
        wait_until_ready(page)
        select(page, "robot_0")
        unfold(page)
        status = page.locator(".webmap-locate-word")
        before = page.evaluate(PLACE)
        for _ in range(5):  # a page that is too busy sends nothing
            page.get_by_role("button", name="Set pose").click()
            expect(status).to_contain_text("Press where the robot is")
            page.mouse.click(before[0] + 70, before[1] - 70)
            expect(status).to_have_text(re.compile("^Pose sent|^Pose not sent"))
            if status.inner_text() == "Pose sent.":
                break
        page.wait_for_function(HAS_GONE, arg=[*before, 60])
        page.wait_for_timeout(2000)
        assert page.locator("#card .problems").text_content() == ""


@pytest.mark.parametrize(
    ("opener", "open_"),
    [
        ("#bridges summary", "#bridges > details[open]"),
        (".webmap-layers > summary", ".webmap-layers[open]"),
        ("#help-open", "#help[open]"),
        (".webmap-export-go", ".webmap-export-menu:not([hidden])"),
    ],
)
def test_escape_closes_a_menu_and_sends_no_stop(open_console, opener, open_):
    page = open_console()
    select(page, "Robot 1")
    page.locator(opener).first.click()
    expect(page.locator(open_).first).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator(open_)).to_have_count(0)
    page.wait_for_timeout(500)
    expect(shown_state(page)).to_have_text("Free")


def test_escape_sends_stop_while_this_page_drives_even_with_an_open_menu(open_console):
    page = open_console()
    select(page, "Robot 7")
    page.locator(".webmap-layers > summary").click()
    hold(page.keyboard, "a", lambda: title(page).text_content() == "You are driving")
    page.keyboard.press("Escape")
    expect_state(page, "STOP active")
    page.keyboard.up("a")
    end_stops(page.locator(".webmap-teleop .webmap-reset"))
    expect(shown_state(page)).to_have_text("Free")


def test_escape_sends_stop_while_a_robot_of_this_page_navigates(
    open_console,
):
    page = open_console()
    select(page, "Robot 8")
    send_away(page)
    page.locator(".webmap-layers > summary").click()
    page.keyboard.press("Escape")
    expect_state(page, "STOP active")
    end_stops(page.locator(".webmap-teleop .webmap-reset"))


def test_the_space_bar_sends_stop_after_escape_closed_a_menu(open_console):
    page = open_console()
    select(page, "Robot 1")
    page.locator(".webmap-layers > summary").click()
    page.keyboard.press("Escape")
    expect(page.locator(".webmap-layers[open]")).to_have_count(0)
    page.keyboard.press("Space")
    expect_state(page, "STOP active")
    end_stops(page.locator(".webmap-teleop .webmap-reset"))


def test_the_search_shows_only_robots_whose_name_contains_the_text(open_console):
    page = open_console()
    page.keyboard.press("/")
    page.keyboard.type("robot 7")
    expect(page.locator("#robots .row:visible")).to_have_count(1)
    row = page.locator("#robots .row", has_text="Robot 7")
    expect(row).to_be_visible()


def test_enter_selects_the_only_hit_and_a_search_without_hits_shows_a_message(
    open_console,
):
    page = open_console()
    search = page.locator("#search")
    search.fill("robot")
    search.press("Enter")
    expect(page.locator("#card")).to_be_hidden()
    search.fill("bot 8")
    search.press("Enter")
    expect(page.locator("#card h2")).to_have_text("Robot 8")
    search.fill("no such name")
    expect(page.locator("#not-found")).to_have_text(
        "No robot has “no such name” in its name."
    )
    search.fill("")
    expect(page.locator("#not-found")).to_be_hidden()


def test_the_log_of_the_demo_is_not_empty(open_console):
    page = open_console()
    page.locator(".webmap-rosout summary").click()
    expect(page.locator(".webmap-rosout-line").first).to_be_visible()
    expect(page.locator(".webmap-rosout")).to_contain_text("ready, the battery is at")


def test_the_round_trip_is_the_only_latency_shown_and_has_an_explanation(open_console):
    page = open_console()
    select(page, "Robot 1")
    expect(page.locator("#link")).to_have_text("Connected", use_inner_text=True)
    loop = page.locator(".webmap-teleop-figures .time").first
    expect(loop).to_have_attribute(
        "title", re.compile("From this page to WebMap and back: ")
    )


def test_an_exported_picture_contains_no_handles_of_tools(open_console, tmp_path):
    page = open_console()
    page.locator(".webmap-export-go").first.click()
    with page.expect_download() as download:
        page.locator(".webmap-export-svg").first.click()
    file: Path = tmp_path / "view.svg"
    download.value.save_as(file)
    text = file.read_text(encoding="utf-8")
    assert "Robot 1" in text
    assert "webmap-align" not in text
    # Opened alone, the image is empty in the corner where hidden parts would be.
    page.goto(file.as_uri())
    there = page.evaluate(
        """() => [...document.querySelectorAll("circle, path, rect, line")]
          .map((e) => [e.outerHTML.slice(0, 120), e.getBoundingClientRect()])
          .filter(([, { x, y, width, height }]) => width > 0 &&
            Math.max(width, height) < 60 && Math.max(x + width, y + height) < 60)
          .map(([text]) => text)"""
    )
    assert there == []


def test_robots_of_the_same_name_on_two_bridges_of_one_host_show_the_port(chromium):
    with (
        simulator("--flat") as one,
        simulator("--flat") as other,
        webmap("view", one, other, "--port", "0", "--no-browser") as url,
        watched_tab(chromium, 1280, 800) as page,
    ):
        page.allowed = ["WebSocket", "ERR_CONNECTION"]  # when all of it ends
        page.goto(url)
        hosts = [address.removeprefix("ws://").rstrip("/") for address in (one, other)]
        for host in hosts:
            row = page.locator("#robots .row", has_text=f"robot ({host})")
            expect(row).to_have_count(1)


FOCUSED = """() => {
  const e = document.activeElement;
  return e.id || e.dataset.act || e.getAttribute("class") || e.tagName;
}"""


def test_the_tab_key_reaches_the_main_controls(open_console):
    page = open_console()
    select(page, "Robot 0")
    reached = set()
    page.evaluate("document.activeElement.blur()")
    for _ in range(60):
        page.keyboard.press("Tab")
        reached.add(page.evaluate(FOCUSED))
    wanted = {"help-open", "zoom-in", "show-all", "search", "follow", "send", "cancel"}
    assert wanted <= reached
    assert any("webmap-stop-all" in name for name in reached)
