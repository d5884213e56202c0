"""The on-screen stick and gamepads, in a real Chromium, against a fake of the gate."""

import time

import pytest
from input_bench import INPUT_BLOCKERS, Bench
from playwright.sync_api import CDPSession, Locator

pytestmark = [pytest.mark.browser, pytest.mark.slow]

PADS = """
    window.pad = {
        index: 0, id: 'Pad', connected: true, mapping: 'standard', timestamp: 1,
        axes: [0, 0, 0, 0],
        buttons: Array.from({length: 17}, () => ({pressed: false})),
    };
    window.plugged = true;
    navigator.getGamepads = () => {
        if (window.alive) window.pad.timestamp += 1;
        return [window.plugged ? window.pad : null];
    };
    window.alive = true;
"""


class Finger:
    """Touches the page with touch events of the browser."""

    def __init__(self, bench: Bench) -> None:
        self._cdp: CDPSession = bench.context.new_cdp_session(bench.page)
        box = bench.page.locator(".webmap-stick").bounding_box()
        self.x, self.y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        self.size = box["width"]

    def touch(
        self, kind: str, right: float = 0, down: float = 0, too: Locator | None = None
    ) -> None:
        """Send a touch event, with the place in pad radii from the middle of the pad.

        With ``too``, a second finger touches another element.
        """
        x, y = self.x + right * self.size / 2, self.y + down * self.size / 2
        points = [{"x": x, "y": y, "id": 0}]
        if too is not None:
            box = too.bounding_box()
            x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
            points.append({"x": x, "y": y, "id": 1})
        if kind in ("touchEnd", "touchCancel"):
            points = []
        event = {"type": kind, "touchPoints": points}
        self._cdp.send("Input.dispatchTouchEvent", event)


@pytest.fixture
def touched(open_bench) -> Bench:
    bench = open_bench("?modules=drive/teleop,view/mouse_view_control", has_touch=True)
    bench.select("r1")
    bench.page.locator(".webmap-stick").wait_for()
    return bench


@pytest.fixture
def padded(open_bench) -> Bench:
    bench = open_bench()
    bench.page.evaluate(PADS)
    bench.select("r1")
    bench.page.wait_for_timeout(150)
    return bench


def drive_by_finger(bench: Bench) -> Finger:
    finger = Finger(bench)
    for _ in range(5):
        finger.touch("touchStart")
        finger.touch("touchMove", down=-0.9)
        try:
            bench.until(bench.gate.moves, patience=1.5)
        except AssertionError:
            finger.touch("touchEnd")
            bench.page.wait_for_timeout(300)
        else:
            return finger
    raise AssertionError("the robot was never driven")


def hold(bench: Bench, held: bool, *axes: float) -> None:
    bench.page.evaluate(
        "([held, axes]) => { pad.buttons[4] = {pressed: held}; pad.axes = axes; }",
        [held, [*axes, 0, 0]],
    )


def drive_by_pad(bench: Bench) -> None:
    since = time.monotonic()
    for _ in range(5):
        hold(bench, True, 0, -1)
        try:
            bench.until(lambda: bench.gate.moves(since), patience=1.5)
        except AssertionError:
            hold(bench, False, 0, -1)
            bench.page.wait_for_timeout(300)
        else:
            return
    raise AssertionError("the robot was never driven")


@pytest.mark.serial  # a delayed page stops driving
def test_a_touch_on_the_stick_drives_and_its_release_is_neutral(touched: Bench) -> None:
    finger = drive_by_finger(touched)
    touched.until(lambda: touched.gate.moves()[-1]["x"] == 1)
    assert finger.size >= 120
    since = time.monotonic()
    finger.touch("touchMove", right=-0.9)
    touched.until(lambda: touched.gate.moves(since)[-1:] != [])
    touched.until(lambda: touched.gate.moves(since)[-1]["turn"] == 1)
    assert touched.gate.moves(since)[-1]["x"] == 0
    touched.page.evaluate(
        "addEventListener('pointerup', () => bench.mark(), {capture: true})"
    )
    finger.touch("touchEnd")
    touched.neutral_within(50)
    touched.still()
    assert touched.view()["e"] == 400, "the map did not move with the stick"


