"""No handler of the page is all that stops a robot: it stops without each of them.

The page is served as it is; what is injected before its scripts makes it deaf to one
kind of event, as if the handlers of that kind were not there. Then what they are there
for happens. The page's step, which looks for itself, or the gate's dead-man must do.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import pytest
from safety_bench import NEUTRAL, pass_time, wait_for
from safety_run import grace

pytestmark = [pytest.mark.safety, pytest.mark.browser, pytest.mark.serial]

PROMISED = 0.3
"""Seconds from the fault to the first zero at the robot (S1)."""

DEAF = """
window.deafTo = () => false;
const { addEventListener } = EventTarget.prototype;
EventTarget.prototype.addEventListener = function (kind, listener, options) {
    const hear = function (event) {
        if (!window.deafTo(event)) listener.call(this, event);
    };
    return addEventListener.call(this, kind, hear, options);
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
"""Where the stick is, which is called up first."""

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
    """A finger on W."""

    def __init__(self, bench):
        self.press, self.let_go = bench.press, bench.let_go
        self.hold_on = bench.repeat_press


class Thumb:
    """A thumb on the stick."""

    def __init__(self, bench):
        self._tab = bench.tab
        self._x, self._y, self._reach = bench.tab.wait(STICK)
        self._down = False

    def press(self):
        self.say("touchStart")
        self.hold_on()

    def hold_on(self):
        if self._down:
            self.say("touchMove", up=0.9)

    def let_go(self):
        if self._down:
            self.say("touchEnd")

    def say(self, kind, up=0.0):
        self._down = kind in ("touchStart", "touchMove")
        points = [{"x": self._x, "y": self._y - up * self._reach}] if self._down else []
        self._tab.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)


class Pad:
    """A thumb on a gamepad's stick, and a finger on its dead-man button."""

    def __init__(self, bench):
        self._tab = bench.tab

    def press(self):
        self._tab.evaluate(PAD.replace("HELD", "true"))

    hold_on = press

    def let_go(self):
        self._tab.evaluate(PAD.replace("HELD", "false"))


def nothing(bench, hand):
    """Neither does anything happen before the fault, nor is anything to be mended."""


def look_away(bench, hand):
    bench.look_away()


def look_back(bench, hand):
    bench.look_back()


def press_meta(bench, hand):
    say_meta(bench.tab, "rawKeyDown")


def let_go_elsewhere(bench, hand):
    """The other tab gets to hear of it, as it has the keyboard now."""
    bench._other.up("w")
    bench.look_back()


def say_meta(tab, kind):
    tab.call(
        "Input.dispatchKeyEvent",
        type=kind,
        key="Meta",
        code="MetaLeft",
        windowsVirtualKeyCode=91,
    )


def let_meta_go_elsewhere(bench, hand):
    say_meta(bench._other, "keyUp")
    bench.look_back()


def open_menu(bench, hand):
    for kind in ("mousePressed", "mouseReleased"):
        bench.tab.call(
            "Input.dispatchMouseEvent",
            type=kind,
            x=300,
            y=20,
            button="right",
            clickCount=1,
        )


def type_something(bench, hand):
    bench.tab.evaluate(FOCUS)


def type_no_more(bench, hand):
    bench.tab.evaluate("document.getElementById('field').remove()")


def leave(bench, hand):
    bench.tab.go("about:blank")


def come_back(bench, hand):
    bench.close_page()
    listen_deafly(bench)


def freeze(bench, hand):
    bench.tab.call("Page.setWebLifecycleState", state="frozen")


def thaw(bench, hand):
    bench.tab.call("Page.setWebLifecycleState", state="active")
    bench.look_away_and_back()


def lift_thumb(bench, hand):
    hand.let_go()


def cancel_touch(bench, hand):
    hand.say("touchCancel")


def lose_capture(bench, hand):
    bench.tab.evaluate(LOSE_CAPTURE)


def unplug(bench, hand):
    bench.tab.evaluate(
        "window.pad = null, dispatchEvent(new Event('gamepaddisconnected'))"
    )


Act = Callable[[object, object], None]


@dataclass
class Deleted:
    """A handler that is not there, and what happens then.

    ``unheard`` happens first, where the page cannot know of it otherwise: the robot
    must move on, which shows that the handler is deleted. ``fault`` is what takes the
    page away from the operator after that.
    """

    deaf: str
    fault: Act
    back: Act = nothing
    unheard: Act = nothing
    hand: type = Key

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
    "pointerup": Deleted(Deleted.to("pointerup"), lift_thumb, hand=Thumb),
    "pointercancel": Deleted(Deleted.to("pointercancel"), cancel_touch, hand=Thumb),
    "lostpointercapture": Deleted(
        Deleted.to("lostpointercapture"), lose_capture, hand=Thumb
    ),
    "all of the stick": Deleted(Deleted.to(*POINTER), lift_thumb, hand=Thumb),
    "gamepaddisconnected": Deleted(Deleted.to("gamepaddisconnected"), unplug, hand=Pad),
}


def listen_deafly(bench):
    """Have a page on which handlers can be deleted, which none is yet."""
    bench.heal()
    if not bench.tab.evaluate("'deafTo' in window"):
        bench.tab.call("Page.addScriptToEvaluateOnNewDocument", source=DEAF)
        bench.tab.call("Page.reload")
        bench.tab.wait("'deafTo' in window")
        bench.tab.wait("document.querySelector('.robot.selected') !== null")
    bench.tab.evaluate("window.deafTo = () => false, 0")


def drive_off(bench, case):
    """Drive until it moves, also after what only the deleted handler hears of."""
    hand = case.hand(bench)
    for _ in range(10):
        hand.let_go()
        pass_time(NEUTRAL)
        bench.tab.evaluate(f"window.deafTo = (event) => {case.deaf}, 0")
        hand.press()
        deadline = time.monotonic() + 2.5
        while time.monotonic() < deadline and not bench.steady():
            pass_time(0.01)
        if bench.steady():
            case.unheard(bench, hand)
            pass_time(0.1)
            if bench.steady():
                return hand
        bench.tab.evaluate("window.deafTo = () => false, 0")
    raise AssertionError(bench.tab.evaluate("document.body.innerText"))


@pytest.mark.parametrize("handler", DELETED)
def test_the_robot_stops_when_an_event_handler_of_the_page_is_missing(bench, handler):
    case, log = DELETED[handler], bench.robot.log
    listen_deafly(bench)
    hand = drive_off(bench, case)
    fault_at = time.monotonic()
    case.fault(bench, hand)
    wait_for(lambda: log.first_zero(fault_at), "a zero")
    stopped = log.first_zero(fault_at)
    jitter = bench.sentinel.stolen(fault_at - 0.1, stopped)
    case.back(bench, hand)
    hand.hold_on()
    pass_time(0.3)
    moved = log.moving_since(fault_at + PROMISED + jitter + 0.001)
    bench.tab.evaluate("window.deafTo = () => false, 0")
    hand.let_go()
    assert stopped - fault_at <= PROMISED + grace(jitter)
    assert not moved, "it moves by what was held all the time"
