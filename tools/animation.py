"""Take the animated picture of the README from the running demo.

Usage: tools/animation.py [FILE]

An operator selects a robot, drives it and stops it. The picture is an animated WebP,
docs/images/demo.webp by default. Needs Chromium.
"""

import base64
import io
import math
import os
import sys
import tempfile
from pathlib import Path
from shutil import which
from typing import Any

from PIL import Image, ImageDraw, ImageFont
from playwright.sync_api import Page, sync_playwright
from screenshots import ARGS, FOLDER, demo, drive, select

SIZE = (1280, 760)
"""Size of the page, in CSS pixels."""

WIDTH = 1040
"""Width of the picture, in pixels."""

EVERY = 6
"""Chromium sends one of this number of frames of the page."""

FRAME = 0.14
"""Least seconds between two frames of the picture."""

QUALITIES = (75, 60, 45, 30)
"""Qualities of the picture; the first one with a small enough file is used."""

LARGEST = 2_000_000
"""Most bytes of the file."""

ROBOT = "Robot 1"

FAR = 50
"""Pixels that the robot must move on the page."""

TURN_FOR = 500
"""Milliseconds for which the robot turns."""


class Recording:
    """Frames of a page, each with its time and a caption.

    Chromium sends a frame when the page has changed. This needs less time of the page
    than screenshots: a page that is too busy does not drive.

    Args:
        page: The page.

    """

    def __init__(self, page: Page) -> None:
        self.caption = ""
        self._frames: list[Image.Image] = []
        self._times: list[float] = []
        self._font = ImageFont.load_default(20)
        self._session = page.context.new_cdp_session(page)
        self._session.on("Page.screencastFrame", self._take)
        self._session.send(
            "Page.startScreencast",
            {"format": "png", "everyNthFrame": EVERY},
        )

    def end(self) -> None:
        """Stop recording."""
        self._session.send("Page.stopScreencast")

    def _take(self, sent: dict[str, Any]) -> None:
        answer = {"sessionId": sent["sessionId"]}
        self._session.send("Page.screencastFrameAck", answer)
        at = sent["metadata"]["timestamp"]
        if not self._times or at - self._times[-1] >= FRAME:
            self._times.append(at)
            shot = Image.open(io.BytesIO(base64.b64decode(sent["data"])))
            height = round(shot.height * WIDTH / shot.width)
            frame = shot.convert("RGB").resize((WIDTH, height))
            self._frames.append(self._captioned(frame))

    def save(self, file: Path, quality: int) -> None:
        """Write the frames as an animated WebP that repeats for ever.

        Args:
            file: The file.
            quality: 0 to 100.

        """
        ends = [*self._times[1:], self._times[-1] + 1.5]
        shown = [
            round(1000 * (end - begin))
            for begin, end in zip(self._times, ends, strict=True)
        ]
        first, *others = self._frames
        first.save(
            file,
            save_all=True,
            append_images=others,
            duration=shown,
            loop=0,
            quality=quality,
        )

    def _captioned(self, frame: Image.Image) -> Image.Image:
        """Return a frame with the caption below the middle of the map."""
        if not self.caption:
            return frame
        draw = ImageDraw.Draw(frame)
        at = (frame.width * 0.62, frame.height * 0.86)
        left, top, right, bottom = draw.textbbox(
            at, self.caption, font=self._font, anchor="mm"
        )
        box = (left - 16, top - 10, right + 16, bottom + 10)
        draw.rounded_rectangle(box, radius=10, fill="#1d2530")
        draw.text(at, self.caption, font=self._font, anchor="mm", fill="white")
        return frame


PLACE = """() => {
  const { e, f } = document.querySelector(".robot.selected").getScreenCTM();
  return [e, f];
}"""


def act(page: Page, recording: Recording) -> None:
    """Select a robot, drive it and stop it, as an operator does."""
    recording.caption = "Select a robot"
    page.wait_for_timeout(1500)
    select(page, ROBOT)
    page.wait_for_timeout(1500)
    recording.caption = "Hold W to drive, A and D to turn"
    start = page.evaluate(PLACE)
    drive(page)
    page.keyboard.down("d")
    page.wait_for_timeout(TURN_FOR)
    page.keyboard.up("d")
    page.wait_for_timeout(2000)
    moved = math.dist(start, page.evaluate(PLACE))
    if moved < FAR:
        raise SystemExit(
            f"the robot moved by {moved:.0f} pixels, expected {FAR} or more: the "
            f"machine is too busy, run this again when it is quiet"
        )
    recording.caption = "Space: STOP, until somebody presses Reset"
    page.keyboard.press("Space")
    page.keyboard.up("w")
    page.locator('.webmap-stop-verdict[data-state="confirmed"]').wait_for()
    page.wait_for_timeout(2000)


def main(file: Path) -> None:
    """Run the demo and write the picture."""
    with tempfile.TemporaryDirectory() as state, sync_playwright() as playwright:
        os.environ["WEBMAP_STATE_DIR"] = state  # the STOP ends with the recording
        browser = playwright.chromium.launch(
            executable_path=which("chromium"), args=ARGS
        )
        with demo() as url:
            page = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
            page.set_default_timeout(90_000)
            page.goto(url)
            page.locator('#link[data-link="open"]').wait_for()
            page.locator(".laserscan > path.dot[d]").nth(4).wait_for(state="attached")
            page.locator(".path > polyline[points]").nth(2).wait_for(state="attached")
            recording = Recording(page)
            act(page, recording)
            recording.end()
        browser.close()
    for quality in QUALITIES:
        recording.save(file, quality)
        size = file.stat().st_size
        print(f"{file}: {size} bytes with a quality of {quality}")
        if size <= LARGEST:
            return
    raise SystemExit(f"the file has {size} bytes, more than {LARGEST}: lower WIDTH")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER / "demo.webp")
