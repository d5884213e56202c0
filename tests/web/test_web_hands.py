"""The inputs of an operator in a real Chromium, against a fake of the gate."""

import re
import time

import pytest
from fake_drive import FakeDrive
from input_bench import INPUT_BLOCKERS, Bench

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def test_holding_w_takes_control_and_drives_after_neutral_commands(
    bench: Bench,
) -> None:
    bench.drive()
    assert bench.gate.of("take") == [{"op": "take", "robot": "r1"}]
    drives = bench.gate.of("drive")
    first = next(i for i, command in enumerate(drives) if command["x"])
    assert first >= 4
    assert [command["seq"] for command in drives] == list(range(len(drives)))
    assert drives[-1]["x"] == 1
    bench.until(lambda: bench.shown() == "driving")


@pytest.mark.serial
def test_commands_are_sent_at_20_hz(bench: Bench) -> None:
    since = bench.drive()
    bench.page.wait_for_timeout(2000)
    assert 35 <= len(bench.gate.moves(since)) <= 45


def test_releasing_a_key_is_neutral_at_once_and_a_new_press_drives(
    bench: Bench,
) -> None:
    bench.drive()
    bench.page.keyboard.up("w")
    bench.neutral_within(50)
    bench.still()
    since = time.monotonic()
    bench.hold("a", lambda: bench.gate.moves(since))
    assert bench.gate.moves(since)[0]["turn"] == 1


@pytest.mark.parametrize("blocker", INPUT_BLOCKERS)
def test_an_input_block_is_neutral_within_50_ms_and_a_held_key_does_not_resume(
    bench: Bench, blocker: str
) -> None:
    bench.drive()
    bench.page.evaluate(f"bench.mark(() => {{ {INPUT_BLOCKERS[blocker]} }})")
    bench.neutral_within(50)
    bench.page.wait_for_timeout(250)
    # The keyboard repeats a held key, also after the rest time of the inputs.
    bench.page.keyboard.down("w")
    bench.still()


def test_a_key_held_since_before_the_selection_does_nothing_and_is_shown_as_blocked(
    bench: Bench,
) -> None:
    bench.page.keyboard.down("w")  # no robot is selected, so no key drives
    bench.select("r1")
    bench.until(lambda: bench.shown() == "free")
    bench.page.wait_for_timeout(250)
    # The keyboard repeats the key, and the page handles it for the first time.
    bench.page.keyboard.down("w")
    bench.until(lambda: bench.shown() == "hands-off")
    bench.still()
    bench.page.keyboard.up("w")
    bench.until(lambda: bench.shown() == "free")
    bench.hold("w", bench.gate.moves)


@pytest.mark.parametrize("key", ["Meta", "Control", "Alt"])
def test_a_modifier_key_blocks_the_input(bench: Bench, key: str) -> None:
    bench.drive()
    bench.page.keyboard.down(key)
    bench.neutral_within(50)
    bench.page.keyboard.up(key)
    bench.page.keyboard.down("w")
    bench.still()


def test_a_hidden_page_releases_control(bench: Bench) -> None:
    bench.drive()
    bench.page.evaluate(f"() => {{ {INPUT_BLOCKERS['hidden']} }}")
    bench.until(lambda: bench.gate.of("release") == [{"op": "release", "robot": "r1"}])


def test_a_gate_without_ticks_is_late_then_lost_and_a_held_key_moves_nothing(
    bench: Bench,
) -> None:
    bench.drive()
    takes = bench.gate.of("take")
    losses = bench.losses
    bench.gate.ticking = False
    # The loop is late for 200 ms and then lost; after a reconnection it is late again.
    bench.until(lambda: bench.shown() == "late")
    bench.still(0.1, tolerance=0.05)
    bench.until(lambda: bench.losses > losses)
    bench.gate.ticking = True
    bench.until(lambda: bench.state == "open")
    bench.page.keyboard.down("w")
    bench.still(1.0)
    assert bench.gate.of("take") == takes


