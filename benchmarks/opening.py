"""The time until a page shows a robot: the console, the demo and a bare page.

The bare page is an HTML file with one module, which opens a socket and shows the data
from it: no page that receives its robots over a socket can be faster. Both are opened
in a browser that runs already and has stored nothing, on this machine, and over a link
that Chromium simulates, with a round trip of 100 ms and 1.6 Mbit/s. A browser that has
just started is slower for its first second, with any page.

``webmap demo`` is measured from its command, beside the command that serves the bare
page, ``python -m benchmarks.opening``.
"""

import socket
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

import psutil
import uvicorn
from playwright.sync_api import Browser, ConsoleMessage, Page
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from benchmarks.display import display
from benchmarks.drawing import browser_page
from benchmarks.harness import Comparison, Contender, Figures, compare
from benchmarks.processes import module, started

ROBOTS = 10
BEAMS = 360

ROUND_TRIP_MS = 100
BYTES_A_SECOND = 200_000

HTML = """<!doctype html><meta charset="utf-8"><title>Bare</title>
<script type="module" src="bare.js"></script><body></body>"""

MODULE = """
const socket = new WebSocket(new URL("socket", location.href));
socket.addEventListener("open", () => socket.send("hello"));
socket.addEventListener("message", ({ data }) => {
  const robot = document.createElement("p");
  robot.className = "robot";
  robot.textContent = data;
  document.body.append(robot);
});
"""

FIRST_ROBOT = "first robot after "

WATCH = f"""
const look = () => {{
  if (document.querySelector(".robot:not(.unplaced)")) {{
    console.debug("{FIRST_ROBOT}" + performance.now());
  }} else requestAnimationFrame(look);
}};
look();
"""
"""Reports by a message of the console. A locator would evaluate a large script of
Playwright's in the page, which takes 30 ms and more while the page loads."""


async def _page(request: Request) -> Response:
    del request
    return HTMLResponse(HTML)


async def _module(request: Request) -> Response:
    del request
    return Response(MODULE, media_type="text/javascript")


async def _socket(websocket: WebSocket) -> None:
    await websocket.accept()
    await websocket.receive_text()
    await websocket.send_text("robot")
    await websocket.receive()


@contextmanager
def bare_page() -> Iterator[str]:
    """Serve the bare page on a free port; return its URL."""
    app = Starlette(
        routes=[
            Route("/", _page),
            Route("/bare.js", _module),
            WebSocketRoute("/socket", _socket),
        ]
    )
    listener = socket.socket()
    listener.bind(("127.0.0.1", 0))
    listener.listen()
    server = uvicorn.Server(
        uvicorn.Config(app, log_level="warning", lifespan="off", ws="websockets-sansio")
    )
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
    thread.start()
    try:
        yield f"http://127.0.0.1:{listener.getsockname()[1]}/"
    finally:
        server.should_exit = server.force_exit = True
        thread.join()
        listener.close()


def is_first_robot(message: ConsoleMessage) -> bool:
    """Return whether a message of the browser's console is that of ``WATCH``."""
    return message.text.startswith(FIRST_ROBOT)


def measure(page: Page, url: str, *, slow: bool) -> Figures:
    """Open a page; return the time until its first robot, and the amount of data."""
    session = page.context.new_cdp_session(page)
    sizes: list[float] = []
    before: list[float] = []  # the first robot

    def loaded(event: dict[str, float]) -> None:
        sizes.append(event["encodedDataLength"])

    def message(event: ConsoleMessage) -> None:
        if is_first_robot(event):
            before[:] = sizes

    session.on("Network.loadingFinished", loaded)
    page.on("console", message)
    session.send("Network.enable")
    if slow:
        session.send(
            "Network.emulateNetworkConditions",
            {
                "offline": False,
                "latency": ROUND_TRIP_MS,
                "downloadThroughput": BYTES_A_SECOND,
                "uploadThroughput": BYTES_A_SECOND,
            },
        )
    page.add_init_script(WATCH)
    with page.expect_console_message(is_first_robot) as seen:
        page.goto(url, wait_until="commit")
    page.wait_for_timeout(2000 if slow else 1000)  # for the features
    return {
        "first robot (ms)": float(seen.value.text.removeprefix(FIRST_ROBOT)),
        "requests before the first robot": len(before),
        "loaded before the first robot (kB)": sum(before) / 1000,
        "requests in all": len(sizes),
        "loaded in all (kB)": sum(sizes) / 1000,
    }


Command = Callable[[], AbstractContextManager[tuple[str, object]]]
"""Runs a command; its context yields the address of its page, and its process."""


def bare_command() -> AbstractContextManager[tuple[str, psutil.Process]]:
    """Run this module, which serves the bare page."""
    return module("benchmarks.opening")


@contextmanager
def demo_command() -> Iterator[tuple[str, psutil.Process]]:
    """Run ``webmap demo``."""
    options = ("--port", "0", "--no-browser", "--quiet")
    with (
        tempfile.TemporaryDirectory() as state,
        started("demo", *options, state=state) as running,
    ):
        yield running


def commanded(browser: Browser, command: Command) -> Callable[[], Figures]:
    """Return a run that starts a command and opens its page."""

    def run() -> Figures:
        with browser.new_context() as context:
            page = context.new_page()
            page.add_init_script(WATCH)
            page.wait_for_timeout(700)  # until the window is there
            begun = time.monotonic()
            with command() as (url, _):
                with page.expect_console_message(is_first_robot):
                    page.goto(url, wait_until="commit")
                took = time.monotonic() - begun
        return {"first robot (ms)": 1000 * took}

    return run


def opened(browser: Browser, url: str, *, slow: bool) -> Callable[[], Figures]:
    """Return a run that opens a page with an empty cache."""

    def run() -> Figures:
        with browser.new_context() as context:
            page = context.new_page()
            page.wait_for_timeout(700)  # until the window is there
            return measure(page, url, slow=slow)

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare the console with the bare page, without and with a slow link."""
    robots = 2 if quick else ROBOTS
    link = f"{ROUND_TRIP_MS} ms and {BYTES_A_SECOND * 8 / 1e6} Mbit/s"
    with (
        bare_page() as bare,
        display(robots, BEAMS, console=True) as shown,
        browser_page() as page,
    ):
        browser = page.context.browser
        assert browser is not None
        # Until the robots, the files and the browser are ready.
        opened(browser, shown.url, slow=False)()
        pages = [
            compare(
                f"opening a page, {where}",
                [
                    Contender("bare page", opened(browser, bare, slow=slow)),
                    Contender("console", opened(browser, shown.url, slow=slow)),
                ],
                rounds,
            )
            for where, slow in (("on this machine", False), (link, True))
        ]
    with browser_page() as page:
        browser = page.context.browser
        assert browser is not None
        commanded(browser, demo_command)()  # until the files and the browser are ready
        commands = [
            Contender("bare page", commanded(browser, bare_command)),
            Contender("webmap demo", commanded(browser, demo_command)),
        ]
        return [*pages, compare("from a command to its first robot", commands, rounds)]


def main() -> None:
    """Serve the bare page until killed; print its address."""
    with bare_page() as url:
        print(url, flush=True)
        threading.Event().wait()


if __name__ == "__main__":
    main()
