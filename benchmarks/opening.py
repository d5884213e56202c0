"""The time until an opened page shows a robot: the console and a bare page.

The bare page is an HTML file with one module, which opens a socket and shows the data
from it: no page that receives its robots over a socket can be faster. Both are opened
in a browser that runs already and has stored nothing, on this machine, and over a link
that Chromium simulates, with a round trip of 100 ms and 1.6 Mbit/s. A browser that has
just started is slower for its first second, with any page.
"""

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import uvicorn
from playwright.sync_api import Browser, Page
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket

from benchmarks.display import display
from benchmarks.drawing import browser_page
from benchmarks.harness import Comparison, Contender, Figures, compare

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


def measure(page: Page, url: str, *, slow: bool) -> Figures:
    """Open a page; return the time until its first robot, and the amount of data."""
    session = page.context.new_cdp_session(page)
    sizes: list[float] = []
    session.on(
        "Network.loadingFinished",
        lambda event: sizes.append(event["encodedDataLength"]),
    )
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
    with page.expect_console_message(
        lambda message: message.text.startswith(FIRST_ROBOT)
    ) as seen:
        page.goto(url, wait_until="commit")
    page.wait_for_timeout(2000 if slow else 1000)  # for the features
    return {
        "first robot (ms)": float(seen.value.text.removeprefix(FIRST_ROBOT)),
        "requests in all": len(sizes),
        "loaded in all (kB)": sum(sizes) / 1000,
    }


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
        return [
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