def test_commands_without_acknowledgement_are_shown_as_late_and_stop_the_motion(
    bench: Bench,
) -> None:
    bench.drive()
    bench.gate.acking = False
    bench.until(lambda: bench.shown() == "late")
    bench.gate.acking = True
    bench.until(lambda: bench.state == "open")
    bench.still()


def test_a_held_key_moves_nothing_after_a_lost_connection_until_a_new_press(
    bench: Bench,
) -> None:
    bench.drive()
    bench.cut()
    bench.until(lambda: bench.state == "open")
    bench.still()
    bench.page.keyboard.up("w")
    bench.page.wait_for_timeout(300)
    bench.hold("w", lambda: len(bench.gate.of("take")) == 2)


def test_a_held_key_moves_nothing_after_a_gate_restart_until_a_new_press(
    bench: Bench,
) -> None:
    bench.drive()
    bench.gate.greet()
    bench.until(lambda: bench.page.evaluate("bench.drive.status.driven") is None)
    bench.still()
    bench.page.keyboard.up("w")
    bench.page.wait_for_timeout(300)
    since = time.monotonic()
    bench.hold("w", lambda: bench.gate.moves(since))
    assert len(bench.gate.of("take")) == 2
    assert bench.gate.of("drive", since)[0]["seq"] == 0


def test_selecting_another_robot_releases_the_old_one_and_does_not_move_the_new(
    bench: Bench,
) -> None:
    bench.drive()
    bench.select("r2")
    bench.until(lambda: bench.gate.of("release") == [{"op": "release", "robot": "r1"}])
    bench.page.keyboard.down("w")
    bench.still()
    bench.page.keyboard.up("w")
    bench.page.wait_for_timeout(300)
    bench.hold("w", lambda: bench.gate.moves()[-1]["robot"] == "r2")


def test_a_press_does_not_take_control_from_another_operator(bench: Bench) -> None:
    ann = {"connection": "c9", "name": "Ann"}
    bench.gate.change("r1", holder=ann, epoch=7, state="driving")
    bench.select("r1")
    bench.until(lambda: bench.shown() == "held")
    bench.page.keyboard.down("w")
    bench.page.wait_for_timeout(300)
    assert bench.gate.received == []
    assert "Ann is driving" in bench.page.inner_text(".webmap-teleop")


def test_control_can_be_requested_from_another_operator(bench: Bench) -> None:
    ann = {"connection": "c9", "name": "Ann"}
    bench.gate.change("r1", holder=ann, epoch=7, state="held")
    bench.select("r1")
    bench.page.get_by_role("button", name="Request control of Robot r1").click()
    bench.until(lambda: bench.gate.of("ask") == [{"op": "ask", "robot": "r1"}])
    state = bench.page.locator(".webmap-teleop-state")
    asked = re.compile(r"handed over in (\d) s unless Ann refuses")
    bench.until(lambda: asked.search(state.inner_text()))
    left = int(asked.search(state.inner_text())[1])
    bench.until(lambda: int(asked.search(state.inner_text())[1]) < left)
    bench.page.keyboard.down("w")
    me = {"connection": "c1", "name": "me"}
    bench.gate.change("r1", asker=None, changing=True)
    bench.until(lambda: "Handing over" in state.inner_text())
    bench.gate.change("r1", changing=False, holder=me, mine=True, epoch=8)
    bench.until(lambda: bench.gate.of("drive"))
    bench.still()
    bench.page.keyboard.up("w")
    bench.page.wait_for_timeout(300)
    bench.hold("w", bench.gate.moves)
    assert bench.gate.of("take") == []


