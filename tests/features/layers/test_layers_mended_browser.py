"""How a page shows an error that occurs in every message, with other numbers."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect

from equipment.chromium import watched_tab
from equipment.webmap_process import page_of

pytestmark = pytest.mark.browser

HERE = Path(__file__).parents[1]

COUNT = """
window.most = 0;
window.words = new Set();
new MutationObserver(() => {
  // Notices about a slow link do not count.
  const boxes = document.querySelectorAll(".webmap-notice:not(.status)");
  window.most = Math.max(window.most, boxes.length);
  for (const { textContent } of boxes) window.words.add(textContent);
}).observe(document, { subtree: true, childList: true, characterData: true });
"""

CLEAR = """() => {
  const tool = document.querySelector(".webmap-measure-go")?.getBoundingClientRect();
  const covers = (box) => box.left < tool.right && tool.left < box.right
    && box.top < tool.bottom && tool.top < box.bottom;
  const boxes = [...document.querySelectorAll(".webmap-notice")];
  return tool && !boxes.some((box) => covers(box.getBoundingClientRect()));
}"""
"""Whether the notices do not cover the tool at the top of the map."""


@pytest.fixture
def tab(chromium: Browser) -> Iterator[Page]:
    scene = HERE / "scene_of_mended.py"
    with (
        page_of(scene, PYTHONPATH=str(HERE)) as url,
        watched_tab(chromium, 700, 500) as tab,
    ):
        tab.add_init_script(COUNT)
        tab.goto(url)
        tab.locator("svg.webmap").focus()
        yield tab


def test_repeated_nan_messages_show_one_notice_until_the_path_is_valid(tab):
    notices = tab.locator(".webmap-notice")
    expect(notices).to_contain_text("Ann: /plan: a path must be of finite numbers, got")
    path = tab.locator(".path > polyline[points]")
    expect(path).to_have_count(1)
    drawn = path.get_attribute("points")
    tab.wait_for_function(
        "d => document.querySelector('.path > polyline[points]')"
        ".getAttribute('points') !== d",
        arg=drawn,
    )
    expect(notices).to_have_count(1)
    assert tab.evaluate("[window.most, window.words.size]") == [1, 1]
    tab.keyboard.press("m")
    expect(notices).to_have_count(0)
    expect(path).to_have_count(2)

    tab.keyboard.press("m")
    expect(notices).to_have_count(1)
    notices.get_by_role("button", name="Dismiss").click()
    tab.locator("svg.webmap").focus()
    tab.keyboard.press("m")
    expect(path).to_have_count(2)
    tab.keyboard.press("m")
    tab.keyboard.press("b")
    expect(notices).to_contain_text("Ann: /plan_of_ann: ")
    expect(notices).to_have_count(1)
    tab.reload()
    expect(notices).to_have_count(2)
    tab.wait_for_function(CLEAR)