@pytest.mark.serial  # a delayed page stops driving
def test_a_layout_change_that_moves_the_stick_does_not_change_the_command(
    touched: Bench,
) -> None:
    finger = drive_by_finger(touched)
    finger.touch("touchMove", down=-0.4)
    touched.until(lambda: 0 < touched.gate.moves()[-1]["x"] < 1)
    before = touched.gate.moves()[-1]
    touched.page.evaluate(
        "document.querySelector('.webmap-stick-place').style.marginBottom = '60px'"
    )
    since = time.monotonic()
    finger.touch("touchMove", down=-0.401)
    touched.until(lambda: len(touched.gate.moves(since)) > 2)
    after = touched.gate.moves(since)[-1]
    assert after["x"] == pytest.approx(before["x"], abs=0.02)


def test_a_touch_cancelled_by_the_system_is_neutral(touched: Bench) -> None:
    finger = drive_by_finger(touched)
    touched.page.evaluate(
        "addEventListener('pointercancel', () => bench.mark(), {capture: true})"
    )
    finger.touch("touchCancel")
    touched.neutral_within(50)
    touched.still()


def test_releasing_the_pointer_capture_of_the_stick_is_neutral(touched: Bench) -> None:
    finger = drive_by_finger(touched)
    touched.page.evaluate(
        """bench.mark(() => {
            const pad = document.querySelector('.webmap-stick');
            for (let id = 0; id < 100; id++) {
                if (pad.hasPointerCapture(id)) pad.releasePointerCapture(id);
            }
        })"""
    )
    touched.neutral_within(50)
    finger.touch("touchMove", down=-0.8)
    touched.still()


def test_a_lostpointercapture_event_of_the_stick_is_neutral_at_once(
    touched: Bench,
) -> None:
    drive_by_finger(touched)
    held = touched.page.evaluate(
        """() => {
            const pad = document.querySelector('.webmap-stick');
            const ids = Array.from({length: 100}, (_, id) => id);
            const pointerId = ids.find((id) => pad.hasPointerCapture(id));
            const pressed = () => [bench.drive.status.pressed,
                                   pad.classList.contains('held')];
            const before = pressed();
            // Of another pointer it is no news.
            const lost = (id) => pad.dispatchEvent(
                new PointerEvent('lostpointercapture', {pointerId: id}));
            lost(pointerId + 1);
            const other = pressed();
            lost(pointerId);
            return [before, other, pressed()];
        }"""
    )
    assert held == [[True, True], [True, True], [False, False]]
    touched.still(tolerance=0.05)


@pytest.mark.parametrize("blocker", ["blur", "hidden", "lost focus"])
def test_a_finger_kept_on_the_stick_moves_nothing_after_an_input_block(
    touched: Bench, blocker: str
) -> None:
    finger = drive_by_finger(touched)
    touched.page.evaluate(f"bench.mark(() => {{ {INPUT_BLOCKERS[blocker]} }})")
    touched.neutral_within(50)
    touched.page.wait_for_timeout(250)
    finger.touch("touchMove", down=-0.8)
    touched.still()


@pytest.mark.parametrize(
    ("name", "robot"), [("STOP ALL", "*"), ("STOP Robot r1", "r1")]
)
def test_a_second_finger_can_press_stop_while_the_first_holds_the_stick(
    open_bench, name: str, robot: str
) -> None:
    bench = open_bench("?modules=stop/stop_button,drive/teleop", has_touch=True)
    bench.gate.latching = True
    bench.select("r1")
    bench.page.locator(".webmap-stick").wait_for()
    finger = drive_by_finger(bench)
    stop = bench.page.get_by_role("button", name=name)
    finger.touch("touchStart", down=-0.9, too=stop)
    stop_commands = [{"op": "stop", "robot": robot}]
    bench.until(lambda: bench.gate.of("stop") == stop_commands)
    bench.until(lambda: bench.shown() == "stopped")
    bench.still()
    finger.touch("touchEnd")
    bench.still(0.3)
    assert bench.gate.of("stop") == stop_commands


def test_a_tap_on_stop_sends_one_stop(open_bench) -> None:
    bench = open_bench("?modules=stop/stop_button,drive/teleop", has_touch=True)
    bench.page.get_by_role("button", name="STOP ALL").tap()
    bench.page.wait_for_timeout(500)
    assert bench.gate.of("stop") == [{"op": "stop", "robot": "*"}]