@pytest.mark.parametrize("answer", ["Hand over", "Keep control"])
def test_the_operator_sees_a_request_for_control_and_can_answer(
    bench: Bench, answer: str
) -> None:
    bench.drive()
    ann = {"connection": "c9", "name": "Ann", "left": 8.0}
    bench.gate.change("r1", asker=ann)
    request = bench.page.locator(".webmap-request")
    bench.until(lambda: request.count() == 1)
    asked = re.compile(r"Ann requests control of Robot r1 \((\d) s\)")
    left = int(asked.search(request.inner_text())[1])
    bench.until(lambda: int(asked.search(request.inner_text())[1]) < left)
    bench.page.get_by_role("button", name=re.compile(f"^{answer}.* Robot r1$")).click()
    op = {"Hand over": "grant", "Keep control": "deny"}[answer]
    bench.until(lambda: bench.gate.of(op) == [{"op": op, "robot": "r1"}])
    bench.until(lambda: not request.count())
    if answer == "Keep control":
        since = time.monotonic()
        bench.hold("w", lambda: bench.gate.moves(since))
        return
    bench.still(tolerance=0.05)
    bench.until(lambda: bench.shown() == "held")
    messages = [message for _, message in bench.gate.received]
    before = messages[messages.index({"op": "grant", "robot": "r1"}) - 1]
    assert (before["op"], before["x"], before["turn"]) == ("drive", 0, 0)


@pytest.mark.parametrize("key", ["Space", "Escape"])
def test_space_and_escape_stop_the_robot(bench: Bench, key: str) -> None:
    bench.drive()
    bench.page.keyboard.press(key)
    bench.until(lambda: bench.gate.of("stop") == [{"op": "stop", "robot": "r1"}])
    bench.still(tolerance=0.05)


@pytest.mark.parametrize("key", ["Space", "Escape"])
def test_space_and_escape_stop_all_robots_without_a_selection(
    bench: Bench, key: str
) -> None:
    bench.page.keyboard.press(key)
    bench.until(lambda: bench.gate.of("stop") == [{"op": "stop", "robot": "*"}])


def test_a_button_keeps_the_space_key_unless_this_page_drives(bench: Bench) -> None:
    bench.page.evaluate(
        """() => {
            const button = document.createElement('button');
            button.dataset.webmapKeepsSpace = '';
            button.addEventListener('click', () => { button.textContent += 'x'; });
            document.body.append(button);
        }"""
    )
    button = bench.page.locator("[data-webmap-keeps-space]")
    bench.page.keyboard.press("Tab")
    button.press("Space")
    bench.until(lambda: button.inner_text() == "x")
    assert bench.gate.of("stop") == []
    bench.drive()
    button.press("Space")
    bench.until(lambda: bench.gate.of("stop") == [{"op": "stop", "robot": "r1"}])
    bench.still(tolerance=0.05)
    assert button.inner_text() == "x"


def test_stop_keys_without_a_position_stop_and_driving_keys_do_nothing(
    bench: Bench,
) -> None:
    bench.select("r1")
    keys = bench.page.context.new_cdp_session(bench.page)

    def press(key: str, modifiers: int = 0) -> None:
        for kind in ("keyDown", "keyUp"):
            event = {"type": kind, "key": key, "code": "", "modifiers": modifiers}
            keys.send("Input.dispatchKeyEvent", event)

    for key in ("w", "ArrowUp"):
        press(key)
    detail = bench.page.locator(".webmap-teleop-detail")
    bench.until(lambda: "This keyboard cannot drive" in detail.inner_text())
    bench.still()
    assert bench.gate.of("take") == []
    shift = 8
    for key, modifiers in ((" ", 0), ("Escape", 0), (" ", shift), ("Escape", shift)):
        press(key, modifiers)
    stops = ["r1", "r1", "r1", "*"]
    bench.until(lambda: [each["robot"] for each in bench.gate.of("stop")] == stops)
    bench.drive()
    bench.page.keyboard.up("w")
    bench.until(lambda: "This keyboard cannot drive" not in detail.inner_text())


def test_escape_in_a_non_modal_dialog_sends_stop(bench: Bench) -> None:
    bench.drive()
    bench.page.evaluate(
        """() => {
            const dialog = document.createElement('dialog');
            dialog.append(document.createElement('button'));
            dialog.dataset.handsOff = '';
            document.body.append(dialog);
            bench.mark(() => dialog.show());
        }"""
    )
    bench.still(tolerance=0.15)
    bench.page.keyboard.press("Escape")
    bench.until(lambda: bench.gate.of("stop") == [{"op": "stop", "robot": "r1"}])


