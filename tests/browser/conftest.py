"""Real Chromium on real pages of real processes."""

import os
import re
import select
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

EXAMPLES = Path(__file__).parents[2] / "examples"

CHROMIUM_ARGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]

expect.set_options(timeout=10_000)


class Process:
    """A command of ours that runs until the test has seen enough."""

    def __init__(self, *command: object, cwd: Path | None = None) -> None:
        self.popen = subprocess.Popen(
            [sys.executable, "-m", "webmap", *map(str, command)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            cwd=cwd,
            start_new_session=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1"},
        )
        os.set_blocking(self.popen.stderr.fileno(), False)
        self._log = b""

    def ready(self, pattern: str, within: float = 30.0) -> str:
        """Wait for the line that says it is ready; return the URL in it."""
        stdout = self.popen.stdout
        deadline = time.monotonic() + within
        said = b""
        while time.monotonic() < deadline:
            if not select.select([stdout], [], [], 0.1)[0]:
                continue
            chunk = os.read(stdout.fileno(), 4096)
            said += chunk
            match = re.search(pattern, said.decode())
            if match:
                return match[1]
            if not chunk:
                break
        raise AssertionError(f"not ready: {said!r}\n{self.log}")

    @property
    def log(self) -> str:
        """What it wrote to standard error so far."""
        while chunk := self.popen.stderr.read():
            self._log += chunk
        return self._log.decode(errors="replace")

    def end(self, sig: int = signal.SIGINT) -> int:
        """End it as a person would; return its exit code."""
        if self.popen.poll() is None:
            self.popen.send_signal(sig)
        try:
            code = self.popen.wait(10)
        except subprocess.TimeoutExpired:
            self.popen.kill()
            self.popen.wait()
            raise
        finally:
            self.log  # noqa: B018 - what was left in the pipe
            self.popen.stdout.close()
            self.popen.stderr.close()
        return code


@contextmanager
def running(*command: object, pattern: str, cwd: Path | None = None) -> Iterator:
    process = Process(*command, cwd=cwd)
    try:
        process.url = process.ready(pattern)
        yield process
    finally:
        if process.popen.stdout.closed is False:
            process.end()
        print(process.log)


WEB = r"WebMap is ready at (\S+)\n"
BRIDGE = r"rosbridge is ready at (\S+)\n"


@pytest.fixture(scope="session")
def chromium() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=CHROMIUM_ARGS
        )
        yield browser
        browser.close()


@pytest.fixture
def tab(chromium: Browser) -> Iterator[Page]:
    """A page that fails the test on any error, warning or violation in it."""
    context = chromium.new_context(viewport={"width": 1200, "height": 800})
    page = context.new_page()
    said: list[str] = []
    page.on("pageerror", lambda error: said.append(f"exception: {error}"))
    page.on(
        "console",
        lambda message: message.type in {"error", "warning"}
        and said.append(f"{message.type}: {message.text}"),
    )
    page.allowed = []
    yield page
    context.close()
    unexpected = [
        line for line in said if not any(re.search(ok, line) for ok in page.allowed)
    ]
    assert unexpected == []


def matrix(tab: Page, selector: str) -> list[float]:
    """Return the matrix of an element's own place, as the browser draws it."""
    return tab.locator(selector).first.evaluate(
        "e => { const m = e.transform.baseVal.consolidate().matrix;"
        " return [m.a, m.b, m.c, m.d, m.e, m.f]; }"
    )


def wait_until(condition, within: float = 10.0, what: str = "it") -> None:
    """Poll a condition until it holds."""
    deadline = time.monotonic() + within
    while time.monotonic() < deadline:
        value = condition()
        if value:
            return value
        time.sleep(0.05)
    raise AssertionError(f"{what} did not happen within {within} s")
