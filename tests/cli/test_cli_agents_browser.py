"""A router, agents and displays, each a process of its own, seen in a real browser."""

import re
from contextlib import ExitStack, contextmanager

import pytest
from playwright.sync_api import expect

from camera_server import CameraServer
from real_browser import end_stops, hold, watched_tab
from webmap.base.loop_thread import LoopThread
from webmap_process import simulator, webmap

pytest.importorskip("zenoh")
pytestmark = [pytest.mark.browser, pytest.mark.slow]

SOON = 20_000


@contextmanager
def fleet(tmp_path, number=1, *more):
    """Run a router and agents with a simulated robot each; yield the router's URL."""
    with ExitStack() as running:
        router = running.enter_context(webmap("router", "--listen", "tcp/127.0.0.1:0"))
        for index in range(number):
            options = ("--robots", "1", "--seed", str(index + 1))
            url = running.enter_context(simulator(*options))
            running.enter_context(
                agent(tmp_path, url, router, f"bay{index + 1}", *more)
            )
        yield router


def agent(tmp_path, url, router, name, *more, **environment):
    return webmap(
        "agent",
        url,
        "--router",
        router,
        "--name",
        name,
        "--stops-within",
        "0.5",
        *more,
        WEBMAP_STATE_DIR=str(tmp_path / name),
        **environment,
    )


@contextmanager
def display(chromium, router, *more):
    """Open the page of a display of its own."""
    options = ("--port", "0", "--no-browser")
    with (
        webmap("view", router, *more, *options) as url,
        watched_tab(chromium, 1280, 800) as page,
    ):
        page.goto(url)
        yield page


def placed(page):
    return page.locator(".robot:not(.unplaced)")


def test_the_robots_of_all_agents_are_drawn_with_map_and_scan(chromium, tmp_path):
    with fleet(tmp_path, 2) as router, display(chromium, router) as page:
        expect(placed(page)).to_have_count(2, timeout=SOON)
        expect(page.locator("#robots .row .name")).to_have_text(
            ["robot_0", "robot_0 (bay2)"], timeout=SOON
        )
        expect(page.locator(".occupancy-grid.map image").first).to_be_attached(
            timeout=SOON
        )
        expect(page.locator(".laserscan > .dot[d]")).to_have_count(2, timeout=SOON)


def test_a_scan_crosses_the_uplink_with_the_beams_that_the_agent_allows(
    chromium, tmp_path
):
    beams = ("--beams", "/robot_0/base_scan=30")
    with fleet(tmp_path, 1, *beams) as router, display(chromium, router) as page:
        dots = page.locator(".laserscan > .dot[d]")
        expect(dots).to_have_count(1, timeout=SOON)
        assert 5 < dots.get_attribute("d").upper().count("M") <= 30


def test_two_displays_drive_one_robot_in_turn_and_either_stops_it(chromium, tmp_path):
    with (
        fleet(tmp_path) as router,
        display(chromium, router) as ann,
        display(chromium, router) as ben,
    ):
        for page in (ann, ben):
            expect(placed(page)).to_have_count(1, timeout=SOON)
            page.locator("#robots .row button").first.click()
        start = placed(ann).get_attribute("transform")
        hold(
            ann.keyboard,
            "w",
            lambda: placed(ann).get_attribute("transform") != start,
        )
        state = ben.locator("#card")
        expect(state).to_contain_text("has control", timeout=SOON)
        ben.keyboard.press(" ")
        stopped = "#robots .row[data-group=stopped]"
        for page in (ann, ben):
            expect(page.locator(stopped)).to_have_count(1, timeout=SOON)
        end_stops(ben.locator(".webmap-teleop .webmap-reset"))
        expect(ben.locator(stopped)).to_have_count(0, timeout=SOON)
        expect(ann.locator(stopped)).to_have_count(0, timeout=SOON)


def test_an_agent_that_ends_is_shown_and_one_that_comes_later_appears(
    chromium, tmp_path
):
    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
        simulator("--robots", "1") as url,
        display(chromium, router) as page,
    ):
        expect(page.locator("#bridges summary")).to_have_text("No agent yet")
        expect(page.locator("#routers")).to_have_text(f"No agent is at {router} yet.")
        with agent(tmp_path, url, router, "bay1"):
            expect(placed(page)).to_have_count(1, timeout=SOON)
            expect(page.locator("#bridges summary")).to_have_text(
                "Bridge open", timeout=SOON
            )
            expect(page.locator("#routers")).to_have_text("")
        page.locator("#bridges summary").click()
        line = page.locator(f"#bridges li[title='{router}']")
        expect(line).to_contain_text("0 agents connected; away: bay1", timeout=SOON)
        expect(page.locator("#robots .row")).to_contain_text("Lost", timeout=SOON)
        expect(page.locator("#bridges summary")).to_have_text(
            "No connection to the bridge", timeout=SOON
        )
        with agent(tmp_path, url, router, "bay1"):
            expect(page.locator("#robots .row")).not_to_contain_text(
                "Lost", timeout=SOON
            )


def test_an_agent_that_restarts_with_other_robots_shows_these(chromium, tmp_path):
    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
        simulator("--robots", "1") as one,
        simulator("--robots", "3") as three,
        display(chromium, router) as page,
    ):
        names = page.locator("#robots .row .name")
        for url, number in ((one, 1), (three, 3), (one, 1)):
            with agent(tmp_path, url, router, "bay1"):
                expected = [f"robot_{index}" for index in range(number)]
                expect(names).to_have_text(expected, timeout=2 * SOON)
                expect(placed(page)).to_have_count(number, timeout=SOON)


