"""A camera with video in a real browser: what is drawn, and when that is stale."""

import re

import pytest
from console_ready import wait_until_ready
from playwright.sync_api import Page, expect
from test_console_camera import hold_w, moves_within, running, sent

from equipment.chromium import Complaints
from equipment.video_publisher import VideoPublisher
from equipment.videos import EVERY, packets

pytestmark = [pytest.mark.browser, pytest.mark.slow]

FLEET = """
[bridges]
hall = "{bridge}"

[[robots]]
name = "Bob"
odometry = "/robot_0/odom"
twist = {{ topic = "/robot_0/cmd_vel", stops_within = 0.25 }}
cameras = [
  {{ topic = "/bob/video", type = "foxglove_msgs/CompressedVideo", name = "Front" }},
  {{ topic = "/robot_0/camera/image_raw/compressed", name = "Rear" }},
]
"""

SQUARE = """canvas => {
    // Where the yellow square begins: the first column whose middle is rather red.
    const { width, height } = canvas;
    const copy = new OffscreenCanvas(width, height);
    const pen = copy.getContext("2d", { willReadFrequently: true });
    pen.drawImage(canvas, 0, 0);
    const line = pen.getImageData(0, height / 2, width, 1).data;
    for (let x = 0; x < width; x++) if (line[4 * x] > 150) return [width, height, x];
    return [width, height, -1];
}"""


@pytest.fixture(scope="module")
def bridge():
    with running(
        "sim", "--robots", "1", "--port", "0", pattern=r"at (ws\S+)"
    ) as bridge:
        yield bridge


@pytest.fixture(scope="module")
def publisher(bridge):
    publisher = VideoPublisher(bridge, "/bob/video")
    yield publisher
    publisher.stop()


@pytest.fixture(scope="module")
def url(bridge, publisher, tmp_path_factory):
    fleet = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    fleet.write_text(FLEET.format(bridge=bridge))
    run = ("run", str(fleet), "--port", "0", "--no-browser")
    with running(*run, pattern=r"ready at (\S+)") as url:
        yield url


@pytest.fixture
def open_page(chromium, url, publisher):
    publisher.frozen = publisher.skips = False
    publisher.format, publisher.packets = "h264", packets("h264")
    contexts, complaints = [], Complaints()

    def open_(script=None) -> Page:
        context = chromium.new_context(viewport={"width": 1280, "height": 800})
        contexts.append(context)
        complaints.listen(context)
        page = context.new_page()
        if script is not None:
            page.add_init_script(script)
        page.goto(url)
        expect(page.locator(".robot:not(.unplaced)")).to_have_count(1)
        wait_until_ready(page)
        page.locator("#robots button").first.click()
        return page

    yield open_
    for context in contexts:
        context.close()
    assert not complaints.unexpected, complaints.unexpected


def large(page: Page, name="Front"):
    page.locator("#card .camera-small", has_text=name).click()
    return page.get_by_role("region", name="Camera")


def places(page: Page, canvas, count=3) -> None:
    """Wait until the square has been at several places."""
    found = []
    while len(found) < count:
        place = canvas.evaluate(SQUARE)
        if place[:2] == [160, 120] and place not in found:
            found.append(place)
        page.wait_for_timeout(20)


def test_the_card_and_the_panel_draw_the_video_and_its_pictures_change(open_page):
    page = open_page()
    small = page.locator("#card .camera-video canvas")
    places(page, small)
    panel = large(page)
    canvas = panel.locator("canvas.camera-image")
    expect(canvas).to_be_visible()
    assert canvas.get_attribute("aria-label") == "Picture of Bob: Front"
    places(page, canvas)
    expect(panel.locator(".camera-age")).to_have_text(re.compile(r"^0\.\d s$"))
    expect(panel.locator(".camera-word")).to_be_empty()
    expect(small).to_have_count(0)  # the large one is enough
    panel.get_by_role("button", name="Rear").click()
    expect(panel.locator("img.camera-image")).to_be_visible()
    expect(canvas).to_have_count(0)
    panel.get_by_role("button", name="Front").click()
    places(page, canvas)


def test_a_second_page_begins_with_the_kept_packets_before_the_next_key_picture(
    open_page, publisher
):
    places(open_page(), large(open_page()).locator("canvas"))
    page = open_page()
    # From now on there is no key picture: what is drawn comes from the kept packets.
    publisher.packets = [
        each for number, each in enumerate(packets("h264")) if number % EVERY
    ]
    canvas = large(page).locator("canvas.camera-image")
    expect(canvas).to_be_visible(timeout=3000)


