"""Faults of the page and of the browser while an operator holds W."""

import os
import signal
import time

import pytest
from safety_bench import NEUTRAL, pass_time, send_only
from safety_run import LONG

pytestmark = [
    pytest.mark.safety,
    pytest.mark.browser,
    pytest.mark.serial,
]

PROMISED = 0.3
"""Seconds from the fault to the first zero at the robot (S1)."""


def test_releasing_the_key_stops_the_robot(bench):
    bench.prove("the key is released", bench.let_go, within=0.1, held_after=False)


def test_a_killed_renderer_stops_the_robot(bench):
    def kill():
        for process in bench.renderers():
            process.kill()

    def back():
        # The browser runs on, and so may its other tabs.
        bench.tab.close()
        bench.tab = None
        try:
            bench.open_page()
        except TimeoutError:
            # Sometimes the browser gives a new tab to the killed process.
            bench.end_browser()
            bench.open_page()

    bench.prove("the renderer is killed", kill, within=PROMISED, back=back)


def test_a_killed_browser_stops_the_robot(bench):
    def kill():
        os.killpg(bench.browser.process.pid, signal.SIGKILL)

    bench.prove(
        "the browser is killed", kill, within=PROMISED, back=bench.renew_browser
    )


def test_a_suspended_browser_stops_the_robot(bench):
    def send(sig):
        os.killpg(bench.browser.process.pid, sig)

    def back():
        bench.linger(1.5)
        send(signal.SIGCONT)

    bench.prove(
        "the browser is stopped (SIGSTOP) for 2 s",
        lambda: send(signal.SIGSTOP),
        within=PROMISED,
        back=back,
    )


def test_a_frozen_page_stops_the_robot(bench):
    def state(name):
        bench.tab.call("Page.setWebLifecycleState", state=name)

    def back():
        state("active")
        # DevTools leaves the page hidden; a change of tabs shows it again.
        bench.look_away_and_back()

    bench.prove(
        "the page is frozen", lambda: state("frozen"), within=PROMISED, back=back
    )


def test_opening_another_page_in_the_tab_stops_the_robot(bench):
    def back():
        bench.close_page()
        bench.open_page()

    bench.prove(
        "the page opens another page",
        lambda: bench.tab.go("about:blank"),
        within=PROMISED,
        back=back,
    )


def test_another_tab_in_front_stops_the_robot(bench):
    bench.prove(
        "another tab comes to the front",
        bench.look_away,
        within=PROMISED,
        back=bench.look_back,
    )


def test_a_closed_tab_stops_the_robot(bench):
    bench.prove(
        "the tab is closed", bench.close_page, within=PROMISED, back=bench.open_page
    )


def test_an_alert_stops_the_robot(bench):
    def show():
        send_only(
            bench.tab,
            "Runtime.evaluate",
            expression="setTimeout(() => alert('Look here'), 0)",
        )

    def back():
        bench.linger(0.5)
        bench.tab.call("Page.handleJavaScriptDialog", accept=True)

    bench.prove("an alert is shown", show, within=PROMISED, back=back)


def test_a_busy_page_stops_the_robot(bench):
    def be_busy():
        until = f"performance.now() + {bench.stretch(2.0, 0.6) * 1000}"
        busy = f"const t = {until}; while (performance.now() < t);"
        bench.tab.evaluate(f"setTimeout(() => {{ {busy} }}, 0), 0")

    bench.prove(
        "the page is busy for 2 s",
        be_busy,
        within=PROMISED,
        back=lambda: bench.tab.evaluate("0"),
    )


JUMP = """(() => {
    const [now, date] = [performance.now.bind(performance), Date.now];
    performance.now = () => now() + SHIFT;
    Date.now = () => date() + SHIFT;
})()"""


@LONG
@pytest.mark.parametrize(("hours", "way"), [(1, "ahead"), (-1, "back")])
def test_a_jump_of_the_browser_clocks_stops_the_robot(bench, hours, way):
    # The jump is permanent, so all trials after the first use wrong clocks.
    bench.prove(
        f"the browser's clocks jump an hour {way}",
        lambda: bench.tab.evaluate(JUMP.replace("SHIFT", str(hours * 3_600_000))),
        within=PROMISED,
    )
    bench.close_page()


def test_the_stop_key_stops_the_robot_and_reset_moves_nothing(bench):
    def back():
        bench.space("keyUp")
        pass_time(0.5)
        bench.reset_stop()

    bench.prove(
        "STOP by the space bar while W is held",
        lambda: bench.space("keyDown"),
        within=0.1,
        back=back,
    )


FRENCH = [("z", "KeyW"), pytest.param("ArrowUp", "ArrowUp", marks=LONG)]


@pytest.mark.parametrize(("letter", "place"), FRENCH)
def test_keys_drive_by_their_position_and_not_by_their_letter(bench, letter, place):
    """On a French keyboard, the keys W and Z are exchanged."""

    def send_key(kind, key, code):
        bench.tab.call("Input.dispatchKeyEvent", type=kind, key=key, code=code)

    begun = time.monotonic()
    bench.restore()
    send_key("keyDown", "w", "KeyZ")
    pass_time(1.0)
    send_key("keyUp", "w", "KeyZ")
    assert bench.robot.log.moving_since(begun) == [], "the letter of a key drives"
    for _ in range(5):
        pass_time(NEUTRAL)
        send_key("keyDown", letter, place)
        pass_time(1.5)
        driven = bench.steady()
        send_key("keyUp", letter, place)
        if driven:
            break
    assert driven, bench.tab.evaluate("document.body.innerText")
