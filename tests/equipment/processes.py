"""Commands of WebMap as processes, and helpers for their pages."""

import os
import re
import select
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Page

from equipment.chromium import end_stops
from equipment.waiting import polls

EXAMPLES = Path(__file__).parents[2] / "examples"


class Process:
    """A command of WebMap that runs until the test ends it."""

    def __init__(
        self,
        *command: object,
        cwd: Path | None = None,
        module: str = "webmap",
        **environment: str,
    ) -> None:
        # No pipe: a pipe that is not read fills up and blocks the process.
        self._stderr = tempfile.TemporaryFile()  # noqa: SIM115 - closed at its end
        self.popen = subprocess.Popen(
            [sys.executable, "-m", module, *map(str, command)],
            stdout=subprocess.PIPE,
            stderr=self._stderr,
            cwd=cwd,
            start_new_session=True,
            env={**os.environ, "PYTHONUNBUFFERED": "1", **environment},
        )
        self._log = b""

    def ready(self, pattern: str, within: float = 30.0) -> str:
        """Wait for the line that reports readiness; return the URL in the line."""
        stdout = self.popen.stdout
        output = b""
        printed = lambda: f"{pattern!r} in {output!r}\n{self.log}"  # noqa: E731
        for _ in polls(printed, within, 0.1):
            if not select.select([stdout], [], [], 0.1)[0]:
                continue
            chunk = os.read(stdout.fileno(), 4096)
            output += chunk
            if match := re.search(pattern, output.decode()):
                return match[1]
            assert chunk, f"the output ends without {printed()}"

    @property
    def log(self) -> str:
        """The standard error of the process so far."""
        if not self._stderr.closed:
            # No seek: the process shares the position of this file.
            size = os.fstat(self._stderr.fileno()).st_size
            self._log = os.pread(self._stderr.fileno(), size, 0)
        return self._log.decode(errors="replace")

    def end(self, sig: int = signal.SIGINT) -> int:
        """End the process as a person would; return its exit code."""
        if self.popen.poll() is None:
            self.popen.send_signal(sig)
        try:
            code = self.popen.wait(60)  # the machine may be busy
        except subprocess.TimeoutExpired:
            self.popen.kill()
            self.popen.wait()
            raise
        finally:
            self.log  # noqa: B018 - keeps what it wrote last
            self.popen.stdout.close()
            self._stderr.close()
        return code


@contextmanager
def running(
    *command: object,
    pattern: str,
    cwd: Path | None = None,
    module: str = "webmap",
) -> Iterator:
    process = Process(*command, cwd=cwd, module=module)
    try:
        process.url = process.ready(pattern)
        yield process
    finally:
        if process.popen.stdout.closed is False:
            process.end()
        print(process.log)


WEB = r"WebMap is ready at (\S+)\n"
BRIDGE = r"rosbridge is ready at (\S+)\n"


@contextmanager
def serving(script: str, bridge: str, folder: Path) -> Iterator:
    """Run an example unchanged, except for the URL of the rosbridge.

    Args:
        script: The path of the example below the examples.
        bridge: The rosbridge's URL.
        folder: The folder for the copy.

    """
    shutil.copytree((EXAMPLES / script).parent, folder, dirs_exist_ok=True)
    copy = folder / Path(script).name
    text = copy.read_text()
    assert text.count("ws://localhost:9090") == 1
    copy.write_text(text.replace("ws://localhost:9090", bridge))
    with running("run", copy, "--port", 0, "--no-browser", pattern=WEB) as process:
        yield process


def matrix(tab: Page, selector: str) -> list[float]:
    """Return the matrix of an element's own transform, as the browser draws it."""
    return tab.locator(selector).first.evaluate(
        # Not consolidate(), which would replace the objects that the client keeps.
        "e => { let m = new DOMMatrix();"
        " for (const t of e.transform.baseVal) m.multiplySelf(t.matrix);"
        " return [m.a, m.b, m.c, m.d, m.e, m.f]; }"
    )


def place_on_screen(tab: Page, selector: str) -> tuple[float, float]:
    """Return the place of an SVG element's origin in the window, in pixels."""
    x, y = tab.locator(selector).evaluate(
        "e => { const m = e.getScreenCTM(); return [m.e, m.f]; }"
    )
    return x, y


def reset(tab: Page) -> None:
    """End the STOP of the selected robot with two presses, as a person does."""
    button = tab.locator(".webmap-teleop .webmap-reset")
    button.click(trial=True)  # waits until a person could click
    end_stops(button)
