"""The words of the console are true, and the same everywhere."""

import re
from contextlib import suppress
from pathlib import Path

import pytest
from console_ready import send_away, wait_until_ready
from playwright.sync_api import Page, expect

from real_browser import end_stops, hold, watched_tab
from webmap_process import simulator, webmap

pytestmark = [pytest.mark.browser, pytest.mark.slow]

ROBOTS = 10
"""So many that the list has a search."""

PLACE = """() => {
  const { e, f } = document.querySelector(".robot.selected").getScreenCTM();
  return [e, f];
}"""
"""Where the selected robot is in the window."""

HAS_GONE = f"""([x, y, far]) => {{
  const [e, f] = ({PLACE})();
  return Math.hypot(e - x, f - y) > far;
}}"""

BLOCKED = "Not moving: blocked?"
MINUS = re.compile("\N{MINUS SIGN}")


def select(page: Page, name: str) -> None:
    page.locator("#robots .row", has_text=name).locator("button").first.click()
    expect(page.locator("#card h2")).to_have_text(name)


def title(page: Page):
    return page.locator(".webmap-teleop-title")


def shown_state(page: Page):
    return page.locator("#card .state span:not(.old):visible").first


def same_word(page: Page, word: str | re.Pattern, patience: float = 15.0) -> None:
    """The bar, the card and the list have the same words for the selected robot."""
    line = page.locator("#robots .row:has([aria-pressed=true]) .state span:visible")
    for where in (title(page), shown_state(page), line.first):
        expect(where).to_have_text(word, timeout=patience * 1000)


@pytest.mark.serial  # a page that is kept waiting for a processor lets go
def test_the_bar_the_card_and_the_list_have_the_same_words(open_console):
    page = open_console()
    select(page, "Robot 1")
    same_word(page, "Free")
    page.get_by_role("button", name="Take control of Robot 1").click()
    same_word(page, "You have control")
    hold(page.keyboard, "a", lambda: title(page).text_content() == "You are driving")
    same_word(page, "You are driving")
    page.keyboard.up("a")
    same_word(page, "You have control")
    back = page.get_by_role("button", name="Release control", exact=True)
    back.evaluate("e => e.click()")  # it moves while the words beside it change
    same_word(page, "Free")


def test_a_robot_with_a_goal_navigates_and_one_s_own_cancel_is_named(open_console):
    page = open_console()
    select(page, "Robot 2")
    send_away(page)
    same_word(page, re.compile("^Navigating"))
    page.locator("#card").get_by_role("button", name="Cancel goal").click()
    goal = page.locator("#card .goal")
    expect(goal).to_contain_text("Goal cancelled: by ")
    expect(goal).not_to_contain_text("another program")
    same_word(page, "You have control")


def test_the_card_of_the_selected_robot_is_there_after_a_reload(open_console):
    page = open_console()
    select(page, "Robot 3")
    page.reload()
    wait_until_ready(page)
    expect(page.locator("#card h2")).to_have_text("Robot 3")
    expect(page.locator("#card")).to_be_visible()
    page.get_by_role("button", name="Deselect the robot").click()
    expect(page.locator("#card")).to_be_hidden()
    select(page, "Robot 3")


def test_a_robot_that_is_chosen_in_the_list_comes_to_where_nothing_covers_it(
    open_console,
):
    page = open_console()
    select(page, "Robot 4")
    card = page.locator("#card").bounding_box()
    x, y = page.evaluate(PLACE)
    # Its own card covers it now.
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


def test_no_jump_is_reported_after_one_s_own_set_pose(chromium):
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
        word = page.locator(".webmap-locate-word")
        before = page.evaluate(PLACE)
        for _ in range(5):  # a page that is too busy sends nothing
            page.get_by_role("button", name="Set pose").click()
            expect(word).to_contain_text("Press where the robot is")
            page.mouse.click(before[0] + 70, before[1] - 70)
            expect(word).to_have_text(re.compile("^Pose sent|^Not sent"))
            if word.inner_text() == "Pose sent.":
                break
        page.wait_for_function(HAS_GONE, arg=[*before, 60])
        page.wait_for_timeout(2000)
        assert page.locator("#card .problems").text_content() == ""


@pytest.mark.parametrize(
    ("opener", "open_"),
    [
        ("#bridges summary", "#bridges > details[open]"),
        (".webmap-layers summary", ".webmap-layers[open]"),
        ("#help-open", "#help[open]"),
        (".webmap-export-go", ".webmap-export-menu:not([hidden])"),
    ],
)
def test_escape_closes_a_menu_and_stops_nothing(open_console, opener, open_):
    page = open_console()
    select(page, "Robot 1")
    page.locator(opener).first.click()
    expect(page.locator(open_).first).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator(open_)).to_have_count(0)
    page.wait_for_timeout(500)
    expect(shown_state(page)).to_have_text("Free")


