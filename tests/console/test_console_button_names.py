"""The buttons that the documentation names are on the page in use, with that name."""

import re
import sys

import pytest
from console_ready import select

from equipment.doc_buttons import DOCS, PAGES, ROOT, bold, rows_below

sys.path.append(str(ROOT / "tools"))
from callouts import parts_of
from screenshots import BAR, REGIONS

pytestmark = [pytest.mark.browser]

NAMES = """() => [...document.querySelectorAll("button, summary, label")].flatMap(
  (button) => [button, ...button.querySelectorAll("*")].flatMap((part) => [
    part.getAttribute("aria-label"), part.textContent, part.firstChild?.textContent,
  ])).filter(Boolean).map((text) => text.trim())"""
"""The names of all buttons, also of those whose panel is folded."""

NOT_AT_REST = {
    "Acknowledge": "of an alert",
    "Change": "of the settings of a gamepad",
    "Dead zone": "of the settings of a gamepad",
    "Hand over": "of a request for control",
    "Keep control": "of a request for control",
    "Move": "of a label",
    "Name?": "of a page whose operator has no name yet",
    "Pause": "of a route that runs",
    "Release control": "of a robot that this page has",
    "Remove from the wall": "of a camera on the wall of cameras",
    "Request control": "of a robot that another operator has",
    "Reset all": "of a STOP of several robots",
    "Selected robot": "of a map with several robots that have layers",
    "All robots": "of a map with several robots that have layers",
    "Restore defaults": "of the settings of a gamepad",
    "Robots": "of a phone on its side",
    "Send goal here": "of a label",
    "…": "of a bar without room for all tools",
}
"""Buttons that another state of the page shows: tests/project looks in the code."""

STATES = {"STOP NOT CONFIRMED", "STOP active"}
"""Bold texts of the manual that are states."""


def test_each_button_that_the_documentation_names_is_on_the_page_in_use(open_console):
    page = open_console()
    select(page, "Robot 1")
    named = {name for file in PAGES for _, name in bold(file)}
    page.locator(".webmap-teleop-lease").wait_for()
    missing = named - set(page.evaluate(NAMES)) - set(NOT_AT_REST) - STATES
    assert missing == set()
    assert set(NOT_AT_REST) <= named, "what the documentation names no more"


FIRST = DOCS / "manual" / "first-ten-minutes.md"


def numbered(line: str) -> list[tuple[int, str]]:
    """Return the numbers and names of the table after a line of the first page."""
    return [(int(row[0]), row[1]) for row in rows_below(FIRST, line)]


def test_the_manual_numbers_the_parts_of_the_page_as_its_picture_does():
    names = [name.replace("The ", "the ") for name in REGIONS.values()]
    assert numbered("## 3. Know the parts of the page") == [*enumerate(names, 1)]


def test_the_manual_numbers_the_buttons_of_the_bar_as_its_picture_does(open_console):
    page = open_console()
    select(page, "Robot 1")
    page.set_viewport_size({"width": 1440, "height": 900})  # as in the picture
    page.locator('.webmap-teleop-stop[data-robot="Robot 1"]').wait_for()
    page.locator("#link[data-link=open]").wait_for()
    # The robots of other tests of this file may have alerts.
    names = [
        re.sub(r"^Alerts \d+$", "Alerts", part.name) for part in parts_of(page, BAR)
    ]
    assert numbered("(the-bar)=") == [*enumerate(names, 1)]
