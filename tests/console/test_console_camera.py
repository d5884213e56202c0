"""The camera's panel in a real browser, before a robot of the simulator."""

import os
import re
import signal
import subprocess
import sys
from contextlib import contextmanager

import pytest
from console_ready import wait_until_ready
from playwright.sync_api import Page, expect

from equipment.camera_server import CameraServer
from equipment.chromium import Complaints, hold
from webmap.base.tasks import LoopThread

pytestmark = [pytest.mark.browser, pytest.mark.slow]

FLEET = """
[bridges]
hall = "{bridge}"

[[robots]]
name = "Bob"
odometry = "/robot_0/odom"
twist = {{ topic = "/robot_0/cmd_vel", stops_within = 0.25 }}
cameras = [
  {{ url = "{front}", name = "Front", throttle = 100 }},
  {{ url = "{rear}", name = "Rear" }},
]
"""


@contextmanager
def running(*command: str, pattern: str):
    """Run a command of webmap; yield the URL that it prints."""
    with subprocess.Popen(
        [sys.executable, "-m", "webmap", *command],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    ) as process:
        try:
            line = process.stdout.readline()
            found = re.search(pattern, line)
            assert found, line
            yield found[1]
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(60)  # the machine may be busy


@pytest.fixture(scope="module")
def camera():
    """A camera server in a separate thread."""
    thread = LoopThread("camera")
    server = CameraServer()
    thread.call(server.__aenter__())
    yield server
    thread.call(server.__aexit__())
    thread.end()


@pytest.fixture(scope="module")
def url(camera, tmp_path_factory):
    with running(
        "sim", "--robots", "1", "--port", "0", pattern=r"at (ws\S+)"
    ) as bridge:
        fleet = tmp_path_factory.mktemp("fleet") / "fleet.toml"
        text = FLEET.format(
            bridge=bridge, front=camera.at("/stream"), rear=camera.at("/snapshot")
        )
        fleet.write_text(text)
        run = ("run", str(fleet), "--port", "0", "--no-browser")
        with running(*run, pattern=r"ready at (\S+)") as url:
            yield url


@pytest.fixture
def open_page(chromium, url, camera):
    camera.frozen = False
    contexts, complaints = [], Complaints()

    def open_(size=(1280, 800), **more) -> Page:
        width, height = size
        context = chromium.new_context(
            viewport={"width": width, "height": height}, **more
        )
        contexts.append(context)
        complaints.listen(context)
        page = context.new_page()
        return come(page)

    def come(page: Page) -> Page:
        page.goto(url)
        expect(page.locator(".robot:not(.unplaced)")).to_have_count(1)
        expect(page.locator("#link")).to_have_attribute("data-link", "open")
        wait_until_ready(page)
        if page.viewport_size["width"] < 900:
            page.locator("#sheet").click()
        page.locator("#robots button").first.click()
        return page

    open_.again = come
    yield open_
    for context in contexts:
        context.close()
    assert not complaints.unexpected, complaints.unexpected


def large(page: Page, name: str = "Front"):
    page.locator("#card .camera-small", has_text=name).click()
    panel = page.get_by_role("region", name="Camera")
    expect(panel.locator("img")).to_be_visible()
    return panel


def red(page: Page) -> int:
    """Return how red the picture is, which identifies the picture."""
    return page.evaluate(
        """() => {
            const canvas = document.createElement('canvas');
            const context = canvas.getContext('2d');
            context.drawImage(document.querySelector('.camera-image'), 0, 0);
            return context.getImageData(8, 6, 1, 1).data[0];
        }"""
    )


def moves_within(page: Page, ms: int) -> bool:
    """Return whether a velocity is sent to the robot within a time."""
    return page.evaluate(
        """ms => new Promise(done => {
            const sent = document.querySelector('#card .speeds tbody td');
            const end = setTimeout(() => done(false), ms);
            new MutationObserver(() => {
                if (sent.textContent === '0.00') return;
                clearTimeout(end);
                done(true);
            }).observe(sent, { childList: true, characterData: true, subtree: true });
        })""",
        ms,
    )


def sent(page: Page):
    """Return the cell of the card that shows the speed that was sent."""
    return page.locator("#card .speeds tbody td").first


def hold_w(page: Page) -> None:
    """Hold W until the robot is driven."""
    hold(page.keyboard, "w", lambda: sent(page).text_content() != "0.00")


def test_a_camera_of_the_card_opens_large_with_live_pictures(open_page, camera):
    page = open_page()
    panel = large(page)
    expect(panel.get_by_role("heading")).to_have_text("Bob: Front")
    before = red(page)
    page.wait_for_function(
        """before => {
            const canvas = document.createElement('canvas');
            const context = canvas.getContext('2d');
            const image = document.querySelector('.camera-image');
            if (!image) return false;
            context.drawImage(image, 0, 0);
            return Math.abs(context.getImageData(8, 6, 1, 1).data[0] - before) > 10;
        }""",
        arg=before,
    )
    expect(panel.locator(".camera-age")).to_have_text(re.compile(r"^0\.\d s$"))
    assert len([ask for ask in camera.asked if "/stream" in ask]) <= 1
    panel.get_by_role("button", name="Rear").click()
    expect(panel.get_by_role("heading")).to_have_text("Bob: Rear")
    expect(panel.locator("img")).to_be_visible()
    panel.get_by_role("button", name="Close the camera").click()
    expect(panel).to_be_hidden()
    expect(page.locator("#card .camera-small", has_text="Rear")).to_be_focused()


