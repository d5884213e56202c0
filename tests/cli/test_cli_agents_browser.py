"""A router, agents and displays as separate processes, in a real browser."""

import re
from contextlib import ExitStack, contextmanager

import pytest
from playwright.sync_api import expect

from equipment.camera_server import CameraServer
from equipment.chromium import end_stops, hold, watched_tab
from equipment.video_publisher import VideoPublisher
from equipment.webmap_process import page_of, simulator, webmap
from webmap.base.tasks import LoopThread

pytest.importorskip("zenoh")
pytestmark = [pytest.mark.browser, pytest.mark.slow]

SOON = 30_000

CONTROLLED = re.compile("has control|is driving")


TOMORROW = """
import time

now = time.time
time.time = lambda: now() + 86_400.0
"""


FEW_AND_MANY_DOTS = """() => {
    const dots = [...document.querySelectorAll(".laserscan > .dot")]
        .map((dot) => dot.getAttribute("d")?.toUpperCase().split("M").length - 1)
        .sort((one, other) => one - other);
    return dots.length === 2 && 5 < dots[0] && dots[0] <= 30 && 30 < dots[1];
}"""


def agent(folder, url, router, name, *more, **environment):
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
        WEBMAP_STATE_DIR=str(folder / name),
        **environment,
    )


@contextmanager
def display(chromium, router, *more):
    """Open the page of a separate display."""
    options = ("--port", "0", "--no-browser")
    with (
        webmap("view", router, *more, *options) as url,
        watched_tab(chromium, 1280, 800) as page,
    ):
        page.goto(url)
        yield page


@pytest.fixture(scope="module")
def yard(tmp_path_factory):
    """The URL of a router with two agents of one robot each.

    Bay 1 sends scans of 30 beams. The clock of bay 2 is one day ahead.
    """
    folder = tmp_path_factory.mktemp("yard")
    (folder / "sitecustomize.py").write_text(TOMORROW)
    beams = ("--beams", "/robot_0/base_scan=30")
    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
        simulator("--robots", "1", "--seed", "1") as one,
        simulator("--robots", "1", "--seed", "2") as two,
        agent(folder, one, router, "bay1", *beams),
        agent(folder, two, router, "bay2", PYTHONPATH=str(folder)),
    ):
        yield router


def placed(page):
    return page.locator(".robot:not(.unplaced)")


def choose(page, name):
    """Select a robot as soon as it is placed."""
    row = page.locator("#robots .row").filter(has_text=name)
    expect(row).to_have_count(1, timeout=SOON)
    expect(placed(page)).to_have_count(2, timeout=SOON)
    row.get_by_role("button").first.click()


def test_the_robots_of_all_agents_are_drawn_with_map_and_scan(chromium, yard):
    with display(chromium, yard) as page:
        expect(placed(page)).to_have_count(2, timeout=SOON)
        # A short list has the order in which the agents answered.
        for name in ("robot_0 (bay1)", "robot_0 (bay2)"):
            shown = page.locator("#robots .row .name", has_text=name)
            expect(shown).to_have_count(1, timeout=SOON)
        expect(page.locator(".occupancy-grid.map image").first).to_be_attached(
            timeout=SOON
        )
        # The first view is around the robots that came first.
        page.locator("#show-all").click()
        # Only one agent limits scans to 30 beams.
        page.wait_for_function(FEW_AND_MANY_DOTS, timeout=SOON)


def test_two_displays_drive_one_robot_in_turn_and_either_stops_it(chromium, yard):
    with display(chromium, yard) as ann, display(chromium, yard) as ben:
        for page in (ann, ben):
            choose(page, "bay1")
        stop = ben.locator(".stop-place .webmap-teleop-stop")
        expect(stop).to_have_attribute("data-robot", "robot_0 (bay1)", timeout=SOON)
        title = ann.locator(".webmap-teleop-title")
        hold(ann.keyboard, "w", lambda: title.text_content() == "You are driving")
        state = ben.locator("#card")
        expect(state).to_contain_text(CONTROLLED, timeout=SOON)
        ben.keyboard.press(" ")
        stopped = "#robots .row[data-group=stopped]"
        for page in (ann, ben):
            expect(page.locator(stopped)).to_have_count(1, timeout=SOON)
        end_stops(ben.locator(".webmap-teleop .webmap-reset"))
        expect(ben.locator(stopped)).to_have_count(0, timeout=SOON)
        expect(ann.locator(stopped)).to_have_count(0, timeout=SOON)


