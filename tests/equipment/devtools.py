"""A Chromium that is controlled only by its DevTools protocol.

Playwright keeps every page focused and visible. Most tests need that, but a test of a
hidden page cannot use it.
"""

import itertools
import json
import re
import shutil
import signal
import subprocess
import tempfile
import urllib.request
from contextlib import ExitStack
from typing import Any

from websockets.sync.client import connect

from equipment.chromium import CHROMIUM_ARGS, chromium_path
from equipment.waiting import wait_for


class Tab:
    """One tab."""

    def __init__(self, about: dict[str, Any]) -> None:
        self.id = about["id"]
        self._open = ExitStack()
        link = connect(about["webSocketDebuggerUrl"], max_size=None)
        self._socket = self._open.enter_context(link)
        self._numbers = itertools.count(1)
        self.errors: list[str] = []
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol and return its result."""
        number = next(self._numbers)
        message = {"id": number, "method": method, "params": parameters}
        self._socket.send(json.dumps(message))
        while True:
            answer = json.loads(self._socket.recv(timeout=20))
            if answer.get("id") == number:
                assert "error" not in answer, f"{method}: {answer['error']}"
                return answer["result"]
            self._on_message(answer)

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression in the page."""
        result = self.call(
            "Runtime.evaluate",
            expression=expression,
            returnByValue=True,
            awaitPromise=True,
        )
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait(self, expression: str, within: float = 15.0) -> Any:
        """Wait until an expression is true in the page, and return its value."""
        return wait_for(lambda: self.evaluate(expression), expression, within)

    def go(self, url: str) -> None:
        """Open a URL."""
        self.call("Page.navigate", url=url)

    def key(self, kind: str, key: str) -> None:
        """Press (``keyDown``) or release (``keyUp``) a letter's key."""
        self.call(
            "Input.dispatchKeyEvent",
            type=kind,
            key=key,
            code=f"Key{key.upper()}",
            windowsVirtualKeyCode=ord(key.upper()),
            **({"text": key} if kind == "keyDown" else {}),
        )

    def down(self, key: str) -> None:
        """Press a letter's key."""
        self.key("keyDown", key)

    def up(self, key: str) -> None:
        """Release a letter's key."""
        self.key("keyUp", key)

    def click(self, x: float, y: float) -> None:
        """Click at a place of the window, in pixels."""
        for kind in ("mousePressed", "mouseReleased"):
            self.call(
                "Input.dispatchMouseEvent",
                type=kind,
                x=x,
                y=y,
                button="left",
                clickCount=1,
            )

    def close(self) -> None:
        """Disconnect from the tab; it stays open."""
        self._open.close()

    def _on_message(self, event: dict[str, Any]) -> None:
        method, about = event.get("method"), event.get("params", {})
        if method == "Runtime.exceptionThrown":
            self.errors.append(str(about["exceptionDetails"]))
        if method == "Log.entryAdded" and about["entry"]["level"] == "error":
            self.errors.append(about["entry"]["text"])


class Chromium:
    """A browser with tabs, as a context manager."""

    def __enter__(self) -> "Chromium":
        self._folder = tempfile.mkdtemp(prefix="webmap-chromium-")
        self.process = subprocess.Popen(
            [
                chromium_path(),
                "--headless",
                *CHROMIUM_ARGS,
                "--window-size=1200,900",
                "--remote-debugging-port=0",
                f"--user-data-dir={self._folder}",
                "about:blank",
            ],
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        for line in self.process.stderr:
            found = re.search(r"listening on ws://([^/]+)/", line)
            if found:
                self._address = found[1]
                break
        return self

    def __exit__(self, *exception: object) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.process.stderr.close()
        shutil.rmtree(self._folder, ignore_errors=True)

    def new_tab(self, url: str = "about:blank") -> Tab:
        """Open a tab in front of the others."""
        return Tab(self._ask(f"new?{url}", "PUT"))

    def activate(self, tab: Tab) -> None:
        """Bring a tab to the front."""
        self._ask(f"activate/{tab.id}")

    def _ask(self, what: str, method: str = "GET") -> dict[str, Any]:
        url = f"http://{self._address}/json/{what}"
        request = urllib.request.Request(url, method=method)
        with urllib.request.urlopen(request, timeout=10) as answer:
            body = answer.read()
        return json.loads(body) if body.startswith(b"{") else {}