def test_a_button_shows_and_hides_the_stick_on_a_page_with_a_mouse(open_bench) -> None:
    bench = open_bench("?holonomic")
    bench.select("r1")
    stick = bench.page.locator(".webmap-stick")
    bench.until(lambda: not stick.is_visible())
    bench.page.get_by_role("button", name="Stick", exact=True).click()
    box = stick.bounding_box()
    bench.page.get_by_role("button", name="Sideways").click()
    bench.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    bench.page.mouse.down()
    bench.page.mouse.move(box["x"] - 300, box["y"] + box["height"] / 2)
    bench.until(bench.gate.moves)
    last = bench.gate.moves()[-1]
    assert (last["x"], last["y"], last["turn"]) == (0, 1, 0)
    bench.page.mouse.up()
    bench.still(tolerance=0.05)
    bench.page.get_by_role("button", name="Stick", exact=True).click()
    assert not stick.is_visible()


def test_releasing_the_left_button_releases_the_stick_while_another_is_held(
    open_bench,
) -> None:
    bench = open_bench()
    mouse = bench.page.mouse
    bench.select("r1")
    bench.page.get_by_role("button", name="Stick", exact=True).click()
    box = bench.page.locator(".webmap-stick").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    mouse.move(x, y)
    mouse.down()
    mouse.move(x, y - 30)
    bench.until(bench.gate.moves)
    mouse.down(button="middle")
    mouse.up()
    bench.until(lambda: not bench.page.evaluate("bench.drive.status.pressed"))
    mouse.move(x, y - 40)
    bench.still()
    mouse.up(button="middle")


def test_q_moves_only_a_robot_with_a_holonomic_base_sideways(open_bench) -> None:
    bench = open_bench("?holonomic=each")
    keyboard = bench.page.keyboard
    bench.select("r1")
    bench.hold("q", bench.gate.moves)
    keyboard.up("q")
    last = bench.gate.moves()[-1]
    assert (last["robot"], last["x"], last["y"]) == ("r1", 0, 1)
    bench.select("r2")
    since = time.monotonic()
    keyboard.down("q")
    bench.hold("w", lambda: [m for m in bench.gate.moves(since) if m["robot"] == "r2"])
    keyboard.up("w")
    keyboard.up("q")
    assert not any(m["y"] for m in bench.gate.moves(since) if m["robot"] == "r2")


def test_keys_are_ignored_while_the_stick_drives(touched: Bench) -> None:
    finger = drive_by_finger(touched)
    since = time.monotonic()
    touched.page.keyboard.down("s")
    touched.until(lambda: len(touched.gate.moves(since)) > 4)
    assert {command["x"] for command in touched.gate.moves(since)} == {1}
    finger.touch("touchEnd")
    touched.still(tolerance=0.05)


def test_a_gamepad_drives_while_its_dead_man_button_is_held(padded: Bench) -> None:
    hold(padded, False, 0, -1)
    padded.still(0.3)
    drive_by_pad(padded)
    assert padded.gate.moves()[-1]["x"] == 1
    hold(padded, False, 0, -1)
    padded.still(tolerance=0.1)


GONE = {
    "unplugged": "plugged = false",
    "reported gone": "dispatchEvent(new Event('gamepaddisconnected'))",
    "marked gone": "pad.connected = false",
}


@pytest.mark.parametrize("how", GONE)
def test_a_disconnected_gamepad_is_neutral_and_its_reconnection_moves_nothing(
    padded: Bench, how: str
) -> None:
    drive_by_pad(padded)
    padded.page.evaluate(f"{{ {GONE[how]} }}")
    padded.still(0.3, tolerance=0.1)
    padded.page.evaluate("plugged = true; pad.connected = true;")
    padded.still()
    assert padded.shown() == "hands-off"
    hold(padded, False, 0, 0)
    padded.page.wait_for_timeout(300)
    drive_by_pad(padded)


def test_a_gamepad_whose_timestamp_does_not_change_is_neutral(padded: Bench) -> None:
    drive_by_pad(padded)
    padded.page.evaluate("alive = false")
    padded.until(lambda: padded.shown() == "hands-off")
    padded.still(tolerance=0.1)
    padded.page.evaluate("alive = true")
    padded.still()


def test_a_held_dead_man_button_moves_nothing_after_the_page_loses_focus(
    padded: Bench,
) -> None:
    drive_by_pad(padded)
    padded.page.evaluate(f"{{ {INPUT_BLOCKERS['blur']} }}")
    padded.still(tolerance=0.1)
