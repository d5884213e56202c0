"""A bench: an operator holds W, a robot records its commands, and proxies fail.

::

    Chromium ── proxy ── display ── gate ── proxy ── witness robot
                "web"                       "robot"
"""

import json
import os
import signal
import time
from contextlib import ExitStack, suppress
from pathlib import Path

import psutil

from equipment.devtools import Chromium, Tab
from equipment.processes import WEB, Process
from equipment.waiting import wait_for
from webmap.testing import FaultProxy, Sentinel, Shape, WitnessRobot

SITE = Path(__file__).with_name("safety_site.py")
V_MAX, W_MAX = 1.0, 1.5

NEUTRAL = 0.3
"""Seconds for which W is released before a press; the gate requires 200 ms."""

ROBOT_TIMEOUT = 0.5
"""Seconds without a command after which the witness robot stops by itself."""


def pass_time(seconds):
    """Wait, for example to check afterwards that nothing has happened."""
    time.sleep(seconds)


RESET = """import("/_webmap/web/access.js")
  .then(({ protocols }) => new Promise((done) => {
    const url = new URL("/_webmap/drive", location.href);
    url.protocol = "ws:";
    const { robot: driven } = document.querySelector(".robot.selected").dataset;
    let stopped = false;
    const open = () => {
        const socket = new WebSocket(url, protocols());
        socket.onclose = () => setTimeout(open, 300);  // the display may be too busy
        socket.onmessage = (event) => {
            const message = JSON.parse(event.data);
            if (message.op !== "robot") return;
            if (message.latched) {
                const { robot, stop } = message;
                stopped ||= robot === driven;
                socket.send(JSON.stringify({ op: "reset", robot, stop: stop.id }));
            } else if (stopped && message.robot === driven) {
                socket.onclose = null;
                socket.close();
                done(message.state);
            }
        };
    };
    open();
}))"""