def test_shift_and_escape_stop_all(bench: Bench) -> None:
    bench.page.keyboard.press("Shift+Escape")
    bench.until(lambda: bench.gate.of("stop") == [{"op": "stop", "robot": "*"}])


def test_space_in_a_text_field_types_a_space(bench: Bench) -> None:
    bench.select("r1")
    bench.page.locator("#text").press_sequentially("w a")
    assert bench.page.locator("#text").input_value() == "w a"
    assert bench.gate.received == []


def test_the_stop_button_is_large_and_named_and_sends_stop(bench: Bench) -> None:
    bench.select("r1")
    button = bench.page.get_by_role("button", name="STOP Robot r1")
    box = button.bounding_box()
    assert box is not None
    assert min(box["width"], box["height"]) >= 44
    button.click()
    bench.until(lambda: bench.gate.of("stop") == [{"op": "stop", "robot": "r1"}])


def test_a_stop_without_a_connection_is_the_first_command_after_reconnection(
    bench: Bench,
) -> None:
    bench.select("r1")
    bench.cut()
    bench.page.keyboard.press("Escape")
    bench.until(lambda: bench.gate.received)
    assert bench.gate.received[0][1] == {"op": "stop", "robot": "r1"}


def test_control_is_released_after_a_time_without_motion(open_bench) -> None:
    bench = open_bench("?release=500")
    bench.drive()
    bench.page.keyboard.up("w")
    bench.until(lambda: bench.gate.of("release"))


def test_keys_drive_only_the_robot_of_the_last_clicked_map(open_bench) -> None:
    bench = open_bench("?two")
    bench.select("r1", map=0)
    bench.select("r2", map=1)
    bench.hold("w", bench.gate.moves)
    bench.page.keyboard.up("w")
    bench.page.locator("#map2").click(position={"x": 360, "y": 110})
    since = time.monotonic()
    bench.page.wait_for_timeout(300)
    bench.hold("w", lambda: bench.gate.moves(since))
    assert {command["robot"] for command in bench.gate.moves(since)} == {"r2"}
    assert bench.page.evaluate("bench.maps[1].sent") == [{"active": True}]


def world_at(view: dict, x: float, y: float) -> tuple[float, float]:
    det = view["a"] * view["d"] - view["b"] * view["c"]
    dx, dy = x - view["e"], y - view["f"]
    return (
        (view["d"] * dx - view["c"] * dy) / det,
        (view["a"] * dy - view["b"] * dx) / det,
    )


@pytest.fixture
def corner(bench: Bench) -> tuple[float, float]:
    box = bench.page.locator("#map1").bounding_box()
    return box["x"], box["y"]


def test_the_wheel_zooms_about_the_pointer(bench: Bench, corner) -> None:
    before = bench.view()
    bench.page.mouse.move(corner[0] + 200, corner[1] + 100)
    bench.page.mouse.wheel(0, -300)
    bench.until(lambda: bench.view()["a"] > before["a"])
    assert world_at(bench.view(), 200, 100) == pytest.approx(world_at(before, 200, 100))


def test_shift_and_wheel_rotate_the_view_about_the_pointer(
    bench: Bench, corner
) -> None:
    before = bench.view()
    bench.page.mouse.move(corner[0] + 200, corner[1] + 100)
    bench.page.keyboard.down("Shift")
    bench.page.mouse.wheel(0, 100)
    bench.until(lambda: bench.view()["b"])
    after = bench.view()
    assert world_at(after, 200, 100) == pytest.approx(world_at(before, 200, 100))
    assert abs(after["a"] * after["d"] - after["b"] * after["c"]) == pytest.approx(1600)


def test_a_drag_moves_the_view_and_does_not_end_in_a_click(
    bench: Bench, corner
) -> None:
    before = bench.view()
    bench.page.mouse.move(corner[0] + 200, corner[1] + 100)
    bench.page.mouse.down()
    bench.page.mouse.move(corner[0] + 220, corner[1] + 110)
    bench.page.mouse.move(corner[0] + 250, corner[1] + 130)
    bench.page.mouse.up()
    after = bench.view()
    assert (after["e"] - before["e"], after["f"] - before["f"]) == (50, 30)
    assert bench.page.evaluate("bench.maps[0].clicks") == 0
    bench.page.mouse.click(corner[0] + 10, corner[1] + 10)
    assert bench.page.evaluate("bench.maps[0].clicks") == 1


