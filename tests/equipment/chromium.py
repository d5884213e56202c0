"""A real Chromium, and the errors and warnings that it reports."""

import os
import re
import shutil
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

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

# Each new window loads two internal pages of Chromium for the list below the address
# bar, which takes as long as a page of WebMap, and each page starts a process for a
# next page, which no test opens. Chromium uses only the last option of this name, so
# this list also has the features that Playwright disables.
DISABLED_FEATURES = [
    "SpareRendererForSitePerProcess",
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

# Nobody sees the window around a page: its own animations, such as a tab that opens,
# take a fifth of what a new page costs. The animations of pages do not depend on this.
CHROMIUM_ARGS = [
    "--animation-duration-scale=0",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    f"--disable-features={','.join(DISABLED_FEATURES)}",
]


def chromium_path() -> str:
    """Return the path of the browser: ``CHROMIUM`` names one, or it is Debian's."""
    named = os.environ.get("CHROMIUM") or "chromium"
    if found := shutil.which(named):
        return found
    raise FileNotFoundError(
        f"the tests need Chromium, and {named} is no program here: install Debian's "
        "package chromium, or set CHROMIUM to the path of a Chromium or Chrome"
    )


@contextmanager
def launched() -> Iterator[Browser]:
    """Run a browser.

    Playwright runs an event loop in this thread. Other tests cannot use asyncio in the
    thread until the browser ends.
    """
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=chromium_path(), args=CHROMIUM_ARGS
        )
        yield browser
        browser.close()


def end_stops(button: Locator) -> None:
    """End every STOP with two presses of a reset button, wherever it is on the page.

    The page must already show every STOP: another STOP between the two presses cancels
    the first press. A script in the page makes both presses, because a busy machine may
    need seconds between two presses by Playwright, and the first press then expires.

    On a busy machine a page may lose its connection after a STOP and send the STOP
    again; the gate then refuses a reset of the first one. So this function presses once
    more if the STOP does not end, as an operator does.
    """
    # The button is hidden until the gate has reported a STOP.
    expect(button).not_to_have_attribute("hidden", "")
    assert press_twice(button) == "Press again to reset"
    with suppress(AssertionError):
        expect(button).to_have_attribute("hidden", "", timeout=5_000)
        return
    assert press_twice(button) == "Press again to reset"
    expect(button).to_have_attribute("hidden", "")


def press_twice(button: Locator) -> str:
    """Press a button twice in time, and return its text between the presses."""
    return button.evaluate(
        """async (e) => {
          e.click();
          await new Promise((done) => setTimeout(done, 450));
          const asked = e.innerText;
          e.click();
          return asked;
        }"""
    )


def hold(keyboard: Keyboard, key: str, has_effect: Callable[[], bool]) -> None:
    """Hold a key until it has an effect, and keep it pressed.

    If a busy machine delays the page, a press may have no effect, because the gate
    refuses late commands. Then this function presses again, as an operator does.
    """
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline:
        time.sleep(0.5)  # all keys must be released before a press counts
        keyboard.down(key)
        end_of_try = time.monotonic() + 3
        while time.monotonic() < end_of_try:
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
        """The reports that match no pattern in ``allowed``."""
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
    finally:  # a page that runs on would slow down all later tests
        context.close()
    complaints.allowed = page.allowed
    assert not complaints.unexpected, complaints.unexpected


@contextmanager
def asleep(tab):
    """Stop the process of the page, as a phone does; the browser keeps its socket."""
    browser = tab.context.browser.new_browser_cdp_session()
    found = browser.send("SystemInfo.getProcessInfo")["processInfo"]
    pids = [each["id"] for each in found if each["type"] == "renderer"]
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        for pid in pids:
            os.kill(pid, signal.SIGCONT)