TOMORROW = """
import time

now = time.time
time.time = lambda: now() + 86_400.0
"""


def test_a_robot_is_driven_whose_agent_has_a_clock_one_day_ahead(chromium, tmp_path):
    (tmp_path / "sitecustomize.py").write_text(TOMORROW)
    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
        simulator("--robots", "1") as url,
        agent(tmp_path, url, router, "bay1", PYTHONPATH=str(tmp_path)),
        display(chromium, router) as page,
    ):
        expect(placed(page)).to_have_count(1, timeout=SOON)
        page.locator("#robots .row button").first.click()
        title = page.locator(".webmap-teleop-title")
        hold(page.keyboard, "w", lambda: title.text_content() == "You are driving")
        page.keyboard.up("w")
        expect(title).to_have_text("You have control", timeout=SOON)


def test_the_page_of_a_display_shows_why_its_router_is_not_there(chromium, tmp_path):
    with (
        simulator("--robots", "1") as url,
        display(chromium, "zenoh://127.0.0.1:1", url) as page,
    ):
        expect(page.locator("#bridges summary")).to_have_text(
            "Bridge open, no connection to a router", timeout=SOON
        )
        page.locator("#bridges summary").click()
        line = page.locator("#bridges li[title='zenoh://127.0.0.1:1']")
        expect(line).to_contain_text("nothing listens there; reconnecting")


def test_the_log_shows_the_lines_of_an_agent_that_comes_while_it_is_open(
    chromium, tmp_path
):
    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
        simulator("--robots", "1") as url,
        display(chromium, router) as page,
    ):
        log = page.locator(".webmap-rosout")
        log.locator("summary").click()
        expect(log.locator(".webmap-rosout-count")).to_have_text("No log lines yet.")
        with agent(tmp_path, url, router, "bay1"):
            lines = log.get_by_role("list", name="Log of bay1")
            expect(lines).to_contain_text("the battery is at", timeout=SOON)


def test_robots_of_an_agent_and_of_a_rosbridge_share_one_map(chromium, tmp_path):
    with (
        fleet(tmp_path) as router,
        simulator("--robots", "2") as url,
        display(chromium, router, url) as page,
    ):
        expect(placed(page)).to_have_count(3, timeout=SOON)


def test_the_demo_of_agents_shows_a_robot_of_each(chromium, tmp_path):
    options = ("--agents", "2", "--port", "0", "--no-browser")
    with (
        webmap("demo", *options, WEBMAP_STATE_DIR=str(tmp_path)) as url,
        watched_tab(chromium, 1280, 800) as page,
    ):
        page.goto(url)
        expect(placed(page)).to_have_count(2, timeout=SOON)


def test_a_fleet_file_shows_the_robots_of_agents(chromium, tmp_path):
    with fleet(tmp_path) as router:
        file = tmp_path / "fleet.toml"
        file.write_text(f'[bridges]\nyard = "{router}"\n')
        options = ("--port", "0", "--no-browser")
        with (
            webmap("run", file, *options) as url,
            watched_tab(chromium, 1280, 800) as page,
        ):
            page.goto(url)
            expect(placed(page)).to_have_count(1, timeout=SOON)


PICTURED = """
[bridges]
forklift = "{bridge}"

[[robots]]
name = "Forklift"
odometry = "/robot_0/odom"
cameras = {{ url = "{front}", name = "Front" }}
picture = {{ file = "forklift.svg", width = 1.2, height = 0.8 }}
"""

SVG = """<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 3 2" width="3" height="2">
<path d="M0 0H3V2H0Z" fill="#c33"/></svg>"""


@pytest.fixture
def camera():
    """A camera on the web, in a thread of its own."""
    thread = LoopThread("camera")
    server = CameraServer()
    thread.call(server.__aenter__())
    yield server
    thread.call(server.__aexit__())
    thread.end()


def test_the_page_shows_the_camera_and_the_picture_of_an_agents_robot(
    chromium, tmp_path, camera
):
    (tmp_path / "forklift.svg").write_text(SVG)
    file = tmp_path / "bay1.toml"
    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
        simulator("--robots", "1") as url,
    ):
        file.write_text(PICTURED.format(bridge=url, front=camera.at("/stream")))
        with (
            webmap(
                "agent",
                file,
                "--router",
                router,
                "--name",
                "bay1",
                WEBMAP_STATE_DIR=str(tmp_path / "bay1"),
            ),
            display(chromium, router) as page,
        ):
            expect(placed(page)).to_have_count(1, timeout=SOON)
            picture = page.locator(".robot .pictured image.picture")
            expect(picture).to_have_attribute("href", re.compile("."), timeout=SOON)
            loaded = picture.evaluate(
                "async (image) => { const loaded = new Image(); "
                "loaded.src = image.href.baseVal; await loaded.decode(); "
                "return [loaded.naturalWidth, loaded.naturalHeight]; }"
            )
            assert loaded == [3, 2]
            page.locator("#robots .row button").first.click()
            front = page.locator("#card .cameras img")
            expect(front).to_have_js_property("naturalWidth", 16, timeout=SOON)
            first = front.get_attribute("src")
            expect(front).not_to_have_attribute("src", first, timeout=SOON)
            assert camera.open == 1
