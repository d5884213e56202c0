"""Real Chromium, and a small display for it."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page
from scene_host import SceneHost

from real_browser import watched_tab


@pytest.fixture
def host() -> Iterator[SceneHost]:
    with SceneHost() as host:
        yield host


@pytest.fixture
def tab(chromium: Browser) -> Iterator[Page]:
    with watched_tab(chromium, 800, 600) as page:
        yield page
