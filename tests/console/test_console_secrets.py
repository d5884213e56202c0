"""After a whole run, a token or a password is nowhere where it could be read later."""

import os
import re
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest
from console_ready import select, wait_until_ready
from playwright.sync_api import expect

from equipment.chromium import watched_tab
from equipment.processes import WEB, Process

pytestmark = pytest.mark.browser

PASSWORD = "correct horse battery"

OPTIONS = ("demo", "-n", "1", "--quiet", "--port", "0", "--no-browser")


@contextmanager
def demo(state):
    """Run a demo with a folder for state, a home and a folder for temporary files."""
    folders = {name: state / name.lower() for name in ("HOME", "TMPDIR")}
    for folder in folders.values():
        folder.mkdir(parents=True)
    environment = {name: str(folder) for name, folder in folders.items()}
    process = Process(*OPTIONS, WEBMAP_STATE_DIR=str(state / "kept"), **environment)
    try:
        yield process, process.ready(WEB)
    finally:
        process.end()


class Seen:
    """What a page, its browser and the processes show of a run."""

    def __init__(self, page):
        self.page = page
        self.codes, self.texts = set(), {}
        page.on("request", self._on_request)

    def _on_request(self, request):
        self.codes |= set(re.findall(r"webmap_code=([\w-]+)", request.url))
        self._note("referer", request.headers.get("referer", ""))
        if request.resource_type != "document":
            self._note("address of a request", request.url)

    def _note(self, what, text):
        self.texts.setdefault(what, set()).add(text)

    def look(self):
        """Note what can be read now."""
        page = self.page
        self._note("address", page.url)
        self._note("title", page.title())
        self._note("referrer", page.evaluate("document.referrer"))
        self._note("text", page.evaluate("document.documentElement.innerText"))
        kept = "JSON.stringify([localStorage, sessionStorage])"
        self._note("storage", page.evaluate(kept))
        session = page.context.new_cdp_session(page)
        for entry in session.send("Page.getNavigationHistory")["entries"]:
            self._note("history", f"{entry['url']} {entry['title']}")
        for process in psutil.Process().children(recursive=True):
            try:
                self._note("process list", " ".join(process.cmdline()))
            except psutil.Error:
                continue

    def places(self, secret):
        """Return where a secret was seen."""
        return {what for what, texts in self.texts.items() if secret in " ".join(texts)}


def files_with(folder, secret):
    """Return the files below a folder that contain a secret."""
    return [
        file
        for file in Path(folder).rglob("*")
        if file.is_file() and secret.encode() in file.read_bytes()
    ]


def drive(page, seen):
    """Take control, drive, stop, and look at each step."""
    wait_until_ready(page)
    seen.look()
    select(page, "Robot 0")
    page.get_by_role("button", name="Take control of Robot 0").click()
    expect(page.locator(".webmap-teleop-title")).to_have_text("You have control")
    page.keyboard.down("w")
    page.wait_for_timeout(300)
    seen.look()
    page.keyboard.up("w")
    page.keyboard.press("Space")
    expect(page.locator(".webmap-reset").first).to_be_visible()
    seen.look()


def test_the_token_of_the_link_is_nowhere_after_a_run(chromium, tmp_path):
    with watched_tab(chromium, 1280, 800) as page, demo(tmp_path) as (process, url):
        page.allowed += ["WebSocket", "ERR_CONNECTION"]
        token = url.partition("token=")[2]
        assert len(token) >= 43
        seen = Seen(page)
        page.goto(url)
        drive(page, seen)
        page.reload()
        wait_until_ready(page)
        seen.look()
        (cookie,) = page.context.cookies()
        process.end()
        assert seen.codes
        for secret in (token, *seen.codes, cookie["value"]):
            assert seen.places(secret) == set()
            assert secret not in process.log
            assert files_with(tmp_path, secret) == []
        key = page.evaluate("Object.values(localStorage)[0]")
        assert seen.places(key) == {"storage"}  # of this origin, as documented
        assert key not in process.log
        assert files_with(tmp_path, key) == []


def test_a_password_is_nowhere_after_a_run(chromium, tmp_path):
    subprocess.run(
        [sys.executable, "-m", "webmap", "user", "add", "ana", "--password-stdin"],
        input=f"{PASSWORD}\n",
        text=True,
        check=True,
        env={**os.environ, "WEBMAP_STATE_DIR": str(tmp_path / "kept")},
    )
    with watched_tab(chromium, 1280, 800) as page, demo(tmp_path) as (process, url):
        page.allowed += [r"\b401\b", "WebSocket", "ERR_CONNECTION"]
        seen = Seen(page)
        page.goto(url)
        page.get_by_label("Name", exact=True).fill("ana")
        page.get_by_label("Password").fill(f"{PASSWORD}x")
        page.get_by_role("button", name="Sign in").click()
        expect(page.get_by_role("status")).to_contain_text("rong")
        page.get_by_label("Name", exact=True).fill("ana")
        page.get_by_label("Password").fill(PASSWORD)
        page.get_by_role("button", name="Sign in").click()
        drive(page, seen)
        (cookie,) = page.context.cookies()
        page.locator("#operator summary").click()
        page.get_by_role("button", name="Sign out").click()
        expect(page.get_by_label("Password")).to_be_visible()
        seen.look()
        process.end()
        assert seen.codes
        session = cookie["value"].partition(".")[0]
        for secret in (PASSWORD, cookie["value"], session, *seen.codes):
            # The key of a page begins with its session, which has ended.
            places = {"storage"} if secret == session else set()
            assert seen.places(secret) == places
            assert secret not in process.log
            assert files_with(tmp_path, secret) == []