def test_a_floating_camera_panel_stays_on_the_map_and_is_restored_by_a_reload(
    open_page,
):
    page = open_page()
    panel = large(page, "Rear")
    panel.get_by_role("button", name="Over the map").click()
    corner = panel.bounding_box()
    panel.get_by_role("button", name="Over the map").click()
    assert panel.bounding_box()["x"] > corner["x"]
    panel.get_by_role("heading").hover()
    page.mouse.down()
    page.mouse.move(5000, 5000, steps=4)
    page.mouse.up()
    box, teleop = panel.bounding_box(), page.locator(".webmap-teleop").bounding_box()
    assert box["x"] + box["width"] <= 1280
    assert box["y"] + box["height"] <= teleop["y"]
    page = open_page.again(page)
    panel = page.get_by_role("region", name="Camera")
    expect(panel.get_by_role("heading")).to_have_text("Bob: Rear")
    expect(panel).to_have_attribute("data-dock", "float")


def can_be_pressed(what) -> None:
    """Check that no other element covers the middle of an element."""
    expect(what).to_be_in_viewport(ratio=0.95)
    assert what.evaluate(
        """e => {
            const r = e.getBoundingClientRect();
            const [x, y] = [r.x + r.width / 2, r.y + r.height / 2];
            const hit = document.elementFromPoint(x, y);
            return e === hit || e.contains(hit);
        }"""
    )


@pytest.mark.parametrize("size", [(1280, 800), (390, 844), (844, 390), (320, 568)])
def test_the_camera_panel_covers_neither_stop_nor_the_stick_at_any_place(
    open_page, size
):
    if size == (1280, 800):
        page = open_page()
        docks = ["Beside", "Above or below", "Over the map", "Over the map"]
    else:
        page = open_page(size, has_touch=True, is_mobile=True)
        docks = ["Above or below", "Over the map", "Over the map"]
    panel = large(page)
    stick = page.locator(".webmap-stick")
    if not stick.is_visible():
        page.get_by_role("button", name="Stick").click()
    for dock in docks:
        panel.get_by_role("button", name=dock).click()
        can_be_pressed(page.get_by_role("button", name="STOP ALL"))
        can_be_pressed(page.get_by_role("button", name="Stop Bob"))
        can_be_pressed(stick)
        can_be_pressed(panel.get_by_role("button", name="Close the camera"))
        expect(panel.locator("img")).to_be_in_viewport()
        width = page.evaluate("document.documentElement.scrollWidth")
        assert width == page.viewport_size["width"]


@pytest.mark.serial  # a busy machine decodes pictures too late to drive by
def test_a_driven_robot_stops_when_its_camera_freezes(open_page, camera):
    page = open_page()
    panel = large(page)
    hold_w(page)
    camera.frozen = True
    expect(panel.locator(".camera-cell")).to_have_class(re.compile("stale"))
    expect(panel.get_by_role("status")).to_contain_text("Frozen")
    expect(sent(page)).to_have_text("0.00")
    received = page.locator(".webmap-teleop")
    expect(received).to_contain_text("o picture from the camera for 1 s")
    # The picture moves again, but the key that is still held drives nothing.
    camera.frozen = False
    expect(panel.locator(".camera-cell")).not_to_have_class(re.compile("stale"))
    assert not moves_within(page, 700)
    page.keyboard.up("w")
    hold_w(page)
    page.keyboard.up("w")
    # A closed camera does not stop the robot.
    camera.frozen = True
    expect(panel.locator(".camera-cell")).to_have_class(re.compile("stale"))
    panel.get_by_role("button", name="Close the camera").click()
    hold_w(page)
    page.keyboard.up("w")


@pytest.mark.serial  # a busy machine decodes pictures too late to drive by
def test_the_end_of_the_full_screen_stops_the_driven_robot(open_page):
    page = open_page()
    panel = large(page)
    panel.get_by_role("button", name="Full screen").click()
    page.wait_for_function("document.fullscreenElement !== null")
    hold_w(page)
    # As a browser does that uses Escape itself: it does not pass the key on.
    page.evaluate("document.exitFullscreen()")
    expect(page.locator(".webmap-stop-list")).to_be_visible()
    expect(sent(page)).to_have_text("0.00")
    expect(panel).to_have_attribute("data-dock", "full")
    page.keyboard.up("w")
    panel.get_by_role("button", name="Full screen").click()
    expect(panel).to_have_attribute("data-dock", "side")


def test_two_viewers_of_a_camera_share_one_stream(open_page, camera):
    def pulls():
        return len([asked for asked in camera.asked if "/stream" in asked])

    before = pulls()
    for _ in range(2):
        large(open_page())
    assert pulls() - before <= 1  # no new one if the page of an earlier test is kept
    assert 1 <= camera.open <= 2  # the stream, and perhaps a snapshot
