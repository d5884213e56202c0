"""Video against pictures of one camera: bytes, and time from the robot to the screen.

Chromium encodes a moving scene of 640 x 480 as H.264, and as JPEG of the same quality
(mean PSNR). Both are published on a rosbridge, WebMap passes them on, and a page of
Chromium draws them. A time is from the publishing to the moment when the page has drawn
the picture; both are from the clock of this machine. The page decodes in software.
"""

import base64
import json
import tempfile
import time
from pathlib import Path
from typing import Any

from playwright.sync_api import Page
from websockets.sync.client import ClientConnection, connect

from benchmarks.drawing import browser_page
from benchmarks.harness import Comparison, Contender, Figures, compare, percentile
from benchmarks.processes import started

ENCODE = (Path(__file__).parent / "video.js").read_text("utf-8")
PICTURES, BITRATE = 30, 400_000
PERIOD = 0.1
"""Seconds between two pictures: longer than any of them is on its way."""

TYPES = {
    "H.264": ("/bob/video", "foxglove_msgs/CompressedVideo"),
    "JPEG": ("/bob/jpeg/compressed", "sensor_msgs/CompressedImage"),
}

FLEET = """
bridges = {{ hall = "{bridge}" }}
[[robots]]
name = "Bob"
odometry = "/robot_0/odom"
cameras = [
  {{ topic = "/bob/video", type = "foxglove_msgs/CompressedVideo", name = "H.264" }},
  {{ topic = "/bob/jpeg/compressed", name = "JPEG", throttle = 0 }},
]
"""

WATCH = """
globalThis.drawn = [];
const note = () => drawn.push((performance.timeOrigin + performance.now()) / 1000);
const draw = CanvasRenderingContext2D.prototype.drawImage;
CanvasRenderingContext2D.prototype.drawImage = function (image, ...more) {
  draw.call(this, image, ...more);
  if (image instanceof VideoFrame && this.canvas.closest(".camera-frame")) note();
};
new MutationObserver((changes) => {
  const added = changes.flatMap(({ addedNodes }) => [...addedNodes]);
  if (added.some((node) => node.matches?.("img.camera-image"))) note();
}).observe(document, { childList: true, subtree: true });
"""


def publish(
    link: ClientConnection, name: str, pictures: list[str], seconds: float
) -> list[float]:
    """Publish pictures in turn; return the time of each, in seconds since 1970."""
    topic, type = TYPES[name]
    link.send(json.dumps({"op": "advertise", "topic": topic, "type": type}))
    times: list[float] = []
    for number in range(int(seconds / PERIOD)):
        stamp = {"sec": int(time.time()), "nanosec": 0}
        message: dict[str, Any] = {"data": pictures[number % len(pictures)]}
        if name == "JPEG":
            message |= {"header": {"stamp": stamp, "frame_id": ""}, "format": "jpeg"}
        else:
            message |= {"timestamp": stamp, "frame_id": "", "format": "h264"}
        text = json.dumps({"op": "publish", "topic": topic, "msg": message})
        times.append(time.time())
        link.send(text)
        time.sleep(PERIOD)
    return times


def measure(
    page: Page, bridge: str, name: str, encoded: tuple[list[str], float], seconds: float
) -> Figures:
    """Return the figures of one format."""
    pictures, quality = encoded
    page.locator("#card .camera-small", has_text=name).click()
    page.wait_for_timeout(1000)
    with connect(bridge, compression=None) as link:
        publish(link, name, pictures, 3)
        page.evaluate("drawn.length = 0")
        sent = publish(link, name, pictures, seconds)
    drawn: list[float] = page.evaluate("drawn")
    page.get_by_role("button", name="Close the camera").click()
    waited = [
        1000 * (at - max(each for each in sent if each <= at))
        for at in drawn
        if at >= sent[0]
    ]
    sizes = [len(base64.b64decode(picture)) for picture in pictures]
    return {
        "bytes a picture (kB)": sum(sizes) / len(sizes) / 1000,
        "PSNR (dB)": quality,
        "publish to drawn, 50 % (ms)": percentile(waited, 50),
        "publish to drawn, 90 % (ms)": percentile(waited, 90),
        "pictures drawn (%)": 100 * len(waited) / len(sent),
    }


def bench(rounds: int, quick: bool = False) -> list[Comparison]:
    """Compare both formats."""
    seconds = 3 if quick else 6
    with (
        tempfile.TemporaryDirectory() as folder,
        started("sim", "--robots", 1, "--port", 0) as (bridge, _),
    ):
        fleet = Path(folder) / "fleet.toml"
        fleet.write_text(FLEET.format(bridge=bridge), "utf-8")
        run = ("run", fleet, "--port", 0, "--no-browser")
        with started(*run, state=folder) as (url, _), browser_page() as page:
            page.add_init_script(WATCH)
            page.goto(url)
            encoded = page.evaluate(ENCODE, [PICTURES, BITRATE])
            page.locator("#robots .row button").first.click()
            contenders = [
                Contender(
                    name,
                    lambda name=name: measure(  # type: ignore[misc]
                        page, bridge, name, encoded[name], seconds
                    ),
                )
                for name in TYPES
            ]
            return [compare("A camera of 640 x 480", contenders, rounds)]
