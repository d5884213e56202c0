"""Real Chromium, as large as an operator's window."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page

from real_browser import watched_tab


@pytest.fixture
def tab(chromium: Browser) -> Iterator[Page]:
    with watched_tab(chromium, 1200, 800) as page:
        yield page


@pytest.fixture
def other(chromium: Browser) -> Iterator[Page]:
    """Somebody else's page, in a browser of their own."""
    with watched_tab(chromium, 1200, 800) as page:
        yield page
