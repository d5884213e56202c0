"""The robot stops even if an event handler of the page is missing.

The page is unchanged. A script that runs before the scripts of the page ignores one
type of event, as if the page had no handlers for this type. Then such an event occurs.
The periodic step of the page or the dead-man timeout of the gate must stop the robot.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import pytest
from safety_bench import NEUTRAL, pass_time
from safety_run import grace

from equipment.waiting import wait_for

pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]

PROMISED = 0.3
"""Seconds from the fault to the first zero at the robot (S1)."""

IGNORE_EVENTS = """
window.isIgnored = () => false;
const { addEventListener } = EventTarget.prototype;
EventTarget.prototype.addEventListener = function (kind, listener, options) {
    const handler = function (event) {
        if (!window.isIgnored(event)) listener.call(this, event);
    };
    return addEventListener.call(this, kind, handler, options);
};
window.pad = null;
navigator.getGamepads = () => [window.pad];
"""

PAD = """window.pad = {
    index: 0, id: 'Pad', connected: true, mapping: 'standard', axes: [0, -1, 0, 0],
    buttons: Array.from({length: 17}, (_, i) => ({pressed: HELD && i === 4})),
    get timestamp() { return performance.now(); },
}, 0"""

STICK = """(() => {
    const pad = document.querySelector('.webmap-stick');
    const buttons = [...document.querySelectorAll('.webmap-teleop button')];
    const stick = buttons.find((one) => one.innerText === 'Stick');
    if (!pad?.checkVisibility()) return stick?.click(), null;
    // The map of this page is too small for it.
    Object.assign(pad.style, { position: 'fixed', left: '600px', top: '200px' });
    const { left, top, width, height } = pad.getBoundingClientRect();
    return [left + width / 2, top + height / 2, width / 2];
})()"""
"""The middle and the radius of the stick; None if the stick must first open."""

LOSE_CAPTURE = """(() => {
    const pad = document.querySelector('.webmap-stick');
    for (let id = 0; id < 100; id++) {
        if (pad.hasPointerCapture(id)) pad.releasePointerCapture(id);
    }
})()"""

FOCUS = """(() => {
    const field = document.createElement('input');
    field.id = 'field';
    document.body.append(field);
    field.focus();
})()"""


class Key:
    """The key W."""

    def __init__(self, bench):
        self.press, self.let_go = bench.press, bench.let_go
        self.hold_on = bench.repeat_press


class Stick:
    """The stick on a touchscreen."""

    def __init__(self, bench):
        self._tab = bench.tab
        self._x, self._y, self._reach = bench.tab.wait(STICK)
        self._down = False

    def press(self):
        self.send_touch("touchStart")
        self.hold_on()

    def hold_on(self):
        if self._down:
            self.send_touch("touchMove", up=0.9)

    def let_go(self):
        if self._down:
            self.send_touch("touchEnd")

    def send_touch(self, kind, up=0.0):
        self._down = kind in ("touchStart", "touchMove")
        points = [{"x": self._x, "y": self._y - up * self._reach}] if self._down else []
        self._tab.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)


class Pad:
    """A gamepad: its stick, and its dead-man button."""

    def __init__(self, bench):
        self._tab = bench.tab

    def press(self):
        self._tab.evaluate(PAD.replace("HELD", "true"))

    hold_on = press

    def let_go(self):
        self._tab.evaluate(PAD.replace("HELD", "false"))


def nothing(bench, device):
    """Do nothing before the fault, or after it."""


def look_away(bench, device):
    bench.look_away()


def look_back(bench, device):
    bench.look_back()


def press_meta(bench, device):
    send_meta_key(bench.tab, "rawKeyDown")


def let_go_elsewhere(bench, device):
    """Release W in the other tab, which has the keyboard focus now."""
    bench._other.up("w")
    bench.look_back()


def send_meta_key(tab, kind):
    tab.call(
        "Input.dispatchKeyEvent",
        type=kind,
        key="Meta",
        code="MetaLeft",
        windowsVirtualKeyCode=91,
    )


def let_meta_go_elsewhere(bench, device):
    send_meta_key(bench._other, "keyUp")
    bench.look_back()


def open_menu(bench, device):
    for kind in ("mousePressed", "mouseReleased"):
        bench.tab.call(
            "Input.dispatchMouseEvent",
            type=kind,
            x=300,
            y=20,
            button="right",
            clickCount=1,
        )


def type_something(bench, device):
    bench.tab.evaluate(FOCUS)


def type_no_more(bench, device):
    bench.tab.evaluate("document.getElementById('field').remove()")


def leave(bench, device):
    bench.tab.go("about:blank")


def come_back(bench, device):
    bench.close_page()
    prepare_page(bench)


def freeze(bench, device):
    bench.tab.call("Page.setWebLifecycleState", state="frozen")


def thaw(bench, device):
    bench.tab.call("Page.setWebLifecycleState", state="active")
    bench.look_away_and_back()


def release_stick(bench, device):
    device.let_go()


def cancel_touch(bench, device):
    device.send_touch("touchCancel")


def lose_capture(bench, device):
    bench.tab.evaluate(LOSE_CAPTURE)


def unplug(bench, device):
    bench.tab.evaluate(
        "window.pad = null, dispatchEvent(new Event('gamepaddisconnected'))"
    )


Act = Callable[[object, object], None]


@dataclass
class Deleted:
    """A missing handler, and the actions of the test.

    ``unnoticed`` runs first. It causes an event that only the missing handler would
    process, so the robot must still move: this shows that the handler is missing. After
    that, ``fault`` is an event that must stop the robot.
    """

    ignored: str
    fault: Act
    back: Act = nothing
    unnoticed: Act = nothing
    device: type = Key

    META: ClassVar[str] = "event.key === 'Meta'"

    @staticmethod
    def to(*kinds: str) -> str:
        return f"{list(kinds)}.includes(event.type)"


WINDOW = (
    *("blur", "visibilitychange", "pagehide", "freeze", "contextmenu", "focusin"),
    "dragstart",
)
POINTER = ("pointerup", "pointercancel", "lostpointercapture")

DELETED = {
    "keyup": Deleted(Deleted.to("keyup"), look_away, let_go_elsewhere),
    "meta": Deleted(Deleted.META, look_away, let_meta_go_elsewhere, press_meta),
    "contextmenu": Deleted(Deleted.to("contextmenu"), look_away, look_back, open_menu),
    "blur": Deleted(Deleted.to("blur"), look_away, look_back),
    "visibilitychange": Deleted(Deleted.to("visibilitychange"), look_away, look_back),
    "focusin": Deleted(Deleted.to("focusin"), type_something, type_no_more),
    "freeze": Deleted(Deleted.to("freeze"), freeze, thaw),
    "pagehide": Deleted(Deleted.to("pagehide"), leave, come_back),
    "all of the window and the keyboard": Deleted(
        f"{Deleted.META} || {Deleted.to('keyup', *WINDOW)}", look_away, look_back
    ),
    "pointerup": Deleted(Deleted.to("pointerup"), release_stick, device=Stick),
    "pointercancel": Deleted(Deleted.to("pointercancel"), cancel_touch, device=Stick),
    "lostpointercapture": Deleted(
        Deleted.to("lostpointercapture"), lose_capture, device=Stick
    ),
    "all of the stick": Deleted(Deleted.to(*POINTER), release_stick, device=Stick),
    "gamepaddisconnected": Deleted(
        Deleted.to("gamepaddisconnected"), unplug, device=Pad
    ),
}


def prepare_page(bench):
    """Load the page with the script that can ignore events; ignore none yet."""
    bench.restore()
    if not bench.tab.evaluate("'isIgnored' in window"):
        bench.tab.call("Page.addScriptToEvaluateOnNewDocument", source=IGNORE_EVENTS)
        bench.tab.call("Page.reload")
        bench.tab.wait("'isIgnored' in window")
        bench.tab.wait("document.querySelector('.robot.selected') !== null")
    bench.tab.evaluate("window.isIgnored = () => false, 0")


def drive_off(bench, case):
    """Drive until the robot moves, also after the event that the page ignores."""
    device = case.device(bench)
    for _ in range(10):
        device.let_go()
        pass_time(NEUTRAL)
        bench.tab.evaluate(f"window.isIgnored = (event) => {case.ignored}, 0")
        device.press()
        deadline = time.monotonic() + 2.5
        while time.monotonic() < deadline and not bench.steady():
            pass_time(0.01)
        if bench.steady():
            case.unnoticed(bench, device)
            pass_time(0.1)
            if bench.steady():
                return device
        bench.tab.evaluate("window.isIgnored = () => false, 0")
    raise AssertionError(bench.tab.evaluate("document.body.innerText"))


@pytest.mark.parametrize("handler", DELETED)
def test_the_robot_stops_when_an_event_handler_of_the_page_is_missing(bench, handler):
    case, log = DELETED[handler], bench.robot.log
    prepare_page(bench)
    device = drive_off(bench, case)
    fault_at = time.monotonic()
    case.fault(bench, device)
    wait_for(lambda: log.first_zero(fault_at), "a zero")
    stopped = log.first_zero(fault_at)
    jitter = bench.sentinel.stolen(fault_at - 0.1, stopped)
    case.back(bench, device)
    device.hold_on()
    pass_time(0.3)
    moved = log.moving_since(fault_at + PROMISED + jitter + 0.001)
    bench.tab.evaluate("window.isIgnored = () => false, 0")
    device.let_go()
    assert stopped - fault_at <= PROMISED + grace(jitter)
    assert not moved, "the robot moves by an input that was held all the time"