def test_a_click_that_moves_by_two_pixels_selects_the_robot(
    bench: Bench, corner
) -> None:
    bench.page.mouse.move(corner[0] + 440, corner[1] + 110)
    bench.page.mouse.down()
    bench.page.mouse.move(corner[0] + 442, corner[1] + 111)
    bench.page.mouse.up()
    assert bench.page.evaluate("bench.maps[0].selected") == "r1"
    assert bench.view()["e"] == 400


def test_two_fingers_zoom_rotate_and_move_the_view(open_bench) -> None:
    bench = open_bench(has_touch=True)
    box = bench.page.locator("#map1").bounding_box()
    x, y = box["x"], box["y"]
    before = bench.view()
    touch = bench.context.new_cdp_session(bench.page)

    def touch_points(kind: str, *points: tuple[float, float]) -> None:
        fingers = [
            {"x": x + px, "y": y + py, "id": i} for i, (px, py) in enumerate(points)
        ]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": fingers})

    touch_points("touchStart", (300, 150))
    touch_points("touchStart", (300, 150), (400, 150))
    for part in (0.25, 0.5, 0.75, 1):
        touch_points(
            "touchMove", (300, 150 - 50 * part), (400 + 50 * part, 150 + 50 * part)
        )
    touch_points("touchEnd")
    after = bench.view()
    assert world_at(after, 300, 100) == pytest.approx(world_at(before, 300, 150))
    assert world_at(after, 450, 200) == pytest.approx(world_at(before, 400, 150))


def test_plus_zooms_in_and_zero_shows_all_robots_on_the_focused_map(
    bench: Bench,
) -> None:
    bench.page.locator("#map1").focus()
    bench.page.keyboard.press("+")
    assert bench.view()["a"] == pytest.approx(50)
    bench.page.keyboard.press("0")
    view = bench.view()
    # Two robots of 0.3 m radius are 2 m apart: 2.6 m fill the width.
    assert world_at(view, 400, 150) == pytest.approx((0, 1))


def test_a_goal_is_set_by_a_drag_and_cancelled_by_its_button(open_bench) -> None:
    bench = open_bench("?modules=goals/goal_tool,drive/teleop,view/mouse_view_control")
    box = bench.page.locator("#map1").bounding_box()
    bench.select("r1")
    bench.page.keyboard.press("g")
    bench.page.mouse.move(box["x"] + 480, box["y"] + 150)
    bench.page.mouse.down()
    bench.page.mouse.move(box["x"] + 480, box["y"] + 80)
    assert bench.page.locator(".webmap-goal-arrow.aimed").count() == 1
    bench.page.mouse.up()
    bench.until(lambda: bench.gate.of("goal"))
    goal = bench.gate.of("goal")[0]
    assert [message["op"] for _, message in bench.gate.received] == ["take", "goal"]
    assert (goal["x"], goal["y"]) == pytest.approx((2, 0))
    assert goal["yaw"] == pytest.approx(1.5707963)
    assert bench.view()["e"] == 400, "aiming does not move the view"
    assert bench.page.evaluate("bench.maps[0].selected") == "r1"
    bench.page.get_by_role("button", name="Cancel goal").click()
    bench.until(lambda: bench.gate.of("cancel") == [{"op": "cancel", "robot": "r1"}])


def test_escape_first_leaves_the_goal_tool_and_then_sends_stop(open_bench) -> None:
    bench = open_bench("?modules=goals/goal_tool,drive/teleop")
    bench.select("r1")
    bench.page.keyboard.press("g")
    bench.page.keyboard.press("Escape")
    bench.page.wait_for_timeout(100)
    assert bench.gate.received == []
    bench.page.keyboard.press("Escape")
    bench.until(lambda: bench.gate.of("stop"))


