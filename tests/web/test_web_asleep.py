"""A page that sleeps, as on a phone, shows the newest state first."""

import time

import pytest

from equipment.chromium import asleep
from equipment.devtools import Chromium
from equipment.scene_host import wait
from equipment.waiting import wait_for
from webmap.scene.wire.session import SceneSession

pytestmark = [pytest.mark.browser, pytest.mark.slow]

RECORD = """async () => {
  const { page } = await import("/_webmap/web/page.js");
  const robot = () => document.querySelector(".robot")?.transform.baseVal;
  window.drawn = [];
  const apply = page.scene.apply;
  page.scene.apply = function (...args) {
    const frame = apply.apply(this, args);
    const list = robot();
    const x = list?.length ? list.getItem(0).matrix.e : null;
    drawn.push(x && Math.round(x * 1000) / 1000);
    return frame;
  };
}"""


@pytest.fixture
def opened(host, tab):
    def build(shown):
        _, world, mount = shown.add_map()
        shown.robot, _ = shown.add_robot(world, mount)

    host.build = build
    tab.goto(host.url)
    tab.wait_for_selector(".robot circle")
    return host.one


def test_a_page_that_slept_shows_the_newest_pose_at_once(host, tab, opened):
    tab.evaluate(RECORD)
    with asleep(tab):
        before = opened.frames
        for step in range(1, 201):
            host.call(opened.robot.set_pose, step / 100, 0, 0)
            time.sleep(0.01)
        sent = opened.frames - before
    wait(tab, "window.drawn.includes(2)")
    # The page received the frames under way and the current state, nothing else.
    assert sent <= SceneSession.WINDOW
    assert tab.evaluate("drawn.indexOf(2)") <= SceneSession.WINDOW
    assert len(opened.hellos) == 1


def test_a_page_that_the_browser_froze_connects_again(host, opened):
    with Chromium() as browser:
        tab = browser.new_tab()
        tab.go(host.url)
        tab.wait("document.querySelector('.robot circle')?.tagName")
        (mine,) = [shown for shown in host.shown.values() if shown is not opened]
        tab.evaluate(f"({RECORD})()")
        browser.new_tab()  # hides the first tab
        tab.wait("document.visibilityState === 'hidden'")
        tab.call("Page.setWebLifecycleState", state="frozen")
        before = mine.frames
        for step in range(1, 101):
            host.call(mine.robot.set_pose, step / 50, 0, 0)
            time.sleep(0.01)
        assert mine.frames - before <= SceneSession.WINDOW
        tab.call("Page.setWebLifecycleState", state="active")
        wait_for(lambda: len(mine.hellos) == 2)
        browser.activate(tab)
        tab.wait("window.drawn.includes(2)")
        assert tab.evaluate("drawn.find((x) => x !== null)") == 2, (
            "the newest pose is drawn first"
        )
