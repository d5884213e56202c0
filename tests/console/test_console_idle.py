"""What the browser does for a console that nobody touches, while no robot moves.

The tests count changes of the page, styles and layouts; they measure no time.
"""

import pytest
from console_ready import select, wait_until_ready
from playwright.sync_api import CDPSession, Page

pytestmark = pytest.mark.browser

ROBOTS = 1

SECONDS = 3.0

LAYOUTS_A_SECOND = 5.0
"""The ages change four times a second."""

SAME = """(ms) => new Promise((done) => {
  const same = new Set();
  const observer = new MutationObserver((records) => {
    for (const { target, attributeName, oldValue } of records) {
      if (target.getAttribute(attributeName) !== oldValue) continue;
      same.add(`${attributeName} of ${target.tagName} ${target.getAttribute("class")}`);
    }
  });
  const old = { attributes: true, attributeOldValue: true };
  observer.observe(document, { ...old, subtree: true });
  setTimeout(() => {
    observer.disconnect();
    done([...same]);
  }, ms);
})"""
"""The attributes that are written although they keep their values."""


@pytest.fixture
def idle(open_console) -> Page:
    page = open_console("desk")
    wait_until_ready(page)
    page.wait_for_timeout(2000)  # until all robots have reported everything
    return page


def counts(session: CDPSession) -> tuple[float, float]:
    """Return how often the browser has computed styles and layouts of the page."""
    metrics = session.send("Performance.getMetrics")["metrics"]
    numbers = {each["name"]: each["value"] for each in metrics}
    return numbers["RecalcStyleCount"], numbers["LayoutCount"]


@pytest.mark.parametrize("selected", [False, True])
def test_an_idle_console_writes_nothing_that_stays_the_same(idle, selected) -> None:
    if selected:
        select(idle, "Robot 0")
        idle.wait_for_timeout(1000)
    assert idle.evaluate(SAME, SECONDS * 1000) == []


def test_an_idle_console_computes_layouts_for_ages_only_and_no_styles(idle) -> None:
    session = idle.context.new_cdp_session(idle)
    session.send("Performance.enable")  # counts from now on
    styles, layouts = counts(session)
    idle.wait_for_timeout(SECONDS * 1000)
    more_styles, more_layouts = counts(session)
    assert more_styles - styles <= SECONDS
    assert more_layouts - layouts <= LAYOUTS_A_SECOND * SECONDS


MOST_ELEMENTS = 1_250
"""Elements of a page with one robot; it has about 1,120."""

FOLDED = """() => [...document.querySelectorAll("details:not([open]) > :not(summary)")]
  .filter((folded) => getComputedStyle(folded).display !== "none")
  .map(({ className }) => className)"""
"""The folded parts for which the browser computes styles of their content."""

ABOVE_ALL = """() => {
  const found = [];
  const look = (rules) => {
    for (const { media, selectorText, cssRules } of rules) {
      if (media && !matchMedia(media.mediaText).matches) continue;
      if (/(^|, |[ >])(html|body|:root)[^ >]*:has\\(/.test(selectorText)) {
        found.push(selectorText);
      }
      if (cssRules) look(cssRules);
    }
  };
  for (const { cssRules } of document.styleSheets) look(cssRules);
  return found;
}"""
"""The `:has()` that the browser evaluates for each element that any part adds."""


def test_the_page_makes_the_browser_style_little_that_nobody_sees(idle: Page) -> None:
    assert idle.evaluate("document.querySelectorAll('*').length") <= MOST_ELEMENTS
    assert idle.locator("details:not([open])").count() > 0
    assert idle.evaluate(FOLDED) == []
    assert idle.evaluate(ABOVE_ALL) == []
