"""The wall of cameras in a real browser, at a rosbridge that records what it gets."""

import asyncio
import base64
import itertools
import re

import pytest
from console_ready import assert_free, select, wait_until_ready
from playwright.sync_api import Page, expect

from equipment.camera_server import a_jpeg
from equipment.chromium import Complaints
from equipment.fake_rosbridge import FakeRosbridge
from equipment.waiting import wait_for
from equipment.webmap_process import page_of
from webmap.base.tasks import LoopThread

pytestmark = [pytest.mark.browser, pytest.mark.slow]

LONG = "ר" * 100
"""The longest name of a fleet file, which fits nowhere, written from right to left."""

ROBOTS = {"Bob": "/bob", LONG: "/long", "Cid": "/cid"}

SIZES = [(64, 36), (30, 60)]
"""The cameras change the size of their pictures."""


class Robots:
    """A rosbridge whose cameras send pictures of changing sizes to subscribers."""

    def __init__(self) -> None:
        self._bridge = FakeRosbridge()
        self._pictures = [
            {
                "format": "jpeg",
                "data": base64.b64encode(a_jpeg(size=size)).decode(),
                "header": {"stamp": {"secs": 0, "nsecs": 0}, "frame_id": "", "seq": 0},
            }
            for size in SIZES
        ]

    async def start(self) -> str:
        await self._bridge.start()
        self._task = asyncio.create_task(self._send())
        return self._bridge.url

    async def stop(self) -> None:
        self._task.cancel()
        await self._bridge.stop()

    async def _send(self) -> None:
        for picture in itertools.cycle(self._pictures):
            for topic in self.subscribed():
                await self._bridge.publish(topic, picture)
            await asyncio.sleep(0.15)

    def subscribed(self) -> set[str]:
        """Return the topics of cameras that WebMap is subscribed to."""
        topics = set()
        for message in list(self._bridge.received):
            if not message.get("topic", "").endswith("/compressed"):
                continue
            if message["op"] == "subscribe":
                topics.add(message["topic"])
            elif message["op"] == "unsubscribe":
                topics.discard(message["topic"])
        return topics


def topic(name: str) -> str:
    return f"{ROBOTS[name]}/image/compressed"


@pytest.fixture(scope="module")
def robots():
    thread, robots = LoopThread("robots"), Robots()
    robots.url = thread.call(robots.start())
    yield robots
    thread.call(robots.stop())
    thread.end()


@pytest.fixture(scope="module")
def url(robots, tmp_path_factory):
    lines = ["[bridges]", f'hall = "{robots.url}"']
    for name in ROBOTS:
        lines += ["[[robots]]", f'name = "{name}"', f'odometry = "{ROBOTS[name]}/odom"']
        lines += [f'cameras = "{topic(name)}"']
    file = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    file.write_text("\n".join(lines), encoding="utf-8")
    with page_of(file) as url:
        yield url


@pytest.fixture
def open_page(chromium, url):
    contexts, complaints = [], Complaints()

    def open_(width=1280, height=800, script="", **more) -> Page:
        size = {"width": width, "height": height}
        context = chromium.new_context(viewport=size, **more)
        contexts.append(context)
        complaints.listen(context)
        page = context.new_page()
        page.add_init_script(script)
        page.goto(url)
        return come(page)

    def come(page: Page) -> Page:
        expect(page.locator("#robots > .row")).to_have_count(len(ROBOTS))
        expect(page.locator("#link")).to_have_attribute("data-link", "open")
        wait_until_ready(page)
        return page

    open_.again = come
    yield open_
    for context in contexts:
        context.close()
    assert not complaints.unexpected, complaints.unexpected


def open_wall(page: Page, cells: int = 2):
    """Open the wall with the palette, without a selected robot."""
    page.keyboard.press("Control+k")
    page.locator("#palette-field").fill("camera wall")
    page.keyboard.press("Enter")
    wall = page.get_by_role("region", name="Camera wall")
    expect(wall.locator(".camera-cell")).to_have_count(cells)
    return wall


def cell(wall, name: str):
    return wall.get_by_role("group", name=f"{name}: ")


def wait_for_subscriptions(robots: Robots, *names: str) -> None:
    wanted = {topic(name) for name in names}
    wait_for(
        lambda: robots.subscribed() == wanted,
        lambda: f"subscriptions to {wanted}, not {robots.subscribed()}",
    )