def test_a_robot_is_driven_whose_agent_has_a_clock_one_day_ahead(chromium, yard):
    with display(chromium, yard) as page:
        choose(page, "bay2")
        title = page.locator(".webmap-teleop-title")
        hold(page.keyboard, "w", lambda: title.text_content() == "You are driving")
        page.keyboard.up("w")
        expect(title).to_have_text("You have control", timeout=SOON)


def test_agents_that_come_and_end_while_a_page_is_open(chromium, tmp_path):
    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
        simulator("--robots", "1") as one,
        simulator("--robots", "3") as three,
        display(chromium, router) as page,
    ):
        bridges = page.locator("#bridges summary")
        expect(bridges).to_have_text("No agent yet")
        expect(page.locator("#routers")).to_have_text(f"No agent is at {router} yet.")
        log = page.locator(".webmap-rosout")
        log.locator("summary").click()
        expect(log.locator(".webmap-rosout-count")).to_have_text("No log lines yet.")
        with agent(tmp_path, one, router, "bay1"):
            expect(placed(page)).to_have_count(1, timeout=SOON)
            expect(bridges).to_have_text("Bridge connected", timeout=SOON)
            expect(page.locator("#routers")).to_have_text("")
            lines = log.get_by_role("list", name="Log of bay1")
            expect(lines).to_contain_text("the battery is at", timeout=SOON)
        log.locator("summary").click()
        bridges.click()
        line = page.locator(f"#bridges li[title='{router}']")
        expect(line).to_contain_text("0 agents connected; away: bay1", timeout=SOON)
        lost = page.locator("#robots .row[data-group=lost]")
        expect(lost).to_have_count(1, timeout=SOON)
        expect(bridges).to_have_text("No connection to the bridge", timeout=SOON)
        names = page.locator("#robots .row .name")
        for url, number in (
            (three, 3),
            (one, 1),
        ):  # the simulator restarts with other robots
            with agent(tmp_path, url, router, "bay1"):
                expected = [f"robot_{index} (bay1)" for index in range(number)]
                expect(names).to_have_text(expected, timeout=2 * SOON)
                expect(placed(page)).to_have_count(number, timeout=SOON)
                expect(lost).to_have_count(0, timeout=SOON)


def test_the_page_of_a_display_shows_why_its_router_is_not_there(chromium, tmp_path):
    with (
        simulator("--robots", "1") as url,
        display(chromium, "zenoh://127.0.0.1:1", url) as page,
    ):
        expect(page.locator("#bridges summary")).to_have_text(
            "Bridge connected, no connection to a router", timeout=SOON
        )
        page.locator("#bridges summary").click()
        line = page.locator("#bridges li[title='zenoh://127.0.0.1:1']")
        expect(line).to_contain_text("nothing listens there; reconnecting")


def test_the_demo_of_agents_shows_a_robot_of_each(chromium, tmp_path):
    options = ("--agents", "2", "--port", "0", "--no-browser")
    with (
        webmap("demo", *options, WEBMAP_STATE_DIR=str(tmp_path)) as url,
        watched_tab(chromium, 1280, 800) as page,
    ):
        page.goto(url)
        expect(placed(page)).to_have_count(2, timeout=SOON)


MIXED = """
[bridges]
yard = "{yard}"
hall = "{hall}"

[[robots]]
name = "Cart"
odometry = "/robot_0/odom"
"""


def test_a_fleet_file_shows_robots_of_agents_and_of_a_rosbridge(
    chromium, tmp_path, yard
):
    file = tmp_path / "fleet.toml"
    with simulator("--robots", "1") as hall:
        file.write_text(MIXED.format(yard=yard, hall=hall))
        with page_of(file) as url, watched_tab(chromium, 1280, 800) as page:
            page.goto(url)
            expect(placed(page)).to_have_count(3, timeout=SOON)


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
    """A camera server in a separate thread."""
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


def test_the_page_shows_the_video_of_an_agents_robot(chromium, tmp_path):
    with (
        webmap("router", "--listen", "tcp/127.0.0.1:0") as router,
        simulator("--robots", "1") as url,
        ExitStack() as ends,
    ):
        publisher = VideoPublisher(url, "/robot_0/video")
        ends.callback(publisher.stop)
        with (
            agent(tmp_path, url, router, "bay1"),
            display(chromium, router) as page,
        ):
            expect(placed(page)).to_have_count(1, timeout=SOON)
            page.locator("#robots .row button").first.click()
            video = page.locator("#card .camera-video canvas")
            expect(video).to_have_js_property("width", 160, timeout=SOON)
            expect(page.locator("#card .camera-video")).not_to_have_class(
                re.compile("stale")
            )
