"""The console in a real browser, on the real demo."""

import os
import re
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from dataclasses import dataclass

import psutil
import pytest
from console_ready import wait_until_ready
from playwright.sync_api import Browser, Page, expect

from equipment.chromium import Complaints

SIZES = {
    "desk": {"viewport": {"width": 1280, "height": 800}},
    "phone": {"viewport": {"width": 390, "height": 844}, "has_touch": True},
    "on its side": {"viewport": {"width": 844, "height": 390}, "has_touch": True},
    "small phone": {"viewport": {"width": 320, "height": 568}, "has_touch": True},
}


@dataclass
class Demo:
    """A running demo and the URL of its page."""

    url: str
    process: subprocess.Popen
    robots: int


@pytest.fixture(scope="module")
def demo(request: pytest.FixtureRequest) -> Iterator[Demo]:
    """Run ``webmap demo --quiet`` with as many robots as the module's ``ROBOTS``, or 3.

    Each robot costs the simulator, the display and the browser time.
    """
    robots = getattr(request.module, "ROBOTS", 3)
    command = [sys.executable, "-m", "webmap", "demo", "--robots", str(robots)]
    with subprocess.Popen(
        [*command, "--quiet", "--port", "0", "--no-browser"],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    ) as process:
        watchdog = threading.Timer(60, process.kill)
        watchdog.start()
        line = process.stdout.readline()
        watchdog.cancel()
        try:
            found = re.search(r"ready at (\S+)", line)
            assert found, line
            yield Demo(found[1], process, robots)
        finally:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(60)  # the machine may be busy
            except subprocess.TimeoutExpired:
                process.kill()


@pytest.fixture
def halt(demo: Demo) -> Iterator[psutil.Process]:
    """Halt the simulator's process while the test needs it."""
    children = psutil.Process(demo.process.pid).children(recursive=True)
    (simulator,) = [each for each in children if "sim" in each.cmdline()]
    yield simulator
    simulator.send_signal(signal.SIGCONT)


@pytest.fixture
def open_console(chromium: Browser, demo: Demo):
    """Open the console, and fail on errors and warnings of the browser.

    Messages that match ``open_console.allowed`` are not a failure.
    """
    contexts, complaints = [], Complaints()

    def open_(size: str = "desk", scheme: str = "light") -> Page:
        context = chromium.new_context(color_scheme=scheme, **SIZES[size])
        contexts.append(context)
        complaints.listen(context)
        page = context.new_page()
        page.goto(demo.url)
        # On a phone, the list is in the sheet, which is closed at first.
        expect(page.locator("#robots .row")).to_have_count(demo.robots)
        expect(page.locator(".robot:not(.unplaced)")).to_have_count(demo.robots)
        expect(page.locator("#link")).to_have_attribute("data-link", "open")
        wait_until_ready(page)
        return page

    open_.allowed = complaints.allowed
    yield open_
    for context in contexts:
        context.close()
    assert not complaints.unexpected, complaints.unexpected
