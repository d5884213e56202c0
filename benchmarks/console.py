"""The time until the console shows the effect of an input: select, filter and pan.

A hundred robots with scans of 360 points at 10 Hz and poses at 20 Hz are compared with
two such robots. Each figure is the time from the input to the end of the frame that
shows its effect. It includes earlier work of the page that delays the input.
"""

import statistics
from collections.abc import Callable

from playwright.sync_api import Page

from benchmarks.display import display
from benchmarks.drawing import browser_page
from benchmarks.harness import Comparison, Contender, Figures, compare

ROBOTS = 100
FEW = 2
BEAMS = 360
TIMES = 20

# Waits for the end of the first frame that begins with the effect on the page.
DRAWN = """
const drawn = (shown = () => true) => new Promise((done) => {
  const begin = () => {
    const there = shown();
    setTimeout(() => there ? done(performance.now()) : requestAnimationFrame(begin));
  };
  requestAnimationFrame(begin);
});
"""

SELECT = """async (index) => {
  DRAWN
  const row = document.querySelectorAll("#robots > .row")[index];
  const card = document.querySelector("#card");
  const from = performance.now();
  row.querySelector("button").click();
  return (await drawn(() => card.dataset.robot === row.dataset.robot)) - from;
}""".replace("DRAWN", DRAWN)

FILTER = """async (text) => {
  DRAWN
  const field = document.querySelector("#search");
  const from = performance.now();
  field.value = text;
  field.dispatchEvent(new Event("input", { bubbles: true }));
  return (await drawn()) - from;
}""".replace("DRAWN", DRAWN)

WATCH_PAN = """() => {
  DRAWN
  globalThis.panned = [];
  addEventListener("pointermove", async (event) => {
    panned.push((await drawn()) - event.timeStamp);
  }, { capture: true });
}""".replace("DRAWN", DRAWN)


def pan(page: Page) -> list[float]:
    """Drag the map; return the times of all movements in ms."""
    box = page.locator("svg.webmap").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] * 0.7, box["y"] + box["height"] * 0.7
    page.evaluate(WATCH_PAN)
    page.mouse.move(x, y)
    page.mouse.down()
    for step in range(TIMES):
        page.mouse.move(x - 5 * step, y - 3 * step)
        page.wait_for_timeout(100)
    page.mouse.up()
    times: list[float] = page.evaluate("panned")
    return times


def measure(page: Page, robots: int) -> Figures:
    """Return the median and the greatest time of each input."""
    page.locator("#robots > .row").nth(robots - 1).wait_for(state="attached")
    page.locator(".robot:not(.unplaced)").nth(robots - 1).wait_for(state="attached")
    page.wait_for_timeout(3000)
    found: dict[str, list[float]] = {"select": [], "filter": []}
    for number in range(TIMES):
        found["select"].append(page.evaluate(SELECT, number * 7 % robots))
        page.wait_for_timeout(100)
        text = "" if number % 2 else f"robot {number // 2}"
        found["filter"].append(page.evaluate(FILTER, text))
        page.wait_for_timeout(100)
    page.evaluate(FILTER, "")
    found["pan"] = pan(page)
    figures = {}
    for name, times in found.items():
        figures[f"{name}, median (ms)"] = statistics.median(times)
        figures[f"{name}, 95 % (ms)"] = statistics.quantiles(times, n=20)[-1]
    return figures


def console_with(robots: int) -> Callable[[], Figures]:
    """Return a run of the console with a number of robots."""

    def run() -> Figures:
        with display(robots, BEAMS, console=True) as shown, browser_page() as page:
            page.set_viewport_size({"width": 1440, "height": 900})
            page.goto(shown.url)
            return measure(page, robots)

    return run


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare many robots with few."""
    many = 20 if quick else ROBOTS
    contenders = [
        Contender(f"{FEW} robots", console_with(FEW)),
        Contender(f"{many} robots", console_with(many)),
    ]
    title = f"time until the console shows the effect, scans of {BEAMS}"
    return [compare(title, contenders, rounds)]
