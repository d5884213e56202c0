"""Alerts in a real browser: two viewers, a simulator that halts, and no flood."""

import re
import signal

import pytest
from console_ready import halt_robots
from playwright.sync_api import Page, expect

from equipment.waiting import wait_for

pytestmark = [pytest.mark.browser, pytest.mark.slow]

LOST = re.compile("No pose received|No connection to the bridge")
SOON = 15_000


def opened(page: Page) -> Page:
    page.locator(".webmap-alerts > summary").click()
    return page


def new(page: Page):
    return page.locator("[aria-label='New alerts'] > li")


def old(page: Page):
    return page.locator("[aria-label='Acknowledged alerts'] > li")


def test_two_viewers_share_the_alerts_of_lost_robots(demo, open_console, halt):
    ann, bob = opened(open_console()), opened(open_console("phone"))
    expect(new(ann)).to_have_count(0)
    expect(ann.locator(".webmap-alert-badge")).to_be_hidden()

    def lost() -> None:
        each = new(ann).filter(has_text=LOST)
        expect(each).to_have_count(demo.robots, timeout=SOON)

    halt_robots(halt, ann, lost)
    for page in (ann, bob):
        expect(new(page).filter(has_text=LOST)).to_have_count(demo.robots, timeout=SOON)
        expect(page.locator(".webmap-alert-badge")).to_have_text(re.compile(r"\d"))
        expect(page.locator(".webmap-alert-headline")).to_contain_text(
            f"{demo.robots} lost"
        )

    robot = new(ann).filter(has_text=LOST).first
    name = robot.locator(".webmap-alert-robot").inner_text()
    robot.get_by_role("button", name="Acknowledge").click()
    for page in (ann, bob):
        seen = old(page).filter(has_text=LOST)
        expect(seen).to_have_count(1)
        expect(seen.locator(".webmap-alert-robot")).to_have_text(name)
        expect(seen.locator(".webmap-alert-by")).to_have_text(
            re.compile(r".+, \d\d:\d\d$")
        )
        expect(seen.locator(".webmap-alert-act")).to_be_hidden()

    old(ann).locator(".webmap-alert-robot").first.click()
    expect(ann.locator("#card h2")).to_have_text(name)

    halt.send_signal(signal.SIGCONT)
    for page in (ann, bob):
        over = page.locator(".webmap-alert[data-state=over]", has_text=LOST)
        expect(over).to_have_count(demo.robots, timeout=SOON)
        expect(over.first.locator(".webmap-alert-end")).to_have_text(
            re.compile(r"over after \d+ s")
        )
    bob.get_by_role("button", name="Acknowledge all").click()
    for page in (ann, bob):
        expect(new(page)).to_have_count(0)
        expect(page.locator(".webmap-alert-headline")).to_have_text("No new alerts.")


def test_the_sound_waits_for_a_press_and_the_choice_is_kept(open_console):
    page = open_console()
    # A script of the test counts as a press.
    page.add_init_script(
        "Object.defineProperty(navigator, 'userActivation', { get: () => null });"
    )
    page.reload()
    note = page.locator(".webmap-alert-signals p").first
    assert note.text_content() == "Sound starts after the first press on the page."
    opened(page)
    expect(note).to_have_text("")
    sound = page.get_by_label("Sound")
    expect(sound).to_be_checked()
    sound.uncheck()
    page.reload()
    opened(page)
    expect(page.get_by_label("Sound")).not_to_be_checked()
    expect(page.locator(".webmap-alert-signals p").first).to_be_hidden()


WATCH_SOUND = """
globalThis.sounds = [];
globalThis.tones = 0;
globalThis.AudioContext = class extends AudioContext {
  constructor() {
    super();
    sounds.push(this);
  }
  createOscillator() {
    const tone = super.createOscillator();
    tone.addEventListener("ended", () => { tones += 1; });
    return tone;
  }
};
"""

SIGNAL = """async () => {
  const { Signals } = await import("/_webmap/features/alerts/alert_signal.js");
  new Signals().give("An alert", "");
}"""

RESTS = "sounds.every(({ state }) => state === 'suspended')"


def test_the_browser_plays_no_silence_between_two_signals(open_console):
    page = open_console()
    page.add_init_script(WATCH_SOUND)
    page.reload()
    opened(page)
    assert page.evaluate(RESTS)
    page.evaluate(SIGNAL)
    wait_for(
        lambda: page.evaluate(f"tones === 2 && {RESTS}"),
        lambda: f"rest: {page.evaluate('[tones, sounds.map(String)]')}",
        page=page,
    )


def test_a_page_without_the_permission_shows_why_it_gives_no_notification(open_console):
    page = open_console()
    page.add_init_script(
        "Object.defineProperty(Notification, 'permission', { get: () => 'denied' });"
    )
    page.reload()
    opened(page)
    switch = page.get_by_label("Notification while another window is in front")
    switch.click()
    expect(switch).not_to_be_checked()
    expect(page.locator(".webmap-alert-signals")).to_contain_text(
        "The browser blocks notifications of this page."
    )