def test_stop_all_shows_for_each_robot_whether_odometry_confirms_the_stop(
    open_bench,
) -> None:
    bench = open_bench("?modules=stop/stop_button,drive/teleop")
    bench.gate.change("r2", measured=None)
    bench.page.get_by_role("button", name="STOP ALL").click()
    bench.until(lambda: bench.gate.of("stop") == [{"op": "stop", "robot": "*"}])
    verdicts = bench.page.locator(".webmap-stop-verdict")
    bench.until(lambda: "NOT CONFIRMED: no odometry" in verdicts.nth(1).inner_text())
    assert verdicts.nth(0).inner_text().endswith("stopped, confirmed by odometry")


CONFIRMED = {"by": "Ann", "confirmed": True, "why": "", "id": "s8"}
UNCONFIRMED = CONFIRMED | {
    "confirmed": False,
    "why": "no connection to ws://bob",
    "id": "s9",
}


def test_a_stop_stays_active_until_two_separate_presses_on_reset(open_bench) -> None:
    bench = open_bench("?modules=stop/stop_button,drive/teleop")
    bench.gate.latching = True
    bench.drive()
    bench.page.keyboard.press("Space")
    bench.until(lambda: bench.shown() == "stopped")
    bench.gate.change("r1", stop=CONFIRMED)
    state = bench.page.locator(".webmap-teleop-state")
    bench.until(lambda: "STOP active By Ann, confirmed by" in state.inner_text())
    bench.page.keyboard.up("w")
    bench.page.wait_for_timeout(300)
    bench.page.keyboard.down("w")
    bench.still()
    assert len(bench.gate.of("take")) == 1
    reset = bench.page.locator(".webmap-teleop .webmap-reset")
    # A script clicks twice; on a busy machine two mouse clicks may be far apart.
    reset.evaluate("e => { e.click(); e.click(); }")
    bench.page.wait_for_timeout(450)
    assert bench.gate.of("reset") == []
    assert reset.inner_text() == "Press again to reset"
    reset.press("Enter")
    resets = [{"op": "reset", "robot": "r1", "stop": "s8"}]
    bench.until(lambda: bench.gate.of("reset") == resets)
    bench.still()
    bench.page.keyboard.up("w")
    bench.page.wait_for_timeout(300)
    since = time.monotonic()
    bench.hold("w", lambda: bench.gate.moves(since))


def test_space_on_the_reset_button_sends_stop(open_bench) -> None:
    bench = open_bench("?modules=stop/stop_button,drive/teleop")
    bench.select("r1")
    bench.gate.change("r1", latched=True, state="stopped", stop=CONFIRMED)
    reset = bench.page.locator(".webmap-teleop .webmap-reset")
    for _ in range(2):
        reset.press("Space")
        bench.page.wait_for_timeout(450)
    bench.until(lambda: len(bench.gate.of("stop")) == 2)
    assert bench.gate.of("reset") == []


def test_an_unconfirmed_stop_is_shown_and_reset_all_resets_every_stop(
    open_bench,
) -> None:
    bench = open_bench("?modules=stop/stop_button,drive/teleop")
    bench.select("r1")
    bench.gate.change("r1", latched=True, state="stopped", stop=UNCONFIRMED)
    bench.gate.change("r2", latched=True, state="stopped", stop=CONFIRMED)
    standing = bench.page.locator(".webmap-stop-standing")
    text = "STOP active: 2 robots, 1 NOT CONFIRMED."
    bench.until(lambda: standing.inner_text() == text)
    assert bench.shown() == "unconfirmed"
    shown = bench.page.inner_text(".webmap-teleop-state")
    assert shown == "STOP NOT CONFIRMED By Ann: no connection to ws://bob."
    reset = bench.page.get_by_role("button", name="Reset all")
    reset.click()
    bench.page.wait_for_timeout(450)
    bench.page.get_by_role("button", name="Press again to reset").click()
    stops = {"r1": "s9", "r2": "s8"}
    both = [{"op": "reset", "robot": r, "stop": s} for r, s in stops.items()]
    bench.until(lambda: bench.gate.of("reset") == both)
    bench.until(lambda: not bench.page.locator(".webmap-stop-list").is_visible())


