"""The parts of a script: a display with its gate, pages, robots and a recorder."""

import asyncio
import contextlib
import sys
from pathlib import Path

import psutil
import wires_robots
from wires_page import Page
from wires_recording import joined, sections
from wires_robot import Robot
from wires_tap import FROM_GATE, Tap, lanes_of, settled

import webmap
from equipment.waiting import wait_for
from webmap.core.runtime import runtime

sys.path.append(str(Path(__file__).parents[1]))

PATIENCE = 10.0
"""Seconds until a wait times out."""

CALM = 1.5
"""Seconds without a change after which a text without a recording is complete."""

STILL = 0.3
"""Seconds for which a text equal to the recording must stay the same."""


NOWHERE = "ws://127.0.0.1:9"
"""The address of a bridge that does not answer."""


class Bench:
    """A running display, which plays one script after the other.

    Args:
        recordings: Returns the recording of a script, or an empty text.

    """

    def __init__(self, recordings):
        self.tap = Tap()
        self._recordings = recordings
        self._pages = []
        self._fresh = True
        self._open = contextlib.ExitStack()

    def __enter__(self):
        from equipment.server_fakes import running
        from webmap.core.operators import Viewer

        def authenticate(scope):
            headers = dict(scope["headers"])
            name, role = headers[b"x-name"].decode(), headers[b"x-role"].decode()
            return Viewer(f"viewer-{name}", name, role)

        @webmap.page("/")
        def main(page):
            map = webmap.Map(page.element("webmap_container"))
            map.add_module("Teleop", 0.125, 1.0)

        self.tap.tap_the_pipe()
        self.early = wires_robots.of_twist(wires_robots.bridge_to(NOWHERE), "Early")
        """A robot that was declared before WebMap was started."""
        app = webmap.asgi_app(authenticate=authenticate)
        self.port = self._open.enter_context(running(app)).port
        self.until(lambda: "ready" in self.tap.channels()[FROM_GATE], "the gate")
        return self

    def __exit__(self, *exception):
        self._open.close()

    def play(self, name, script):
        """Run a script and return its recording."""
        if not self._fresh:  # the first recording includes the start
            self.tap.begin()
        self._fresh = False
        self._expected = sections(self._recordings(name))
        self._robots, self._bridges, self._pages = [], {}, []
        self._reports = {}
        with contextlib.ExitStack() as self._of_script:
            try:
                script(self)
                expected = joined(self._expected)
                return settled(self._text, expected, PATIENCE, CALM, STILL)
            finally:
                for page in self._pages:
                    page.close()
                for robot in self._robots:
                    self.model(wires_robots.gone, robot)
                self.until(lambda: not self.tap.reports, "a gate without robots")

    # For scripts.

    def site(self, label="robot", **options):
        """Return a robot's side of a rosbridge, and the program's bridge to it."""
        robot = self._of_script.enter_context(Robot(**options))
        self._bridges[label] = robot
        self.tap.names.call(f"ws://127.0.0.1:{robot.port}", f"ws://{label}")
        return robot, self.model(wires_robots.bridge_to, robot.url)

    def robot(self, make, *args, **options):
        """Return a robot of the program."""
        robot = self.model(make, *args, **options)
        self.end_with(robot)
        return robot

    def end_with(self, robot):
        """Remove a robot at the end of the script."""
        self._robots.append(robot)

    def page(self, name, role="operator"):
        """Open a page and return it."""
        page = Page(self, name, role)
        self._pages.append(page)
        self.until(lambda: page.greeted and page.tick, "the first tick")
        return page

    def model(self, fn, *args, **options):
        """Call a function in the thread of the program and return its result."""

        async def called():
            return fn(*args, **options)

        return self.run(called())

    def run(self, work):
        """Run a coroutine in the thread of the program."""
        loop = runtime._loop
        return asyncio.run_coroutine_threadsafe(work, loop).result(30)

    def until(self, check, what, seconds=PATIENCE):
        """Wait until ``check`` returns a true value, and return the value."""
        refused = lambda: [page.refusals for page in self._pages]  # noqa: E731
        return wait_for(check, lambda: f"{what}; refused: {refused()}", seconds)

    def kill_the_gate(self):
        """Kill the gate's process."""
        for child in psutil.Process().children():
            if "webmap.gate" in child.cmdline():
                child.kill()

    def tasks_up(self, site, topic):
        """Wait until the gate can send goals: it has advertised a topic for them."""
        self.until(lambda: site.received("advertise", topic), f"the lane of {topic}")

    def shows(self, label, page, robot, check):
        """Record a page's report of a robot when the check holds and it is stable."""

        def report():
            return page.report(robot)

        self._note(f"report to {page.name}: {label}", report, check)

    def reports(self, label, robot, check):
        """Record the gate's newest report of a robot in the same way."""

        def report():
            return self.tap.reports.get(robot.id, {})

        self._note(f"report: {label}", report, check)

    def note(self, title, text):
        """Record a text of the script itself."""
        self._reports[title] = text

    def _note(self, title, report, check):
        def text():
            found = report()
            return self.tap.report(found) if found else ""

        def holds():
            found = report()
            return bool(found and check(found))

        self.until(holds, title)
        expected = self._expected.get(title, "")
        self._reports[title] = settled(
            text, expected, PATIENCE / 2, CALM / 2, good=holds
        )

    def _text(self):
        parts = dict(self.tap.channels())
        for label, robot in self._bridges.items():
            parts |= lanes_of(self.tap.names, label, robot)
        return joined({**parts, **self._reports})
