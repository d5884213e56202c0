"""Main-thread time in Chromium: WebMap's page compared with bare elements.

Robots with scans of 360 points at 10 Hz and poses at 20 Hz, compared with a circle for
each dot; and many robots without scans, compared with a group for each robot whose
``transform`` is set in each frame. Both draw at most 20 frames a second, each in one
animation frame; a page that is too slow draws fewer. WebMap's time includes the socket,
the decoding and the acknowledgement; the other page has none of these. The time is
processor time of the thread, so other programs change it little.
"""

import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from playwright.sync_api import Page, ViewportSize, sync_playwright

from benchmarks.display import display
from benchmarks.harness import Comparison, Contender, Figures, compare

SOME = 50
MANY = 500
BEAMS = 360
CIRCLES = Path(__file__).parent / "circles.js"
GROUPS = Path(__file__).parent / "groups.js"

# A page acknowledges each drawn frame; the acknowledgements are counted.
COUNT_FRAMES = """
globalThis.framesDrawn = 0;
const send = WebSocket.prototype.send;
WebSocket.prototype.send = function (data) {
  if (typeof data === "string" && data.includes('"seen"')) globalThis.framesDrawn++;
  return send.call(this, data);
};
"""

# Elements outside the window are not drawn, so they would cost too little.
OUT_OF_SIGHT = """
[...document.querySelectorAll("svg :not(.far) > circle[r='0.3']")].filter((model) => {
  const { left, top, right, bottom } = model.getBoundingClientRect();
  return left < 0 || top < 0 || right > innerWidth || bottom > innerHeight;
}).length
"""

WEBGL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""Arguments of Chromium."""

FIGURES = {
    "main thread a frame (ms)": "TaskDuration",
    "script a frame (ms)": "ScriptDuration",
    "style a frame (ms)": "RecalcStyleDuration",
    "layout a frame (ms)": "LayoutDuration",
}


@contextmanager
def browser_page(*, bypass_csp: bool = False, webgl: bool = False) -> Iterator[Page]:
    """Open a page in a separate Chromium.

    Args:
        bypass_csp: Whether the page may connect to what its server does not allow.
        webgl: Whether the page may draw with WebGL, which the processor computes.

    """
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"),
            args=["--no-sandbox", *(WEBGL if webgl else ("--disable-gpu",))],
        )
        try:
            size: ViewportSize = {"width": 1200, "height": 900}
            yield browser.new_page(viewport=size, bypass_csp=bypass_csp)
        finally:
            browser.close()


def wait_for_frames(page: Page, count: int = 5) -> None:
    """Wait until the page draws; polled from outside, because it may not use eval."""
    for _ in range(600):
        if page.evaluate("globalThis.framesDrawn") > count:
            return
        page.wait_for_timeout(100)
    raise RuntimeError(f"the page drew no {count} frames in a minute")


def measure(page: Page, seconds: float) -> Figures:
    """Return the figures for each frame that the page draws meanwhile."""
    wait_for_frames(page)
    if hidden := page.evaluate(OUT_OF_SIGHT):
        raise RuntimeError(f"{hidden} robots are outside the window")
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})

    def now() -> dict[str, float]:
        metrics = session.send("Performance.getMetrics")["metrics"]
        frames = page.evaluate("globalThis.framesDrawn")
        return {m["name"]: m["value"] for m in metrics} | {"frames": frames}

    before = now()
    page.wait_for_timeout(seconds * 1000)
    after = now()
    frames = after["frames"] - before["frames"]
    figures = {
        figure: (after[metric] - before[metric]) * 1000 / frames
        for figure, metric in FIGURES.items()
    }
    elapsed = after["Timestamp"] - before["Timestamp"]
    return figures | {"frames a second": frames / elapsed}


def webmap_page(robots: int, beams: int, seconds: float) -> Callable[[], Figures]:
    """Return a run of WebMap's own page."""

    def run() -> Figures:
        with display(robots, beams) as shown, browser_page() as page:
            page.add_init_script(COUNT_FRAMES)
            page.goto(shown.url)
            return measure(page, seconds)

    return run


def circle_page(robots: int, seconds: float) -> Callable[[], Figures]:
    """Return a run of a page with a circle for each dot."""

    def run() -> Figures:
        with browser_page() as page:
            page.add_script_tag(path=CIRCLES)
            page.evaluate(f"circles({robots}, {BEAMS})")
            return measure(page, seconds)

    return run


def group_page(robots: int, seconds: float) -> Callable[[], Figures]:
    """Return a run of a page with a group for each robot."""

    def run() -> Figures:
        with browser_page() as page:
            page.add_script_tag(path=GROUPS)
            page.evaluate(f"groups({robots})")
            return measure(page, seconds)

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare WebMap's drawing with circles, and with groups."""
    seconds = 2.0 if quick else 3.0
    robots = 20 if quick else SOME
    scans = [
        Contender("WebMap", webmap_page(robots, BEAMS, seconds)),
        Contender("circles", circle_page(robots, seconds)),
    ]
    small = [
        Contender("groups", group_page(MANY, seconds)),
        Contender("WebMap", webmap_page(MANY, 0, seconds)),
    ]
    return [
        compare(f"{robots} robots with scans of {BEAMS}", scans, rounds),
        compare(f"{MANY} robots that move, small on the screen", small, rounds),
    ]
