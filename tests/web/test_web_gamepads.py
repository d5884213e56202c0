"""The settings of gamepads, in a real Chromium, against a fake of the gate."""

import pytest
from input_bench import Bench
from playwright.sync_api import Locator, expect

pytestmark = [pytest.mark.browser, pytest.mark.slow]

PAD = """(mapping) => {
    window.pad = {
        index: 0, id: 'Pad', connected: true, mapping, axes: [0, 0, 0, 0],
        buttons: Array.from({length: 17}, () => ({pressed: false})),
        get timestamp() { return performance.now(); },
    };
    navigator.getGamepads = () => [window.pad];
}"""

STOP_ON_TOP = """(() => {
    const stop = document.querySelector('.webmap-teleop-stop');
    const { left, top, width, height } = stop.getBoundingClientRect();
    return document.elementFromPoint(left + width / 2, top + height / 2) === stop;
})()"""


def connect(bench: Bench, mapping: str = "standard") -> Locator:
    """Connect a gamepad, select a robot and return the settings of gamepads."""
    bench.page.evaluate(PAD, mapping)
    bench.select("r1")
    bench.page.get_by_role("button", name="Gamepad settings").click()
    return bench.page.get_by_role("dialog", name="Gamepad settings")


def press(bench: Bench, button: int) -> None:
    """Press a button and release it, each for several readings of the page."""
    for pressed in ("true", "false"):
        bench.page.evaluate(f"pad.buttons[{button}] = {{pressed: {pressed}}}, 0")
        bench.page.wait_for_timeout(150)


def push(bench: Bench, axis: int, value: float) -> None:
    """Push a stick, and let it go."""
    for now in (value, 0):
        bench.page.evaluate(f"pad.axes[{axis}] = {now}, 0")
        bench.page.wait_for_timeout(150)


def row(settings: Locator, action: str) -> Locator:
    return settings.locator("li", has_text=action)


def drive(bench: Bench, button: int, axis: int, value: float) -> dict:
    """Hold a button and push a stick until the robot moves; return the command."""
    for _ in range(5):
        bench.page.evaluate(
            f"pad.buttons[{button}] = {{pressed: false}}, pad.axes[{axis}] = 0"
        )
        bench.page.wait_for_timeout(300)
        bench.page.evaluate(
            f"pad.buttons[{button}] = {{pressed: true}}, pad.axes[{axis}] = {value}"
        )
        for _ in range(30):
            bench.page.wait_for_timeout(50)
            if bench.gate.moves():
                return bench.gate.moves()[-1]
    raise AssertionError("the robot was never driven")


def test_no_gamepad_drives_while_its_settings_are_open(open_bench) -> None:
    bench = open_bench()
    settings = connect(bench)
    bench.page.evaluate("pad.buttons[4] = {pressed: true}, pad.axes[1] = -1")
    expect(row(settings, "Forward, back")).to_contain_text("100 %")
    expect(row(settings, "Hold to drive")).to_contain_text("pressed")
    assert bench.page.evaluate(STOP_ON_TOP), "the settings cover STOP"
    bench.still(0.3)
    bench.page.keyboard.press("Escape")
    expect(settings).to_be_hidden()
    bench.still(0.3)
    assert drive(bench, 4, 1, -1)["x"] == 1


def test_stop_is_moved_to_another_button_and_is_never_without_one(open_bench) -> None:
    bench = open_bench()
    settings = connect(bench)
    stop, hold = row(settings, "STOP"), row(settings, "Hold to drive")
    stop.get_by_role("button", name="Change").click()
    press(bench, 2)
    expect(stop).to_contain_text("X")
    assert bench.gate.of("stop") == [], "the press that assigned it"
    hold.get_by_role("button", name="Change").click()
    press(bench, 2)
    expect(settings).to_be_hidden()
    bench.until(lambda: len(bench.gate.of("stop")) == 1)
    press(bench, 1)
    bench.page.reload()
    bench.page.wait_for_selector("body[data-ready=yes]")
    settings = connect(bench)
    expect(row(settings, "Hold to drive")).to_contain_text("LB")
    expect(row(settings, "STOP")).to_contain_text("X")
    press(bench, 2)
    bench.until(lambda: [s["robot"] for s in bench.gate.of("stop")] == ["r1", "r1"])


def test_a_gamepad_without_the_standard_layout_drives_when_it_is_assigned(
    open_bench,
) -> None:
    bench = open_bench()
    settings = connect(bench, "")
    change = {
        name: row(settings, name).get_by_role("button")
        for name in ("Forward, back", "Turn", "Hold to drive", "STOP")
    }
    change["Forward, back"].click()
    push(bench, 3, 1)
    expect(row(settings, "Forward, back")).to_contain_text("axis 4")
    change["Turn"].click()
    push(bench, 2, -1)
    expect(row(settings, "Turn")).to_contain_text("axis 3")
    change["Hold to drive"].click()
    press(bench, 6)
    expect(settings.get_by_role("status")).to_contain_text("no standard layout")
    change["STOP"].click()
    press(bench, 7)
    expect(settings.get_by_role("status")).to_contain_text("no input moves a robot")
    settings.get_by_role("button", name="Close").click()
    assert drive(bench, 6, 3, 1)["x"] == 1
    press(bench, 7)
    bench.until(lambda: bench.gate.of("stop"))
