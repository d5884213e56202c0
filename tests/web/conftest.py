"""Real Chromium, and a small display for it."""

import re
import shutil
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, sync_playwright
from scene_host import SceneHost

CHROMIUM_ARGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=CHROMIUM_ARGS
        )
        yield browser
        browser.close()


@pytest.fixture
def host() -> Iterator[SceneHost]:
    with SceneHost() as host:
        yield host


@pytest.fixture
def tab(chromium: Browser) -> Iterator[Page]:
    """A page that fails the test on any error, warning or violation in it."""
    context = chromium.new_context(viewport={"width": 800, "height": 600})
    page = context.new_page()
    said: list[str] = []
    page.on("pageerror", lambda error: said.append(f"exception: {error}"))
    page.on(
        "console",
        lambda message: (
            message.type in {"error", "warning"}
            and said.append(f"{message.type}: {message.text}")
        ),
    )
    page.allowed = []
    yield page
    context.close()
    unexpected = [
        line for line in said if not any(re.search(ok, line) for ok in page.allowed)
    ]
    assert unexpected == []
