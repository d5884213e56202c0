"""Debian's Chromium, and what it complains about."""

import re
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Keyboard,
    Locator,
    Page,
    expect,
    sync_playwright,
)

# Each new window loads two pages of Chromium's own for a list below its address bar,
# which takes as long as a page of ours. Chromium takes the last such option only, so
# this one repeats the features that Playwright disables.
DISABLED_FEATURES = [
    "WebUIOmniboxPopup",
    "WebUIOmniboxAimPopup",
    "WebUIOmniboxFullPopup",
    "AimEnabled",
    "AvoidCorsURLLoaderRestartOnRedirect",
    "AvoidUnnecessaryBeforeUnloadCheckSync",
    "DestroyProfileOnBrowserClose",
    "HttpsFirstBalancedModeAutoEnable",
    "HttpsUpgrades",
    "LensOverlay",
    "MediaRouter",
    "NetworkTimeServiceQuerying",
    "OptimizationHints",
    "PaintHolding",
    "PreconnectToSearch",
    "TcpPortRandomizationWin",
    "ThirdPartyStoragePartitioning",
]

CHROMIUM_ARGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    f"--disable-features={','.join(DISABLED_FEATURES)}",
]


@contextmanager
def launched() -> Iterator[Browser]:
    """Run a browser.

    Playwright keeps an event loop running in the thread, in which no other test may
    use asyncio until this ends.
    """
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=CHROMIUM_ARGS
        )
        yield browser
        browser.close()


def end_stops(button: Locator) -> None:
    """End every STOP with the button that does, wherever on the page it lies.

    All of them have to be known to the page: a robot that comes to be stopped between
    the two presses takes the first one back. The presses are apart by the clock of the
    page, as a busy machine may take seconds between two of Playwright's, and the first
    is forgotten by then.
    """
    # There is none to press before the gate has said that it stopped a robot.
    expect(button).not_to_have_attribute("hidden", "")
    asked = button.evaluate(
        """async (e) => {
          e.click();
          await new Promise((done) => setTimeout(done, 450));
          const asked = e.textContent;
          e.click();
          return asked;
        }"""
    )
    assert asked == "Press again to reset"
    expect(button).to_have_attribute("hidden", "")


def hold(keyboard: Keyboard, key: str, has_effect: Callable[[], bool]) -> None:
    """Hold a key until it has its effect, and keep holding it.

    On a machine that is too busy to run the page at its pace a press does nothing,
    since nothing may move by a late command. Like a person, this presses again.
    """
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        time.sleep(0.5)  # hands must be off before a press counts
        keyboard.down(key)
        patience = time.monotonic() + 3
        while time.monotonic() < patience:
            if has_effect():
                return
            time.sleep(0.02)
        keyboard.up(key)
    raise AssertionError(f"{key} had no effect")


class Complaints:
    """Errors, warnings and violations that pages report."""

    def __init__(self) -> None:
        self.allowed: list[str] = []
        self._reports: list[tuple[str, str]] = []
        """Each text with its URL; patterns apply to the text alone."""

    def listen(self, context: BrowserContext) -> None:
        """Record what the pages of a context report, also later pages."""
        context.on(
            "weberror",
            lambda error: self._reports.append((f"exception: {error.error}", "")),
        )
        context.on("console", self._console)

    def _console(self, message: ConsoleMessage) -> None:
        if message.type in {"error", "warning"}:
            url = message.location["url"]
            self._reports.append((f"{message.type}: {message.text}", url))

    @property
    def unexpected(self) -> list[str]:
        """What no pattern in ``allowed`` is found in."""
        return [
            f"{line} {url}".rstrip()
            for line, url in self._reports
            if not any(re.search(pattern, line) for pattern in self.allowed)
        ]


@contextmanager
def watched_tab(browser: Browser, width: int, height: int) -> Iterator[Page]:
    """Open a page that fails the test on any complaint not in ``page.allowed``.

    The same holds for all other pages that are opened in its context.
    """
    context = browser.new_context(viewport={"width": width, "height": height})
    complaints = Complaints()
    complaints.listen(context)
    page = context.new_page()
    page.allowed = []
    try:
        yield page
    finally:  # a page that goes on would slow down all later tests
        context.close()
    complaints.allowed = page.allowed
    assert not complaints.unexpected, complaints.unexpected
