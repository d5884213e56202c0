"""The player bar in a real browser, with mouse, keyboard and touch, and its limits."""

import re
from contextlib import contextmanager

import pytest
from playwright.sync_api import expect

from equipment.bag_files import FRAMES, ODOMETRY, Made
from equipment.console_page import shown

pytestmark = pytest.mark.browser

BOOL, POSE = "std_msgs/Bool", "geometry_msgs/PoseStamped"

FRAME = """() => {
  const style = getComputedStyle(document.body, "::after");
  return style.content !== "none" && style.borderTopWidth === "3px"
    && style.pointerEvents === "none";
}"""


@pytest.fixture
def bag(tmp_path):
    """A minute with three events; at time t the robot is at x = t."""
    made = Made("ros2")
    goal = made.message(POSE, pose={"position": {"x": 3.0}, "orientation": {"w": 1.0}})
    moments = [step / 5 for step in range(301)]
    return made.bag(
        tmp_path / "office",
        ("/tf_static", FRAMES, 0.0, made.frame("laser")),
        *(("/odom", ODOMETRY, at, made.odometry(at, at)) for at in moments),
        ("/goal_pose", POSE, 20.0, goal),
        ("/e_stop", BOOL, 40.0, made.message(BOOL, data=True)),
        ("/e_stop", BOOL, 41.0, made.message(BOOL, data=False)),
        ("/e_stop", BOOL, 50.0, made.message(BOOL, data=True)),
    )


class Bar:
    """The player bar of a page."""

    def __init__(self, page):
        self.page = page
        self.play = page.locator(".webmap-player-play")
        self.slider = page.get_by_role("slider", name="Position in the recording")
        self.speed = page.get_by_label("Speed")
        self.marks = page.locator(".webmap-player-mark")
        self.text = page.locator(".webmap-player-text")

    @property
    def at(self):
        """The shown position in seconds."""
        text = self.page.locator(".webmap-player-time").text_content()
        minutes, seconds = text.partition(" /")[0].split(":")
        return 60 * int(minutes) + float(seconds)

    @property
    def x(self):
        """The robot's x, in metres."""
        return float(
            self.page.locator("#card .facts").first.text_content().split("m")[0][1:]
        )

    def expect_at(self, at, within=1.0):
        """Wait until the position and the robot are at a time of the recording."""
        self.page.wait_for_function(
            """([at, within]) => {
              const text = document.querySelector(".webmap-player-time").textContent;
              const [minutes, seconds] = text.split(" /")[0].split(":");
              const x = document.querySelector("#card .facts").textContent;
              const [found] = x.match(/-?\\d+\\.\\d\\d/) ?? ["-1"];
              return Math.abs(60 * minutes + +seconds - at) <= within
                && Math.abs(found - at) <= within;
            }""",
            arg=[at, within],
            timeout=15_000,
        )


@contextmanager
def opened(chromium, *arguments):
    """Open a recording and select its robot."""
    with shown(chromium, "play", *arguments) as page:
        expect(page.locator(".robot:not(.unplaced)")).to_have_count(1)
        page.locator("#robots .row").click()
        bar = Bar(page)
        expect(bar.slider).to_be_enabled()
        yield page, bar


def test_the_mouse_pauses_seeks_and_changes_the_speed(chromium, bag):
    with opened(chromium, bag) as (page, bar):
        bar.play.click()
        expect(bar.play).to_have_accessible_name("Play")
        box = bar.slider.bounding_box()
        page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        bar.expect_at(30.0, within=1.0)
        held = bar.at
        page.wait_for_timeout(1500)
        assert bar.at == held, "a seek does not end the pause"
        expect(page.locator("#card .age")).not_to_have_class(re.compile("stale"))
        bar.speed.select_option("8")
        bar.play.click()
        expect(bar.play).to_have_accessible_name("Pause")
        bar.expect_at(50.0, within=10.5)


def test_a_press_of_a_mark_seeks_to_shortly_before_it(chromium, bag):
    with opened(chromium, bag) as (_, bar):
        bar.play.click()
        expect(bar.marks).to_have_count(3)
        expect(bar.marks.nth(1)).to_have_attribute("title", "0:40.0 Stop on /e_stop")
        bar.marks.nth(1).click()
        bar.expect_at(38.0, within=0.3)
        expect(bar.text).to_contain_text("Stop on /e_stop")
        bar.marks.nth(0).click()
        bar.expect_at(18.0, within=0.3)


def test_the_keyboard_pauses_seeks_and_changes_the_speed(chromium, bag):
    with opened(chromium, bag) as (page, bar):
        page.keyboard.press("Tab")
        bar.play.focus()
        page.keyboard.press("Space")
        expect(bar.play).to_have_accessible_name("Play")
        expect(page.locator(".webmap-stop-list")).to_be_hidden()
        bar.slider.focus()
        page.keyboard.press("Home")
        bar.expect_at(0.0, within=0.3)
        for _ in range(3):
            page.keyboard.press("PageUp")
        page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowLeft")
        bar.expect_at(31.0, within=0.3)
        expect(bar.slider).to_have_attribute("aria-valuetext", "0:31.0 of 1:00.0")
        page.keyboard.press("Shift+Tab")
        page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowRight")
        expect(bar.text).to_contain_text("0:50.0 Stop on /e_stop")
        page.keyboard.press("Enter")
        bar.expect_at(48.0, within=0.3)
        bar.speed.focus()
        page.keyboard.press("4")
        expect(bar.speed).to_have_value("4")
        bar.play.focus()
        page.keyboard.press("Space")
        bar.expect_at(56.0, within=4.5)


