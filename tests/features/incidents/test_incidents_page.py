"""The button on the card keeps a recording that has what happened before."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import expect

from equipment.chromium import watched_tab
from equipment.webmap_process import page_of, simulator
from webmap.bags.marks import find_marks
from webmap.bags.recording import Recording

pytestmark = pytest.mark.browser

SITE = Path(__file__).with_name("incidents_site.py")


def test_the_button_keeps_the_last_minutes_with_the_stop_in_them(chromium, tmp_path):
    with (
        simulator("--robots", "1") as bridge,
        page_of(SITE, BRIDGE=bridge, WEBMAP_STATE_DIR=str(tmp_path)) as url,
        watched_tab(chromium, 1280, 800) as page,
    ):
        page.goto(url)
        page.locator("#robots .row button").first.click()
        expect(page.locator("#card h2")).to_have_text("Bob")
        page.get_by_role("button", name="STOP ALL").click()
        expect(page.locator("#card .state")).to_contain_text("STOP active")
        page.locator("#card .more > summary").click()
        page.get_by_role("button", name="Keep the last minutes").click()
        kept = page.get_by_role("region", name="Recording").get_by_role("status")
        expect(kept).to_contain_text(
            re.compile(r"Kept: \S+-asked\.mcap"), timeout=90_000
        )
    (file,) = (tmp_path / "recordings").glob("incident-*-asked.mcap")
    found = []
    find_marks([file], found.append)
    kinds = [mark.kind for mark in found[-1].marks]
    assert kinds == ["stop", "alarm"]
    recording = Recording([file])
    assert {"/bob/odom", "/bob/scan", "/tf_static"} <= recording.topics.keys()
    recording.close()