class Bench:
    """All parts from the key to the robot, as real processes.

    Args:
        folder: The folder of the stored state.
        timeout: Seconds without a command after which the robot stops by itself;
            None if it never does.

    """

    def __init__(self, folder, timeout=ROBOT_TIMEOUT):
        self._folder = folder
        self._timeout = timeout
        self._open = ExitStack()
        self.browser = self.tab = self.display = None
        self.others_publish = False
        """Whether another program of the test publishes velocities."""
        self.causes = []
        """Times at which zeros may begin, for example at each release of the key."""

    def __enter__(self):
        enter = self._open.enter_context
        self.robot = enter(WitnessRobot(timeout=self._timeout))
        self.robot_hop = enter(FaultProxy(self.robot.port))
        self.sentinel = enter(Sentinel())
        self._open.callback(self.end_display)
        self.start_display()
        self.web_hop = enter(FaultProxy(self.display_port))
        self._open.callback(self.end_browser)
        return self

    def __exit__(self, *exception):
        self._open.close()

    # The parts.

    def start_display(self):
        os.environ["SAFETY_BRIDGE"] = f"ws://127.0.0.1:{self.robot_hop.port}"
        os.environ["WEBMAP_STATE_DIR"] = str(self._folder / "state")
        port = self.display_port if self.display else 0
        self.display = Process("run", SITE, "--port", port, "--no-browser")
        self.url = self.display.ready(WEB)
        self.display_port = int(self.url.split("/")[2].split(":")[1])

    def end_display(self, sig=signal.SIGINT):
        if not self.display.popen.stdout.closed:
            self.display.end(sig)
        print(self.display.log)

    def start_browser(self):
        self.browser = Chromium().__enter__()

    def end_browser(self):
        if self.browser is not None:
            self.browser.__exit__()
            self.browser = self.tab = None

    def renew_browser(self):
        """Open the page in a new browser, as the old one has ended or is damaged."""
        self.tab.close()
        self.end_browser()
        self.open_page()

    def open_page(self, before=""):
        """Open the page in a new tab; start a browser if none runs.

        Args:
            before: A script that runs before the scripts of the page.

        """
        if self.browser is None:
            self.start_browser()
        self.tab = self.browser.new_tab()
        if before:
            self.tab.call("Page.addScriptToEvaluateOnNewDocument", source=before)
        self.tab.go(self.url.replace(str(self.display_port), str(self.web_hop.port)))
        self.tab.wait("document.querySelector('.robot.selected') !== null")

    def close_page(self):
        tab, self.tab = self.tab, None
        if tab is not None:
            self.browser._ask(f"close/{tab.id}")
            tab.close()

    def look_away(self):
        """Open another tab in front of the page."""
        self._other = self.browser.new_tab()

    def look_back(self):
        """Bring the page to the front again."""
        self.browser.activate(self.tab)
        self.tab.wait("document.visibilityState === 'visible'")
        self.browser._ask(f"close/{self._other.id}")
        self._other.close()

    def look_away_and_back(self):
        self.look_away()
        self.look_back()

    def wait_for_gate(self):
        """Wait until the display has started another gate."""
        wait_for(lambda: self.gate is not None, "another gate")

    @property
    def gate(self):
        """The process of the gate that runs now, or None."""
        for child in psutil.Process(self.display.popen.pid).children(recursive=True):
            with suppress(psutil.Error):
                if "webmap.gate" in child.cmdline():
                    return child
        return None

    def renderers(self):
        """The processes that draw pages."""
        everybody = psutil.Process(self.browser.process.pid).children(recursive=True)
        return [process for process in everybody if is_renderer(process)]

    # The operator.

    def press(self):
        self.tab.down("w")

    def let_go(self):
        self.causes.append(time.monotonic())
        self.tab.up("w")

    def repeat_press(self):
        """Send the repeated key event that a keyboard sends while W is held."""
        self.tab.call(
            "Input.dispatchKeyEvent",
            type="keyDown",
            key="w",
            code="KeyW",
            windowsVirtualKeyCode=ord("W"),
            text="w",
            autoRepeat=True,
        )

    def space(self, kind):
        """Press or release the space bar, which sends STOP."""
        self.tab.call(
            "Input.dispatchKeyEvent",
            type=kind,
            key=" ",
            code="Space",
            windowsVirtualKeyCode=32,
        )

    def reset_stop(self):
        """End the STOP, like the reset button, but over a second socket of the page.

        After STOP ALL other robots are reset too, until the selected robot is free.
        """
        self.tab.wait("document.body.innerText.includes('STOP active')")
        assert self.tab.evaluate(RESET) in {"free", "held", "stopping"}

    def end_repeated_stop(self):
        """End a STOP that the page sent again after it had lost its connection."""
        if self.tab.evaluate("document.body.innerText.includes('reset it first')"):
            self.reset_stop()

    def restore(self):
        """Start the display and open the page again if the previous test ended them."""
        self.robot_hop.release()
        self.web_hop.release()
        if self.display.popen.poll() is not None:
            self.end_display()
            self.start_display()
        if self.browser is not None and self.browser.process.poll() is not None:
            self.tab = None
            self.end_browser()
        if self.tab is None:
            self.open_page()
        elif not self.others_publish:
            text = self.tab.evaluate("document.body.innerText")
            assert "nother program" not in text, text

    def drive_off(self, within=30.0):
        """Hold W until the robot moves, and keep W pressed; if necessary, try again."""
        self.restore()
        deadline = time.monotonic() + within
        while time.monotonic() < deadline:
            pass_time(NEUTRAL)
            self.press()
            end_of_try = time.monotonic() + 2.5
            while time.monotonic() < end_of_try:
                if self.steady():
                    return
                pass_time(0.01)
            self.let_go()
        text = self.tab.evaluate("document.body.innerText")
        raise AssertionError(f"W does not drive the robot\n{text}\n{self.display.log}")

    def steady(self):
        """Return whether the robot received velocities without a gap for 0.4 s."""
        now = time.monotonic()
        recent = [
            velocity
            for velocity in self.robot.log.twists[-12:]
            if velocity.at > now - 0.4
        ]
        return (
            len(recent) >= 6
            and now - recent[-1].at < 0.1
            and not any(velocity.is_zero for velocity in recent)
        )


SLOW = Shape(latency=0.4)


def send_only(tab: Tab, method, **parameters):
    """Call a method of DevTools and do not wait for an answer."""
    message = {"id": next(tab._numbers), "method": method, "params": parameters}
    tab._socket.send(json.dumps(message))


def is_renderer(process: psutil.Process) -> bool:
    """Return whether a process is a renderer of pages and still runs."""
    try:
        return "--type=renderer" in process.cmdline()
    except (psutil.ZombieProcess, psutil.NoSuchProcess):
        return False