def test_the_end_is_shown_and_play_begins_again(chromium, bag):
    with opened(chromium, bag) as (page, bar):
        bar.slider.focus()
        page.keyboard.press("End")
        expect(bar.text).to_have_text("End of the recording")
        expect(bar.play).to_have_accessible_name("Play again from the beginning")
        bar.play.click()
        expect(bar.play).to_have_accessible_name("Pause")
        bar.expect_at(5.0, within=5.0)
        expect(bar.text).to_have_text("")


def test_all_pages_show_the_same_position(chromium, bag):
    with opened(chromium, bag) as (page, bar):
        two = page.context.new_page()
        two.goto(page.url)
        other = Bar(two)
        two.locator("#robots .row").click()
        bar.play.click()
        bar.slider.focus()
        page.keyboard.press("Home")
        page.keyboard.press("PageUp")
        bar.expect_at(10.0, within=0.3)
        other.expect_at(10.0, within=0.3)
        expect(other.play).to_have_accessible_name("Play")
        other.play.click()
        expect(bar.play).to_have_accessible_name("Pause")


def test_a_seek_causes_no_problem_and_no_stop_and_the_page_has_a_frame(chromium, bag):
    with opened(chromium, bag) as (page, bar):
        page.wait_for_function(FRAME)
        for key in ("End", "Home", "PageUp", "End", "PageDown"):
            bar.slider.focus()
            page.keyboard.press(key)
            page.wait_for_timeout(700)
        bar.expect_at(50.0, within=3.0)
        assert page.locator("#card .problems").text_content() == ""
        expect(page.locator(".webmap-notices")).to_have_count(0)
        height = page.locator(".drive-bar").bounding_box()["height"]
        assert height <= 90


def test_a_page_cannot_give_the_replay_an_invalid_command(chromium, bag):
    with opened(chromium, bag) as (page, bar):
        bar.play.click()
        expect(bar.play).to_have_accessible_name("Play")
        bar.speed.evaluate(
            """(select) => {
              select.append(new Option("bad", "1e9"));
              select.value = "1e9";
              select.dispatchEvent(new Event("change"));
            }"""
        )
        page.allowed.append("rate needs a number")
        expect(page.locator("body")).to_contain_text("rate needs a number from 0.001")
        bar.play.click()
        expect(bar.play).to_have_accessible_name("Pause")


def test_a_recording_without_events_shows_that_there_are_none(chromium, tmp_path):
    made = Made("ros1")
    moments = [step / 5 for step in range(100)]
    calm = made.bag(
        tmp_path / "calm.bag",
        *(("/odom", ODOMETRY, at, made.odometry(at, at)) for at in moments),
    )
    with opened(chromium, calm) as (page, bar):
        expect(page.locator(".webmap-player-none")).to_have_text(
            "No stops, goals or alarms"
        )
        expect(bar.marks).to_have_count(0)


def test_a_damaged_recording_shows_where_and_why_it_ends(chromium, tmp_path):
    made = Made("ros1")
    moments = [step / 5 for step in range(100)]
    bag = made.bag(
        tmp_path / "broken.bag",
        *(("/odom", ODOMETRY, at, made.odometry(at, at)) for at in moments),
    )
    data = bytearray(bag.read_bytes())
    data[len(data) // 2 : len(data) // 2 + 2000] = bytes(2000)
    bag.write_bytes(data)
    with opened(chromium, bag, "--rate", "8") as (_, bar):
        expect(bar.text).to_contain_text("The recording is damaged: broken.bag cannot")
        assert 5 < bar.at < 15
        bar.play.click()
        expect(bar.play).to_have_accessible_name("Pause")


def test_the_bar_works_by_touch_on_a_phone(chromium, bag):
    with opened(chromium, bag) as (page, _):
        phone = chromium.new_context(
            viewport={"width": 390, "height": 844},
            has_touch=True,
            is_mobile=True,
            storage_state=page.context.storage_state(),
        )
        try:
            tab = phone.new_page()
            tab.goto(page.url)
            bar = Bar(tab)
            expect(bar.marks).to_have_count(3)
            bar.play.tap()
            expect(bar.play).to_have_accessible_name("Play")
            box = bar.marks.nth(1).bounding_box()
            tab.touchscreen.tap(box["x"] + box["width"] / 2 + 14, box["y"] + 8)
            expect(bar.text).to_contain_text("0:40.0 Stop on /e_stop")
            expect(tab.locator(".webmap-player-time")).to_have_text("0:38.0 / 1:00.0")
            sheet = tab.locator("#sheet").bounding_box()
            slider = bar.slider.bounding_box()
            assert slider["y"] + slider["height"] <= sheet["y"]
            assert tab.evaluate("document.documentElement.scrollWidth") <= 390
        finally:
            phone.close()
