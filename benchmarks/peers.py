"""Other ways to show moving robots in a browser: NiceGUI, viser, and ros2d.

NiceGUI and viser, like WebMap, have a Python server, which computes the positions.
ros2d draws the data of a rosbridge in the browser; WebMap gets the same data from the
same rosbridge. Each has one viewer, and robots at 10 Hz. A line before each server
counts the bytes. The peers are no dependencies: ``make bench-peers`` installs them.
"""

import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import psutil
from playwright.sync_api import Page

from benchmarks.display import BRIDGED, FLEET, running, stamped
from benchmarks.drawing import browser_page
from benchmarks.harness import Comparison, Contender, Figures, compare
from benchmarks.line import Line
from benchmarks.peer_server import RATE
from benchmarks.processes import used

ROOT = Path(__file__).parents[1]
PEERS = ROOT / ".venv-peers"
PYTHON = PEERS / "bin" / "python"

ROBOTS = 100
"""The number of robots."""

SETTLED = 3.0
"""Seconds from opening a page to the measurement."""

HOW = "run `make bench-peers`"

SCRIPTS = (
    ROOT / "node_modules/eventemitter2/lib/eventemitter2.js",
    ROOT / "node_modules/roslib/build/roslib.min.js",
    PEERS / "node_modules/easeljs/lib/easeljs.min.js",
    PEERS / "node_modules/ros2d/build/ros2d.min.js",
    Path(__file__).parent / "ros2d.js",
)
"""The scripts that the page of ros2d loads."""

SERVER = "server, a robot's update (us)"
BYTES = "bytes to the viewer (kB a second)"
THREAD = "main thread of the browser (ms a second)"


def has(package: str) -> bool:
    """Return whether the Python package of a peer is installed."""
    if not PYTHON.exists():
        return False
    asked = subprocess.run([PYTHON, "-c", f"import {package}"], capture_output=True)
    return asked.returncode == 0


def main_thread(page: Page, seconds: float) -> float:
    """Return the milliseconds a second that the main thread of a page is busy."""
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable")

    def now() -> tuple[float, float]:
        metrics = session.send("Performance.getMetrics")["metrics"]
        values = {each["name"]: each["value"] for each in metrics}
        return values["TaskDuration"], values["Timestamp"]

    before = now()
    page.wait_for_timeout(seconds * 1000)
    after = now()
    return 1000 * (after[0] - before[0]) / (after[1] - before[1])


def through(line: Line, url: str) -> str:
    """Return an address with the port of a line."""
    parts = urlsplit(url)
    return parts._replace(netloc=f"{parts.hostname}:{line.port}").geturl()


@contextmanager
def peer(name: str, robots: int) -> Iterator[tuple[str, psutil.Process]]:
    """Run the server of a peer; yield the address of its page, and its process."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    script = Path(__file__).parent / "peer_server.py"
    with subprocess.Popen(
        [PYTHON, script, name, str(robots), str(port)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        try:
            deadline = time.monotonic() + 60
            while True:
                try:
                    socket.create_connection(("127.0.0.1", port)).close()
                    break
                except OSError:
                    if time.monotonic() > deadline or process.poll() is not None:
                        raise
                    time.sleep(0.1)
            yield f"http://127.0.0.1:{port}/", psutil.Process(process.pid)
        finally:
            process.terminate()


@contextmanager
def fleet(robots: int) -> Iterator[tuple[str, psutil.Process]]:
    """Run WebMap with robots whose positions it computes."""
    with running(
        FLEET,
        FLEET_ROBOTS=str(robots),
        FLEET_BEAMS="0",
        FLEET_TICK=str(1 / RATE),
    ) as shown:
        yield shown.url, shown.process


def served(name: str, robots: int, seconds: float) -> Callable[[], Figures]:
    """Return a run of one server with one viewer."""

    def run() -> Figures:
        with ExitStack() as opened:
            server = fleet(robots) if name == "WebMap" else peer(name, robots)
            url, process = opened.enter_context(server)
            line = opened.enter_context(Line(urlsplit(url).port or 0))
            page = opened.enter_context(browser_page(webgl=True))
            page.goto(through(line, url))
            page.wait_for_timeout(1000 * SETTLED)
            before, sent, begun = used(process), line.down.bytes, time.monotonic()
            busy = main_thread(page, seconds)
            took = time.monotonic() - begun
            spent, sent = used(process) - before, line.down.bytes - sent
        if not sent:
            raise RuntimeError(f"{name} sent nothing")
        return {
            SERVER: 1e6 * spent / took / RATE / robots,
            BYTES: sent / took / 1000,
            THREAD: busy,
        }

    return run


def drawn_by_ros2d(robots: int, seconds: float) -> Callable[[], Figures]:
    """Return a run of ros2d, connected to a rosbridge."""

    def run() -> Figures:
        with ExitStack() as opened:
            url = opened.enter_context(stamped(robots))
            line = opened.enter_context(Line(urlsplit(url).port or 0))
            page = opened.enter_context(browser_page(webgl=True))
            for script in SCRIPTS:
                page.add_script_tag(path=script)
            page.evaluate(
                "([url, robots]) => show(url, robots)", [through(line, url), robots]
            )
            page.wait_for_timeout(1000 * SETTLED)
            if not page.evaluate("globalThis.seen"):
                raise RuntimeError("ros2d got no message")
            return _page_figures(page, line, seconds)

    return run


def drawn_by_webmap(robots: int, seconds: float) -> Callable[[], Figures]:
    """Return a run of WebMap with the same rosbridge."""

    def run() -> Figures:
        with ExitStack() as opened:
            bridge = opened.enter_context(stamped(robots))
            shown = opened.enter_context(
                running(BRIDGED, BRIDGED_URL=bridge, BRIDGED_ROBOTS=str(robots))
            )
            line = opened.enter_context(Line(urlsplit(shown.url).port or 0))
            page = opened.enter_context(browser_page(webgl=True))
            page.goto(through(line, shown.url))
            page.wait_for_timeout(1000 * SETTLED)
            return _page_figures(page, line, seconds)

    return run


def _page_figures(page: Page, line: Line, seconds: float) -> Figures:
    sent, begun = line.down.bytes, time.monotonic()
    busy = main_thread(page, seconds)
    took = time.monotonic() - begun
    return {BYTES: (line.down.bytes - sent) / took / 1000, THREAD: busy}


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare WebMap with the peers that are installed."""
    seconds = 2.0 if quick else 4.0
    servers = ["WebMap"]
    for name in ("nicegui", "viser"):
        if has(name):
            servers.append(name)
        else:
            print(f"{name} is left out, because it is not installed: {HOW}")
    robots = 20 if quick else ROBOTS
    contenders = [Contender(name, served(name, robots, seconds)) for name in servers]
    title = f"{robots} robots at {RATE} Hz, one viewer"
    found = [compare(title, contenders, rounds)]
    if not all(path.exists() for path in SCRIPTS):
        print(f"ros2d is left out, because it is not installed: {HOW}")
        return found
    drawn = [
        Contender("WebMap", drawn_by_webmap(robots, seconds)),
        Contender("ros2d", drawn_by_ros2d(robots, seconds)),
    ]
    title = f"{robots} robots of a rosbridge at {RATE} Hz, one viewer"
    return [*found, compare(title, drawn, rounds)]
