"""The notice of a gamepad on the console, and the way to its settings."""

import pytest
from playwright.sync_api import expect

pytestmark = [pytest.mark.browser]

PAD = """() => {
    const buttons = Array.from({length: 17}, () => ({pressed: false}));
    const pad = {
        index: 0, id: 'Pad One (STANDARD GAMEPAD Vendor: 1 Product: 2)', timestamp: 1,
        connected: true, mapping: 'standard', axes: [0, 0, 0, 0], buttons,
    };
    navigator.getGamepads = () => [pad];
}"""


def test_a_notice_names_a_gamepad_and_its_buttons_and_opens_its_settings(open_console):
    page = open_console()
    page.evaluate(PAD)
    notice = page.locator(".webmap-notice", has_text="Gamepad connected: Pad One")
    expect(notice).to_contain_text("Hold LB and move the left stick to drive.")
    expect(notice).to_contain_text("B is STOP.")
    notice.get_by_role("button", name="Gamepad settings").click()
    settings = page.get_by_role("dialog", name="Gamepad settings")
    expect(settings).to_be_visible()
    expect(notice).to_be_hidden()
    for stop in (page.locator(".webmap-teleop-stop"), page.locator(".webmap-stop-all")):
        box = stop.bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        at = "([x, y]) => document.elementFromPoint(x, y)?.closest('button')?.className"
        assert page.evaluate(at, [x, y]) == stop.get_attribute("class")
    page.keyboard.press("Escape")
    expect(settings).to_be_hidden()
    page.keyboard.press("Control+k")
    page.keyboard.type("gamepad")
    page.keyboard.press("Enter")
    expect(settings).to_be_visible()