STOPPED = {"latched": True, "state": "stopped", "stop": CONFIRMED}


def test_a_stop_of_another_robot_cancels_the_first_press_on_reset(
    open_bench,
) -> None:
    bench = open_bench("?modules=stop/stop_button,drive/teleop")
    bench.gate.change("r1", **STOPPED)
    reset = bench.page.locator(".webmap-stop .webmap-reset")
    reset.click()
    assert reset.inner_text() == "Press again to reset"
    bench.gate.change("r2", **STOPPED)
    # Sooner than the timeout of the first press.
    bench.until(lambda: reset.inner_text() == "Reset all", patience=3.0)
    bench.page.wait_for_timeout(450)
    reset.click()
    bench.page.wait_for_timeout(100)
    assert bench.gate.of("reset") == []


@pytest.mark.parametrize("panel", ["stop", "teleop"])
def test_a_newer_stop_of_another_operator_cancels_the_first_press_on_reset(
    open_bench, panel
) -> None:
    bench = open_bench("?modules=stop/stop_button,drive/teleop")
    bench.select("r1")
    bench.gate.change("r1", **STOPPED)
    reset = bench.page.locator(f".webmap-{panel} .webmap-reset")
    reset.wait_for()
    reset.press("Enter")
    assert reset.inner_text() == "Press again to reset"
    bench.gate.change("r1", stop=CONFIRMED | {"by": "Ben", "id": "s10"})
    bench.until(lambda: reset.inner_text() == "Reset", patience=3.0)
    assert bench.gate.of("reset") == []


def test_the_reason_of_a_refused_reset_is_shown_beside_the_button(open_bench) -> None:
    bench = open_bench("?modules=stop/stop_button,drive/teleop")
    bench.gate.change("r1", **STOPPED)
    why = "Ben pressed STOP meanwhile; look at the robot, then press Reset again"
    bench.gate.refuse("r1", "reset", why)
    standing = bench.page.locator(".webmap-stop-standing")
    bench.until(lambda: standing.inner_text().endswith(f"refused: {why}."))
    bench.gate.change("r1", latched=False, state="free", stop=None)
    bench.until(lambda: why not in standing.inner_text())


def test_selecting_another_robot_cancels_the_first_press_on_reset(bench: Bench) -> None:
    for robot in ("r1", "r2"):
        bench.gate.change(robot, **STOPPED)
    bench.select("r1")
    reset = bench.page.locator(".webmap-teleop .webmap-reset")
    reset.wait_for()
    reset.press("Enter")
    assert reset.inner_text() == "Press again to reset"
    bench.select("r2")
    assert reset.inner_text() == "Reset"
    bench.page.wait_for_timeout(450)
    reset.press("Enter")
    bench.page.wait_for_timeout(100)
    assert bench.gate.of("reset") == []


@pytest.mark.parametrize("panel", ["stop", "teleop"])
def test_a_stop_between_two_presses_on_reset_cancels_the_first_press(
    open_bench, panel
) -> None:
    bench = open_bench("?modules=stop/stop_button,drive/teleop")
    bench.select("r1")
    bench.gate.change("r1", **STOPPED)
    reset = bench.page.locator(f".webmap-{panel} .webmap-reset")
    reset.wait_for()
    reset.press("Enter")
    assert reset.inner_text() == "Press again to reset"
    bench.page.keyboard.press("Space")
    bench.until(lambda: reset.inner_text() == "Reset", patience=3.0)
    bench.page.wait_for_timeout(450)
    reset.press("Enter")
    bench.until(lambda: reset.inner_text() == "Press again to reset")
    assert bench.gate.of("reset") == []


