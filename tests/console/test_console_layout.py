"""The layout of the console: saved, loaded, reset and restored."""

import json
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

pytestmark = pytest.mark.browser

FILE = "webmap-layout.json"

LISTEN = """() => {
  window.sent = [];
  const { send } = WebSocket.prototype;
  WebSocket.prototype.send = function (data) {
    window.sent.push([new URL(this.url).pathname.split("/").at(-1), String(data)]);
    return send.call(this, data);
  };
}"""
"""Records the messages of the page to the display and the gate from now on."""


def view_of(page: Page) -> list[float]:
    """Return the matrix from metres to pixels of the map."""
    return page.locator("g.world").evaluate(
        "g => (({a, b, c, d, e, f}) => [a, b, c, d, e, f])(g.getCTM())"
    )


def expect_view(page: Page, view: list[float]) -> None:
    page.wait_for_function(
        """(view) => {
          const now = document.querySelector("g.world")?.getCTM();
          const near = (key, i) => Math.abs(now[key] - view[i]) < 0.01;
          return now && [..."abcdef"].every(near);
        }""",
        arg=view,
    )


def menu(page: Page) -> None:
    """Open the menu with the keyboard."""
    page.wait_for_selector(".webmap-layout-save", state="attached")
    page.locator(".webmap-export-go").focus()
    page.keyboard.press("Enter")
    expect(page.locator(".webmap-layout-save")).to_be_visible()


def load(page: Page, file: Path) -> None:
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Load", exact=True).press("Enter")
    chooser.value.set_files(file)


def assert_no_command_was_sent(page: Page) -> None:
    """Check that the page sent only messages about its view and neutral commands."""
    sent = [(lane, json.loads(text)) for lane, text in page.evaluate("window.sent")]
    drive = [command for lane, command in sent if lane == "drive"]
    scene = [message for lane, message in sent if lane == "scene"]
    for command in drive:
        assert command.get("op", "drive") == "drive", command
        assert not any(command.get(axis) for axis in ("x", "y", "turn")), command
    assert {message["op"] for message in scene} <= {"seen", "unseen", "view", "module"}
    received = [message["data"] for message in scene if message["op"] == "module"]
    assert {"found": True} in received
    assert {key for data in received for key in data} <= {"found", "open"}, received


def test_a_layout_is_saved_reset_and_loaded_and_the_last_view_is_restored(
    open_console, tmp_path
):
    page = open_console()
    found = view_of(page)
    row = page.locator("#robots .row", has_text="Robot 2").locator("button").first
    row.click()
    page.get_by_role("button", name="Take control of Robot 2").click()
    expect(page.locator("#card .state .you")).to_have_text("You have control")
    page.locator(".webmap-layers > summary").click()
    page.get_by_label("Scans", exact=True).uncheck()
    page.locator("svg.webmap").focus()
    for key in ("+", "+", "]"):
        page.keyboard.press(key)
    log = page.locator(".webmap-rosout")
    log.evaluate("e => { e.open = true; }")
    page.wait_for_timeout(300)  # the open log makes the map narrower
    left = view_of(page)
    assert left != found

    menu(page)
    with page.expect_download() as download:
        page.get_by_role("button", name="Save", exact=True).press("Enter")
    assert download.value.suggested_filename == FILE
    download.value.save_as(tmp_path / FILE)
    saved = json.loads((tmp_path / FILE).read_text())
    parts = {"version", "view", "panel", "list", "layers", "log", "camera"}
    assert set(saved) == parts
    assert saved["layers"]["shown"]["Scans"] is False

    # From here on, only the layout may change the page.
    page.evaluate(LISTEN)
    message = page.locator(".webmap-layout-word")
    page.get_by_role("button", name="Reset layout").press("Enter")
    expect(message).to_have_text("The layout is reset.")
    expect_view(page, found)
    expect(page.locator(".webmap-layers")).not_to_have_attribute("open", "")
    expect(log).not_to_have_attribute("open", "")
    expect(page.locator(".laserscan").first).to_be_visible()

    wrong = tmp_path / "wrong.json"
    wrong.write_text(json.dumps({**saved, "log": {"open": True, "least": "loud"}}))
    load(page, wrong)
    expect(message).to_contain_text('log.least: expected "debug", ')
    expect(message).to_contain_text('got "loud". Nothing was changed.')
    wrong.write_text(" " * 66_000)
    load(page, wrong)
    expect(message).to_contain_text("expected at most 64 kB, got 65 kB")
    expect_view(page, found)
    expect(page.locator(".laserscan").first).to_be_visible()

    load(page, tmp_path / FILE)
    expect(message).to_have_text(f"Loaded {FILE}. No command was sent to a robot.")
    expect_view(page, left)
    expect(page.locator(".laserscan").first).to_be_hidden()
    expect(log).to_have_attribute("open", "")
    page.locator(".webmap-layers").evaluate("e => { e.open = true; }")
    expect(page.get_by_label("Scans", exact=True)).not_to_be_checked()
    expect(page.locator(".robot.selected")).to_have_attribute("data-name", "Robot 2")
    assert_no_command_was_sent(page)

    # A new page opens without a list in the dock, so that its map is wider.
    page.locator(".webmap-layers").evaluate("e => { e.open = false; }")
    page.wait_for_timeout(300)
    assert view_of(page) == pytest.approx(left, abs=0.01)
    context, url = page.context, page.url
    page.close()
    again = context.new_page()
    again.goto(url)
    expect_view(again, left)
    expect(again.locator(".robot.selected")).to_have_count(0)
    other = context.new_page()
    other.goto(f"{url}?layout=found")
    other.wait_for_selector(".webmap-layout-save", state="attached")
    expect_view(other, found)
