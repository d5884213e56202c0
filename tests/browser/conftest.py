"""A real Chromium in the window size of an operator."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page

from equipment.chromium import watched_tab


@pytest.fixture
def tab(chromium: Browser) -> Iterator[Page]:
    with watched_tab(chromium, 1200, 800) as page:
        yield page


@pytest.fixture
def other(chromium: Browser) -> Iterator[Page]:
    """The page of another person, in a separate browser context."""
    with watched_tab(chromium, 1200, 800) as page:
        yield page
