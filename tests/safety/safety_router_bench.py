"""An operator drives an agent's robot in Chromium, beside hostile users of its router.

::

    Chromium ── display ── router, TLS and users ── agent bay3 ── gate ── witness robot
                   │              │
              hostile viewer      └── hostile agent bay4, hostile display of "east"

The robot never stops by itself. The user "east" may look at the robot of bay 3 and may
not drive it: the agent has ``--operators west``.
"""

import contextlib
import os
import subprocess
import sys
from pathlib import Path

import psutil
from safety_bench import pass_time
from safety_hostile import READY, RECORD_TICKS, SETTLE
from safety_proof import ProvingBench
from safety_waiting import Waiting

from equipment.processes import WEB, Process

HERE = Path(__file__).parent
TLS = HERE.parent / "agents" / "tls"

USERS = """
[users.bay3]
password = "bay3"
agent = "bay3"

[users.bay4]
password = "bay4"
agent = "bay4"

[users.west]
password = "west"
drives = ["bay3", "bay4"]

[users.east]
password = "east"
drives = ["bay3"]
"""

SELECT = """
(document.querySelector('#robots .row button[aria-pressed="true"]') ||
 [...document.querySelectorAll("#robots .row")]
     .find((row) => row.textContent.includes("Bob (bay3)"))
     ?.querySelector("button")?.click(),
 document.querySelector(".robot.selected") !== null)
"""
"""Selects the good robot in the console; true when it is selected."""


TICKS_OF_THE_AGENT = RECORD_TICKS.replace(
    """'{"op":"tick"')""", """'{"op":"tick"') && text.includes('"gate":"bay3"')"""
)


def as_user(name):
    """Return the environment of a user of the router."""
    return {
        "WEBMAP_ROUTER_USER": name,
        "WEBMAP_ROUTER_PASSWORD": name,
        "WEBMAP_ROUTER_CA": str(TLS / "ca.pem"),
    }


class RouterBench(ProvingBench):
    """All processes between the operator and the robot."""

    stops_all = False
    """Whether the operator presses Shift+Esc, which stops all robots, for STOP."""

    def __init__(self, folder):
        super().__init__(folder, timeout=None)
        self.router = self.agent = None

    def start_display(self):
        if self.router is None:
            self._open.callback(self._end_far)
            self._start_far()
        port = self.display_port if self.display else 0
        self.display = Process(
            "view",
            self.place,
            "--port",
            port,
            "--no-browser",
            **as_user("west"),
            WEBMAP_STATE_DIR=str(self._folder / "display"),
        )
        self.url = self.display.ready(WEB)
        self.display_port = int(self.url.split("/")[2].split(":")[1])

    def _start_far(self):
        users = self._folder / "users.toml"
        users.write_text(USERS)
        self.router = Process(
            "router",
            "--listen",
            "tls/127.0.0.1:0",
            "--users",
            users,
            "--tls-cert",
            TLS / "router.pem",
            "--tls-key",
            TLS / "router.key",
        )
        self.place = self.router.ready(r"is ready at (zenohs://127\.0\.0\.1:\d+)")
        self.agent = Process(
            "agent",
            f"ws://127.0.0.1:{self.robot_hop.port}",
            "--router",
            self.place,
            "--name",
            "bay3",
            "--robot",
            "Bob:/odom:/cmd_vel:",
            "--stops-within",
            "0.5",
            "--operators",
            "west",
            **as_user("bay3"),
            WEBMAP_STATE_DIR=str(self._folder / "agent"),
        )
        self.agent.ready("The agent (bay3) is ready")

    def _end_far(self):
        for process in (self.agent, self.router):
            if process is not None and not process.popen.stdout.closed:
                process.end()
                print(process.log)

    def open_page(self, before=""):
        if self.browser is None:
            self.start_browser()
        self.tab = self.browser.new_tab()
        self.tab.call(
            "Page.addScriptToEvaluateOnNewDocument", source=TICKS_OF_THE_AGENT
        )
        self.tab.go(self.url.replace(str(self.display_port), str(self.web_hop.port)))
        self.tab.wait(SELECT)

    def space(self, kind):
        if not self.stops_all:
            super().space(kind)
            return
        self.tab.call(
            "Input.dispatchKeyEvent",
            type=kind,
            key="Escape",
            code="Escape",
            modifiers=8,
            windowsVirtualKeyCode=27,
        )

    def waiting(self):
        begun = [each.popen for each in (self.router, self.agent, self.display)]
        pids = [os.getpid()]
        for popen in (*begun, self.browser.process):
            process = psutil.Process(popen.pid)
            pids += [popen.pid, *(each.pid for each in process.children(True))]
        return Waiting(pids)

    def memory(self):
        """Return the memory of the agent and its gate, in bytes."""
        agent = psutil.Process(self.agent.popen.pid)
        return sum(
            each.memory_info().rss for each in (agent, *agent.children(recursive=True))
        )

    @contextlib.contextmanager
    def beside(self, *users):
        """Let hostile users act; each is ``user:function`` of safety_router_users."""
        with contextlib.ExitStack() as open:
            for each in users:
                open.enter_context(self._acting(*each.split(":")))
            self.close_page()
            self.open_page()
            pass_time(SETTLE)
            self.tab.wait(READY)
            yield

    @contextlib.contextmanager
    def _acting(self, user, name):
        with subprocess.Popen(
            [
                sys.executable,
                HERE / "safety_router_users.py",
                name,
                self.place,
                self.url,
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **as_user(user)},
            text=True,
        ) as process:
            try:
                assert process.stdout.readline() == "ready\n"
                yield
            finally:
                process.kill()