def test_a_wall_subscribes_to_its_cameras_alone_and_stays_when_another_is_selected(
    open_page, robots
):
    page = open_page()
    wait_for_subscriptions(robots)
    wall = open_wall(page)
    wait_for_subscriptions(robots, "Bob", LONG)
    expect(wall.locator(".camera-cell img")).to_have_count(2)
    expect(cell(wall, "Bob").locator(".camera-cell-age")).to_have_text(
        re.compile(r"^\d\.\d s$")
    )
    # The picture of another size is in a cell of the same size.
    box = cell(wall, "Bob").bounding_box()
    for width, _ in SIZES:
        page.wait_for_function(
            "width => document.querySelector('.camera-image')?.naturalWidth === width",
            arg=width,
        )
        assert cell(wall, "Bob").bounding_box() == box
    # A press on the name selects, and no selection changes the wall.
    wall.get_by_role("button", name="Bob", exact=True).click()
    expect(page.locator("#card h2")).to_have_text("Bob")
    expect(cell(wall, "Bob")).to_have_attribute("aria-current", "true")
    select(page, "Cid")
    expect(wall.locator(".camera-robot")).to_have_text(["Bob", LONG])
    expect(wall.locator("[aria-current=true]")).to_have_count(0)
    wait_for_subscriptions(robots, "Bob", LONG, "Cid")
    page.get_by_role("button", name="Deselect the robot").click()
    wait_for_subscriptions(robots, "Bob", LONG)
    # Another camera in a cell, a removed and an added cell.
    cell(wall, "Bob").get_by_role("combobox").select_option(value=value(wall, "Cid"))
    wait_for_subscriptions(robots, "Cid", LONG)
    cell(wall, LONG).get_by_role("button", name="Remove from the wall").click()
    wait_for_subscriptions(robots, "Cid")
    wall.get_by_role("button", name="Add camera").click()
    wait_for_subscriptions(robots, "Cid", "Bob")
    # A reload restores the wall, and closing it ends all subscriptions.
    page.reload()
    open_page.again(page)
    expect(wall.locator(".camera-robot")).to_have_text(["Cid", "Bob"])
    expect(wall.locator(".camera-cell img")).to_have_count(2)
    wall.get_by_role("button", name="Close the camera").click()
    expect(wall).to_be_hidden()
    wait_for_subscriptions(robots)


def value(wall, name: str) -> str:
    """Return the value of a robot's first camera in the lists of the wall."""
    option = wall.locator(f'optgroup[label="{name}"] > option').first
    return option.get_attribute("value")


def test_a_wall_without_storage_shows_only_cells_in_view_on_a_phone(open_page, robots):
    forbidden = """Object.defineProperty(window, 'localStorage', {
        get() { throw new DOMException('forbidden', 'SecurityError'); } })"""
    page = open_page(390, 790, forbidden, has_touch=True, is_mobile=True)
    wall = open_wall(page)
    wall.locator(".camera-add").click()
    expect(wall.locator(".camera-cell")).to_have_count(3)
    first, last = (wall.locator(".camera-cell").nth(index) for index in (0, 2))
    assert first.bounding_box()["x"] == last.bounding_box()["x"]
    grid = wall.locator(".camera-grid")
    grid.evaluate("grid => grid.scrollTo(0, 0)")
    expect(last).not_to_be_in_viewport()
    wait_for_subscriptions(robots, "Bob", LONG)
    grid.evaluate("grid => grid.scrollTo(0, 9999)")
    wait_for_subscriptions(robots, LONG, "Cid")
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    assert_free(page.get_by_role("button", name="STOP ALL"))


def test_stop_is_reachable_in_full_screen_and_escape_ends_it_without_a_stop(open_page):
    page = open_page()
    wall = open_wall(page)
    full = wall.get_by_role("button", name="Full screen")
    stop = page.get_by_role("button", name="STOP ALL")
    for end, width, height in (
        ("Escape", 1280, 800),
        ("Escape", 390, 844),
        ("browser", 844, 390),
    ):
        page.set_viewport_size({"width": width, "height": height})
        expect(wall).to_have_attribute("data-dock", "side")
        before = stop.bounding_box()
        full.click()
        page.wait_for_function("document.fullscreenElement !== null")
        expect(wall).to_have_attribute("data-dock", "full")
        assert_free(stop)
        assert stop.bounding_box() == before
        assert_free(full)
        if end == "Escape":
            page.keyboard.press("Escape")
        else:
            page.evaluate("document.exitFullscreen()")
        page.wait_for_function("document.fullscreenElement === null")
        expect(wall).to_have_attribute("data-dock", "side")
    expect(page.locator(".webmap-stop-list")).to_be_hidden()