def test_stop_all_is_shown_as_not_confirmed_before_a_robot_is_known(
    open_bench, gate: FakeDrive
) -> None:
    robots = dict(gate.robots)
    gate.robots.clear()
    bench = open_bench("?modules=stop/stop_button,drive/teleop")
    bench.page.get_by_role("button", name="STOP ALL").click()
    verdicts = bench.page.locator(".webmap-stop-verdict")
    bench.until(lambda: "All robots: NOT CONFIRMED" in verdicts.inner_text())
    gate.robots |= robots
    gate.change("r1", **STOPPED)
    text = "Robot r1: stopped, confirmed by odometry"
    bench.until(lambda: verdicts.inner_text() == text)


def test_stop_all_shows_the_verdict_of_the_gate_for_each_robot(open_bench) -> None:
    bench = open_bench("?modules=stop/stop_button,drive/teleop")
    bench.gate.latching = True
    bench.page.get_by_role("button", name="STOP ALL").click()
    verdicts = bench.page.locator(".webmap-stop-verdict")
    bench.until(lambda: verdicts.count() == 2 and bench.gate.robots["r2"]["latched"])
    bench.gate.change("r1", stop=CONFIRMED)
    bench.gate.change("r2", stop=UNCONFIRMED)
    bench.until(lambda: verdicts.nth(0).get_attribute("data-state") == "confirmed")
    bench.until(
        lambda: (
            verdicts.nth(1)
            .inner_text()
            .endswith("CONFIRMED: no connection to ws://bob")
        )
    )
    bench.page.get_by_role("button", name="STOP ALL").click()
    bench.until(lambda: len(bench.gate.of("stop")) == 2)


def test_a_stop_without_an_answer_is_shown_as_not_confirmed(open_bench) -> None:
    bench = open_bench("?modules=stop/stop_button,drive/teleop")
    bench.gate.change("r1", latched=False, stop=None)
    bench.select("r1")
    bench.until(lambda: bench.shown() == "free")
    bench.gate.ignores_messages = True
    bench.page.keyboard.press("Space")
    bench.until(lambda: bench.shown() == "unconfirmed")
    shown = bench.page.inner_text(".webmap-teleop-state")
    assert shown == "STOP NOT CONFIRMED No answer from the gate."
    listed = bench.page.inner_text(".webmap-stop-verdict")
    assert "Robot r1: NOT CONFIRMED" in listed


def test_a_robot_that_moves_after_zero_was_sent_raises_an_alarm(open_bench) -> None:
    bench = open_bench("?modules=stop/stop_button,drive/teleop")
    bench.gate.change("r1", sent=[0.3, 0, 0], measured=[0.3, 0, 0], state="driving")
    bench.gate.change("r1", sent=[0, 0, 0], state="stopping")
    alarm = bench.page.get_by_role("alert")
    alarm.wait_for(timeout=5000)
    assert "ROBOT NOT OBEYING" in alarm.inner_text()
    assert "Robot r1" in alarm.inner_text()
    bench.gate.change("r1", measured=[0, 0, 0])
    alarm.wait_for(state="detached")


def test_readouts_show_the_view_and_destroyed_modules_leave_nothing(open_bench) -> None:
    view = "view/mouse_view_control,view/pointer_readout,view/scale_bar,view/follow"
    tools = "drive/teleop,goals/goal_tool,stop/stop_button"
    bench = open_bench(f"?modules={tools},{view}")
    box = bench.page.locator("#map1").bounding_box()
    bench.page.mouse.move(box["x"] + 440, box["y"] + 170)
    assert "x 1.00  y -0.50 m" in bench.page.inner_text(".webmap-pointer-readout")
    assert bench.page.inner_text(".webmap-scale-bar") == "2 m"
    bench.select("r1")
    bench.page.get_by_role("button", name="Follow").click()
    bench.until(lambda: {"follow": "r1"} in bench.page.evaluate("bench.maps[0].sent"))
    bench.page.evaluate("bench.maps[0].parts.forEach((part) => part.destroy())")
    assert bench.page.locator(".webmap-panel, .webmap-overlay").count() == 0
    bench.page.keyboard.press("Escape")
    bench.page.keyboard.down("w")
    bench.page.wait_for_timeout(200)
    assert bench.gate.received == []