def test_escape_is_stop_while_this_page_drives_whatever_is_open(open_console):
    page = open_console()
    select(page, "Robot 7")
    page.locator(".webmap-layers summary").click()
    hold(page.keyboard, "a", lambda: title(page).text_content() == "You are driving")
    page.keyboard.press("Escape")
    same_word(page, "STOP active")
    page.keyboard.up("a")
    end_stops(page.locator(".webmap-teleop .webmap-reset"))
    expect(shown_state(page)).to_have_text("Free")


def test_escape_is_stop_while_this_page_holds_the_robot_that_goes_somewhere(
    open_console,
):
    page = open_console()
    select(page, "Robot 8")
    send_away(page)
    page.locator(".webmap-layers summary").click()
    page.keyboard.press("Escape")
    same_word(page, "STOP active")
    end_stops(page.locator(".webmap-teleop .webmap-reset"))


def test_the_space_bar_is_stop_again_after_escape_closed_a_menu(open_console):
    page = open_console()
    select(page, "Robot 1")
    page.locator(".webmap-layers summary").click()
    page.keyboard.press("Escape")
    expect(page.locator(".webmap-layers[open]")).to_have_count(0)
    page.keyboard.press("Space")
    same_word(page, "STOP active")
    end_stops(page.locator(".webmap-teleop .webmap-reset"))


def test_the_search_leaves_the_robots_whose_name_has_it(open_console):
    page = open_console()
    page.keyboard.press("/")
    page.keyboard.type("robot 7")
    expect(page.locator("#robots .row:visible")).to_have_count(1)
    row = page.locator("#robots .row", has_text="Robot 7")
    expect(row).to_be_visible()


def test_enter_selects_the_only_hit_and_a_search_in_vain_says_so(open_console):
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


def test_there_is_one_figure_of_latency_and_it_is_explained(open_console):
    page = open_console()
    select(page, "Robot 1")
    expect(page.locator("#link")).to_have_text("Connected", use_inner_text=True)
    loop = page.locator(".webmap-teleop-figures .time").first
    expect(loop).to_have_attribute(
        "title", re.compile("Round trip from this page to WebMap: ")
    )


@pytest.mark.serial  # a page that is kept waiting for a processor lets go
def test_a_robot_that_pushes_a_wall_is_shown_as_blocked(open_console):
    page = open_console()
    select(page, "Robot 9")
    words = title(page)
    for _ in range(8):  # a page that is too busy lets go
        hold(
            page.keyboard,
            "w",
            lambda: words.text_content() in ("You are driving", BLOCKED),
        )
        while words.text_content() == "You are driving":
            page.wait_for_timeout(100)
        with suppress(AssertionError):
            same_word(page, BLOCKED, patience=2.0)
            break
        page.keyboard.up("w")
    else:
        raise AssertionError(f"never shown as blocked: {words.text_content()}")
    detail = page.locator(".webmap-teleop-detail")
    expect(detail).to_have_text(re.compile(r"^Sent: \d\.\d\d m/s.*Measured: 0\.00 m/s"))
    page.keyboard.up("w")
    hold(page.keyboard, "s", lambda: "-" in MINUS.sub("-", detail.text_content()))
    page.keyboard.up("s")
    page.get_by_role("button", name="Release control", exact=True).click()


def test_an_exported_picture_has_no_handle_of_a_tool(open_console, tmp_path):
    page = open_console()
    page.locator(".webmap-export-go").first.click()
    with page.expect_download() as download:
        page.locator(".webmap-export-svg").first.click()
    file: Path = tmp_path / "view.svg"
    download.value.save_as(file)
    text = file.read_text(encoding="utf-8")
    assert "Robot 1" in text
    assert "webmap-align" not in text
    # Opened alone, nothing is drawn in the corner where hidden parts would lie.
    page.goto(file.as_uri())
    there = page.evaluate(
        """() => [...document.querySelectorAll("circle, path, rect, line")]
          .map((e) => [e.outerHTML.slice(0, 120), e.getBoundingClientRect()])
          .filter(([, { x, y, width, height }]) => width > 0 &&
            Math.max(width, height) < 60 && Math.max(x + width, y + height) < 60)
          .map(([text]) => text)"""
    )
    assert there == []


def test_robots_of_one_name_on_two_bridges_of_one_host_have_the_port(chromium):
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