def test_a_wall_shows_video_beside_pictures(open_page):
    page = open_page()
    panel = large(page)
    panel.get_by_role("button", name="Camera wall").click()
    wall = page.get_by_role("region", name="Camera wall")
    expect(wall.locator("canvas.camera-image")).to_be_visible()
    expect(wall.locator("img.camera-image")).to_be_visible()
    places(page, wall.locator("canvas.camera-image"))


@pytest.mark.serial  # a busy machine decodes pictures too late to drive by
def test_a_driven_robot_stops_when_its_video_freezes(open_page, publisher):
    page = open_page()
    panel = large(page)
    places(page, panel.locator("canvas"))
    hold_w(page)
    publisher.frozen = True
    cell = panel.locator(".camera-cell")
    expect(cell).to_have_class(re.compile("stale"))
    expect(panel.get_by_role("status")).to_contain_text("Frozen")
    expect(sent(page)).to_have_text("0.00")
    teleop = page.locator(".webmap-teleop")
    expect(teleop).to_contain_text("o picture from the camera for 1 s")
    publisher.frozen = False
    expect(cell).not_to_have_class(re.compile("stale"))
    assert not moves_within(page, 700)
    page.keyboard.up("w")
    hold_w(page)
    page.keyboard.up("w")


def test_a_video_with_lost_messages_gets_stale_and_says_why(open_page, publisher):
    page = open_page()
    panel = large(page)
    places(page, panel.locator("canvas"))
    # Only pictures that refer to lost ones come: they must not look new.
    publisher.packets = packets("h264")[3:8]
    status = panel.locator(".camera-word")
    expect(panel.locator(".camera-cell")).to_have_class(re.compile("stale"))
    expect(status).to_contain_text("was lost: waiting for a key picture (IDR).")
    expect(status).to_contain_text("no key picture", ignore_case=True, timeout=10_000)
    expect(page.locator("#card")).to_contain_text("no key picture (IDR) came for 5 s")
    publisher.packets = packets("h264")
    expect(panel.locator(".camera-cell")).not_to_have_class(re.compile("stale"))
    expect(status).to_be_empty()


def test_vp9_is_drawn_and_unknown_data_is_named(open_page, publisher):
    page = open_page()
    panel = large(page)
    canvas, status = panel.locator("canvas"), panel.locator(".camera-word")
    publisher.format, publisher.packets = "vp9", packets("vp9")
    page.wait_for_timeout(500)
    places(page, canvas)
    expect(status).to_be_empty()
    publisher.format = "hevc_nvenc"
    expect(status).to_contain_text("codec 'hevc_nvenc'; supported are h264 and vp9")
    # Valid heads, and nothing that can be decoded.
    publisher.format = "h264"
    publisher.packets = [
        each[:60] + bytes(reversed(each[60:])) for each in packets("h264")
    ][:1]
    expect(panel.locator(".camera-cell")).to_have_class(re.compile("stale"))
    expect(status).to_contain_text("could not decode the video")
    publisher.packets = [b"not a video"]
    expect(status).to_contain_text(
        "A video packet that does not begin with a start code"
    )


def test_without_a_secure_context_the_page_names_tls_and_shows_jpeg_cameras(open_page):
    page = open_page(
        "delete window.VideoDecoder;"
        "Object.defineProperty(window, 'isSecureContext', { value: false });"
    )
    words = "video only over HTTPS: start WebMap with --tls"
    expect(page.locator("#card .camera-video")).to_contain_text(words)
    expect(page.locator("#card .camera-small img")).to_be_visible()
    panel = large(page)
    expect(panel.get_by_role("status")).to_contain_text(words)
    expect(panel.locator(".camera-cell")).to_have_class(re.compile("stale"))
    panel.get_by_role("button", name="Rear").click()
    expect(panel.locator("img.camera-image")).to_be_visible()


def test_a_lost_socket_of_a_video_is_opened_again(open_page):
    page = open_page("""
        const Real = WebSocket;
        window.videos = [];
        window.WebSocket = class extends Real {
            constructor(url, protocols) {
                super(url, protocols);
                if (String(url).includes("/video/")) window.videos.push(this);
            }
        };
    """)
    canvas = large(page).locator("canvas")
    places(page, canvas)
    number = page.evaluate("videos.length")
    page.evaluate("videos.at(-1).close()")
    page.wait_for_function("number => videos.length > number", arg=number)
    places(page, canvas)
