"""A page that is open while WebMap restarts shows the restart."""

from urllib.parse import urlsplit

import pytest
from playwright.sync_api import expect

from equipment.processes import WEB, running

pytestmark = pytest.mark.browser

SCRIPT = """
import webmap

@webmap.page("/")
def main(page):
    webmap.Map(page.element("webmap_container"))

webmap.run()
"""


def test_a_page_with_an_old_token_asks_the_user_to_open_the_new_address(tab, tmp_path):
    tab.allowed += ["WebSocket", "ERR_CONNECTION", "401", "403"]
    script = tmp_path / "page.py"
    script.write_text(SCRIPT)
    command = ("run", script, "--no-browser", "--port")
    status = tab.locator(".webmap-notice.status")
    with running(*command, 0, pattern=WEB) as first:
        tab.goto(first.url)
        tab.wait_for_selector("svg.webmap")
    expect(status).to_contain_text("No connection to WebMap")
    with running(*command, urlsplit(first.url).port, pattern=WEB) as second:
        expect(status).to_contain_text("Open the address that WebMap printed")
        tab.goto(second.url)
        expect(status).to_be_hidden()
