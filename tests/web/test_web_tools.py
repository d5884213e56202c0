"""The tools over a map and their panels, in a real Chromium."""

from collections.abc import Callable

import pytest
from input_bench import Bench

pytestmark = pytest.mark.browser

LAY = """async () => {
  const { lay } = await import("/_webmap/web/tools/overlay.js");
  for (const name of ["One", "Two", "Three"]) {
    const tool = document.createElement("details");
    tool.className = "webmap-panel tool";
    const [summary, much] = ["summary", "p"].map((tag) => document.createElement(tag));
    summary.textContent = name;
    much.className = "webmap-tool-body";
    much.style.height = "2000px";
    tool.append(summary, much);
    lay(bench.maps[0], tool, "top-left");
  }
}"""

PLACES = """() => [...document.querySelectorAll(".tool > summary")].map((e) => {
  const { x, y, width, height } = e.getBoundingClientRect();
  return [x, y, width, height];
})"""

OPEN = "[...document.querySelectorAll('.tool')].map((e) => e.open)"


def test_an_opened_tool_moves_no_other_tool_and_closes_the_open_one(
    open_bench: Callable[..., Bench],
) -> None:
    bench = open_bench("?modules=stop/stop_button")
    bench.page.evaluate(LAY)
    bench.page.wait_for_function("document.styleSheets.length > 1")
    tools = bench.page.locator(".tool > summary")
    before = bench.page.evaluate(PLACES)
    stop = bench.page.locator(".webmap-stop-all").bounding_box()
    for index in (0, 2, 1):
        tools.nth(index).click()
        alone = [each == index for each in range(3)]
        bench.until(lambda alone=alone: bench.page.evaluate(OPEN) == alone)
        assert bench.page.evaluate(PLACES) == before
        assert bench.page.locator(".webmap-stop-all").bounding_box() == stop
    tools.nth(1).click()
    bench.until(lambda: bench.page.evaluate(OPEN) == [False] * 3)


def test_the_driving_hint_on_a_touch_screen_names_no_keys(
    open_bench: Callable[..., Bench],
) -> None:
    bench = open_bench(has_touch=True, is_mobile=True)
    bench.select("r1")
    bench.page.locator(".webmap-teleop-lease").tap()
    bench.until(lambda: bench.shown() == "ready")
    detail = bench.page.locator(".webmap-teleop-detail")
    assert detail.inner_text() == "Hold the stick to drive. Release to stop."


@pytest.mark.parametrize("width", [360, 800])
def test_the_stop_button_keeps_its_place_in_every_state_of_the_robot(
    open_bench: Callable[..., Bench], width: int
) -> None:
    bench = open_bench()
    bench.page.evaluate(
        """(width) => Object.assign(document.querySelector("svg.webmap").style,
             { width: `${width}px`, height: "600px" })""",
        width,
    )
    stop = bench.page.locator(".webmap-teleop-stop")
    boxes = {"no robot": stop.bounding_box()}
    bench.select("r1")
    bench.until(stop.is_enabled)
    boxes["selected"] = stop.bounding_box()
    bench.drive()
    bench.until(lambda: bench.shown() == "driving")
    boxes["driving"] = stop.bounding_box()
    bench.page.keyboard.up("w")
    bench.until(lambda: bench.shown() == "ready")
    boxes["ready"] = stop.bounding_box()
    stopped = {"by": "Ann", "confirmed": False, "why": "no connection to ws://bob"}
    bench.gate.change("r1", latched=True, state="stopped", stop=stopped)
    bench.until(lambda: bench.shown() == "unconfirmed")
    boxes["stopped"] = stop.bounding_box()
    bench.gate.ticking = False
    bench.until(lambda: bench.shown() == "late")
    boxes["late"] = stop.bounding_box()
    assert len({tuple(box.values()) for box in boxes.values()}) == 1, boxes


WIDE_ROUTE = """async (width) => {
  const { lay } = await import("/_webmap/web/tools/overlay.js");
  const style = new CSSStyleSheet();
  style.replaceSync("svg { height: auto } input, select { min-height: 10px }");
  document.adoptedStyleSheets.push(style);
  const link = document.createElement("link");
  link.rel = "stylesheet";
  link.href = "/_webmap/features/routes/route_tool.css";
  const loaded = new Promise((resolve) => link.addEventListener("load", resolve));
  document.head.append(link);
  await loaded;
  const map = document.querySelector("svg.webmap");
  Object.assign(map.style, { width: `${width}px`, height: "500px" });
  const route = document.createElement("details");
  route.className = "webmap-panel webmap-tool webmap-route";
  route.open = true;
  const [summary, row, select, option] = ["summary", "p", "select", "option"].map(
    (tag) => document.createElement(tag),
  );
  summary.textContent = "Route";
  option.textContent = "a long name ".repeat(20);
  select.append(option);
  row.append(select);
  route.append(summary, row);
  lay(bench.maps[0], route, "top-left");
  const drawing = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  drawing.classList.add("webmap-route-drawing");
  map.parentElement.append(drawing);
}"""


@pytest.mark.parametrize("width", [320, 600])
def test_an_open_route_panel_stays_on_the_map_and_is_not_shrunk_by_css_of_the_page(
    open_bench: Callable[..., Bench], width: int
) -> None:
    bench = open_bench("?modules=stop/stop_button")
    bench.page.evaluate(WIDE_ROUTE, width)
    map_box = bench.page.locator("svg.webmap").bounding_box()
    panel = bench.page.locator(".webmap-route").bounding_box()
    assert panel["x"] + panel["width"] <= map_box["x"] + map_box["width"] - 11
    assert panel["width"] == pytest.approx(width - 24, abs=1)
    assert bench.page.locator(".webmap-route select").bounding_box()["height"] >= 44
    drawing = bench.page.locator(".webmap-route-drawing")
    assert drawing.evaluate("e => getComputedStyle(e).pointerEvents") == "none"
    assert drawing.bounding_box()["height"] > 300
