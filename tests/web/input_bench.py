"""A page with inputs in a real Chromium, and the events that block inputs."""

import time
from collections.abc import Callable
from contextlib import suppress

from fake_drive import FakeDrive
from playwright.sync_api import Browser, Page

from equipment.chromium import Complaints
from equipment.waiting import wait_for

INPUT_BLOCKERS = {
    "blur": "window.dispatchEvent(new Event('blur'))",
    "pagehide": "window.dispatchEvent(new PageTransitionEvent('pagehide'))",
    "freeze": "document.dispatchEvent(new Event('freeze'))",
    "context menu": "document.body.dispatchEvent(new MouseEvent('contextmenu'))",
    "drag": """
        const drag = new DragEvent('dragstart', {bubbles: true, cancelable: true});
        document.body.dispatchEvent(drag);
    """,
    "text field": "document.getElementById('text').focus()",
    "lost focus": "document.hasFocus = () => false",
    "hidden": """
        Object.defineProperty(document, 'visibilityState', {value: 'hidden'});
        document.dispatchEvent(new Event('visibilitychange'));
    """,
    "dialog": """
        const dialog = document.createElement('dialog');
        document.body.append(dialog);
        dialog.showModal();
    """,
    "busy page": "for (const t = performance.now(); performance.now() < t + 500;);",
}


class Bench:
    """A page with a map and the modules under test."""

    def __init__(self, browser: Browser, gate: FakeDrive, query: str, **kw) -> None:
        self.gate = gate
        self.complaints = Complaints()
        self.context = browser.new_context(**kw)
        self.complaints.listen(self.context)
        self.page: Page = self.context.new_page()
        self.page.goto(gate.url + query)
        self.page.wait_for_selector("body[data-ready=yes]")
        self.until(lambda: self.state == "open")
        self.page.wait_for_timeout(250)  # inputs are blocked for a moment after loading

    @property
    def state(self) -> str:
        return self.page.evaluate("bench.drive.state")

    def until(self, true: Callable[[], object], patience: float = 10.0) -> None:
        last = lambda: f"the condition; last messages: {self.gate.received[-3:]}"  # noqa: E731
        wait_for(true, last, patience, self.page)

    def select(self, robot: str | None, map: int = 0) -> None:
        self.page.evaluate("([m, r]) => bench.maps[m].select(r)", [map, robot])

    def view(self) -> dict:
        return self.page.evaluate("bench.maps[0].view")

    def shown(self) -> str:
        return self.page.locator(".webmap-teleop").first.get_attribute("data-state")

    def drive(self) -> float:
        """Hold W until the robot moves; return the time at which it moved."""
        self.select("r1")
        self.hold("w", self.gate.moves)
        return time.monotonic()

    def hold(self, key: str, true: Callable[[], object]) -> None:
        """Press a key until a condition is true, and keep holding the key."""
        for _ in range(5):
            self.page.keyboard.down(key)
            with suppress(AssertionError):
                self.until(true, patience=1.5)
                return
            # On a busy machine the page may pause for a moment, which blocks inputs.
            self.page.keyboard.up(key)
            self.page.wait_for_timeout(300)
        raise AssertionError(f"{key} never drove: {self.gate.received[-3:]}")

    @property
    def losses(self) -> int:
        """The number of lost connections, as a lost connection is soon open again."""
        return self.page.evaluate("bench.losses()")

    def cut(self) -> None:
        """Cut the page's connection, and wait until the page has detected it."""
        before = self.losses
        self.gate.drop()
        self.until(lambda: self.losses > before)

    def still(self, seconds: float = 0.6, tolerance: float = 0.0) -> None:
        """Check that the page sends no command that moves a robot from now on.

        A busy gate may receive earlier commands later.
        """
        since = self.page.evaluate("performance.now()") + 1000 * tolerance
        self.page.wait_for_timeout(1000 * (seconds + tolerance))
        assert self.page.evaluate("(since) => bench.moves(since)", since) == []

    def neutral_within(self, ms: float) -> None:
        """Check the time from the last key or mark to a neutral command."""
        self.until(lambda: self.page.evaluate("bench.neutralDelay()"))
        delay, jitter = self.page.evaluate("bench.neutralDelay()")
        # The delay of timers on this machine is added to the limit.
        assert delay <= ms + jitter
