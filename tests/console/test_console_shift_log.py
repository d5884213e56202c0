"""The shift log in a real browser: notes, filters, CSV, hand-over, roles, secrets."""

import csv
import re

import pytest
from console_ready import wait_until_ready
from playwright.sync_api import expect
from test_console_sign_in import PASSWORD, sign_in, user

from equipment.chromium import watched_tab
from equipment.webmap_process import webmap

pytestmark = pytest.mark.browser

SECRETS = """() => [
  ...Object.values(localStorage), ...Object.values(sessionStorage), document.cookie,
]"""


@pytest.fixture(scope="module")
def state(tmp_path_factory):
    """The state folder of a demo that has ended after the browser's visit."""
    state = tmp_path_factory.mktemp("state")
    user(state, "add", "ana", "--password-stdin")
    user(state, "add", "eve", "--role", "viewer", "--password-stdin")
    return state


def open_log(page):
    page.locator(".webmap-shift > summary").click()
    return page.locator(".webmap-shift-entry")


def test_the_shift_log_of_an_operator_and_of_a_viewer(state, chromium):
    options = ("demo", "-n", "2", "--quiet", "--port", "0", "--no-browser")
    secrets = [PASSWORD]
    with webmap(*options, WEBMAP_STATE_DIR=str(state)) as url:
        with watched_tab(chromium, 1440, 900) as page:
            page.allowed += [r"\b401\b"]
            page.goto(url)
            page.get_by_label("Name", exact=True).fill(PASSWORD)  # the wrong field
            page.get_by_label("Password").fill("ana")
            page.get_by_role("button", name="Sign in").click()
            expect(
                page.get_by_text("The name or the password is wrong")
            ).to_be_visible()
            sign_in(page, "ana")
            entries = open_log(page)
            expect(entries.first).to_contain_text("WebMap started")

            page.get_by_role("textbox", name="Note").fill("=1+1 <b>door</b> blocked")
            page.get_by_role("button", name="Add note").click()
            note = entries.filter(has_text="ana: =1+1 <b>door</b> blocked")
            expect(note).to_have_count(1)
            expect(page.get_by_role("textbox", name="Note")).to_have_value("")
            page.locator(".webmap-stop-all:visible").first.click()
            pressed = entries.filter(has_text="ana: pressed STOP")
            expect(pressed).to_have_count(2)

            kind, robot = (
                page.get_by_label("Kind"),
                page.get_by_label("Robot", exact=True),
            )
            options = kind.locator("option").all_inner_texts()
            assert "Note" in options
            assert not {"Sign-in", "Failed sign-in", "Refused"} & {*options}
            kind.select_option("note")
            expect(entries).to_have_count(1)
            kind.select_option("stop")
            expect(note).to_have_count(0)
            robot.select_option(label="Robot 0")
            expect(pressed).to_have_count(1)
            with page.expect_download() as download:
                page.get_by_role("button", name="CSV").click()
            with open(download.value.path(), newline="") as file:
                rows = [*csv.DictReader(file)]
            assert {(row["kind"], row["robot"]) for row in rows} == {
                ("stop", "Robot 0")
            }
            assert rows[0]["person"] == "ana"
            kind.select_option("all")
            robot.select_option("")
            with page.expect_download() as download:
                page.get_by_role("button", name="CSV").click()
            text = download.value.path().read_text()
            assert "'=1+1" in text
            assert "sign-in" not in text

            with page.context.expect_page() as opened:
                page.get_by_role("button", name="Hand over the shift").click()
            sheet = opened.value.locator("#sheet")
            expect(sheet).to_contain_text("Stops (2)")
            expect(sheet).to_contain_text("=1+1 <b>door</b> blocked")
            expect(sheet).to_contain_text("STOP active, pressed by ana")
            expect(sheet).to_contain_text(re.compile("Robot 1.*100 %"))
            opened.value.get_by_label("Period").select_option("all")
            expect(sheet).to_contain_text("Stops (2)")
            expect(entries.filter(has_text="ana: handed over the shift")).to_have_count(
                1
            )
            secrets += page.evaluate(SECRETS)
            secrets += [each["value"] for each in page.context.cookies()]
        with watched_tab(chromium, 1440, 900) as page:
            page.allowed += [r"\b401\b"]
            page.goto(url)
            sign_in(page, "eve")
            wait_until_ready(page)
            entries = open_log(page)
            expect(entries.filter(has_text="ana: pressed STOP")).to_have_count(2)
            expect(page.get_by_role("button", name="Add note")).to_have_count(0)
    lines = [
        line
        for file in (state / "shift-log").iterdir()
        for line in file.read_text().splitlines()
    ]
    kinds = [re.search('"kind":"([^"]*)"', line)[1] for line in lines]
    assert kinds.count("sign-in-failed") == 1
    assert {"webmap", "sign-in", "page", "note", "stop", "shift"} <= {*kinds}
    assert '"text":"WebMap ended"' in lines[-1]
    found = [each for each in secrets if len(each) > 5 and each in "\n".join(lines)]
    assert found == []
