"""An error or a warning on any page of a test fails the test."""

import pytest
from playwright.sync_api import Page

from equipment.chromium import watched_tab

pytestmark = pytest.mark.browser


def the_same(page: Page) -> Page:
    return page


def another(page: Page) -> Page:
    return page.context.new_page()


def one_that_it_opens(page: Page) -> Page:
    with page.expect_popup() as popup:
        page.evaluate("void window.open('about:blank')")
    return popup.value


def failure(chromium, do) -> str:
    """Return the reason why a test with an action on its tab fails."""
    try:
        with watched_tab(chromium, 400, 300) as tab:
            do(tab)
    except AssertionError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("which", [the_same, another, one_that_it_opens])
@pytest.mark.parametrize(
    ("kind", "script"),
    [
        ("error", "console.error('ouch')"),
        ("warning", "console.warn('ouch')"),
        ("exception", "setTimeout(() => { throw 'ouch'; })"),
    ],
)
def test_an_error_or_warning_on_any_page_of_a_browser_context_fails_the_test(
    chromium, which, kind, script
):
    def do(tab: Page) -> None:
        page = which(tab)
        page.evaluate(f"() => {{ {script}; }}")
        page.evaluate("new Promise(done => setTimeout(done))")

    assert f"{kind}: ouch" in failure(chromium, do)


def test_only_the_errors_that_a_test_allows_are_ignored(chromium):
    def do(tab: Page) -> None:
        tab.allowed = ["expected"]
        tab.evaluate("console.error('as expected'), console.error('another')")

    assert "another" in failure(chromium, do)
    assert "expected" not in failure(chromium, do)
