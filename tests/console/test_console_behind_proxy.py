"""The console behind a proxy that strips a prefix, and in a frame of another page."""

import contextlib
from urllib.parse import urlsplit

import pytest
from console_ready import select, wait_until_ready
from playwright.sync_api import expect

from equipment.chromium import watched_tab
from equipment.reverse_proxies import answering, stripping
from equipment.webmap_process import webmap

pytestmark = pytest.mark.browser

DEMO = ("demo", "-n", "1", "--quiet", "--port", "0", "--no-browser")
PREFIX = "/user/x/proxy/8080"


TAKE = """
async (robot) => {
  const { protocols } = await import(new URL("/_webmap/web/access.js", location.href));
  const url = new URL("/_webmap/drive?id=raw", location.href);
  const socket = new WebSocket(url.href.replace("http", "ws"), protocols());
  return new Promise((answer) => {
    socket.onmessage = ({ data }) => {
      const { op, why } = JSON.parse(data);
      if (op === "hello") socket.send(JSON.stringify({ op: "take", robot }));
      if (op === "refused") answer(why);
    };
  });
}
"""


@pytest.fixture(scope="module")
def framing():
    """Yield a demo and the ports of two pages that frame it; it names the first."""
    address = []

    def page(request):
        body = (
            f'<h1>Work</h1><iframe width=1200 height=600 src="{address[0]}"></iframe>'
        )
        request.send_response(200)
        request.send_header("Content-Type", "text/html")
        request.send_header("Content-Length", str(len(body)))
        request.end_headers()
        request.wfile.write(body.encode())

    with contextlib.ExitStack() as stack:
        named, other = (stack.enter_context(answering(page)) for _ in range(2))
        origin = f"http://localhost:{named}"
        url = stack.enter_context(webmap(*DEMO, "--embed-from", origin))
        address.append(url)
        yield url, named, other


def test_the_console_works_under_a_prefix_that_nobody_stated(chromium, framing):
    url = urlsplit(framing[0])
    with (
        stripping(PREFIX, url.port) as port,
        watched_tab(chromium, 1280, 720) as page,
    ):
        page.goto(f"http://127.0.0.1:{port}{PREFIX}/?{url.query}")
        wait_until_ready(page)
        assert page.url == f"http://127.0.0.1:{port}{PREFIX}/"
        select(page, "Robot 0")
        page.get_by_role("button", name="Take control of Robot 0").click()
        expect(page.locator(".webmap-teleop-title")).to_have_text("You have control")
        page.reload()
        wait_until_ready(page)


def test_a_page_that_is_not_named_cannot_show_webmap_in_a_frame(chromium, framing):
    _, _, other = framing
    with watched_tab(chromium, 1280, 720) as page:
        page.allowed += ["frame-ancestors", "ERR_BLOCKED_BY_RESPONSE"]
        page.goto(f"http://localhost:{other}/")
        page.wait_for_function("() => frames.length === 1")
        page.wait_for_load_state("networkidle")
        assert page.frames[1].url.startswith("chrome-error:")


def test_in_a_frame_of_a_named_page_robots_are_seen_and_stopped_not_driven(
    chromium, framing
):
    url, named, _ = framing
    with watched_tab(chromium, 1280, 720) as page:
        page.goto(f"http://localhost:{named}/")
        frame = page.frame_locator("iframe")
        row = frame.locator("#robots .row").first
        row.click()
        driving = frame.locator(".webmap-teleop")
        expect(driving).to_contain_text("To drive, open WebMap in a tab of its own")
        expect(driving.get_by_role("button", name="Take control")).to_be_hidden()
        [inner] = [each for each in page.frames if each.url.startswith(url[:20])]
        robot = row.get_attribute("data-robot")
        # Also when the page does not state that it is in a frame.
        why = inner.evaluate(TAKE, robot)
        assert why == "viewers can only look and press STOP; driving needs an operator"
        frame.get_by_role("button", name="STOP Robot 0").click()
        expect(frame.locator(".webmap-teleop-title")).to_contain_text("STOP")
        cookies = page.context.cookies()
        [cookie] = [one for one in cookies if one["name"].startswith("webmap_")]
        assert (cookie["sameSite"], cookie["secure"]) == ("None", True)
        assert cookie["httpOnly"]
