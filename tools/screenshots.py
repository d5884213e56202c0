"""Take the pictures of the README from the running demo, into docs/images.

Usage: tools/screenshots.py [NAME ...]

Needs Chromium; without names all pictures are taken.
"""

import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from shutil import which
from typing import Literal

from playwright.sync_api import Browser, Page, sync_playwright

FOLDER = Path(__file__).parents[1] / "docs" / "images"

ARGS = ["--no-sandbox", "--disable-gpu", "--no-first-run", "--hide-scrollbars"]


@dataclass(frozen=True)
class Picture:
    """One picture of the console."""

    name: str
    scheme: Literal["light", "dark"]
    phone: bool = False

    @property
    def file(self) -> Path:
        """Where it goes."""
        return FOLDER / f"console-{self.name}.png"


PICTURES = [
    Picture("light", "light"),
    Picture("dark", "dark"),
    Picture("phone-light", "light", phone=True),
    Picture("phone-dark", "dark", phone=True),
]


@contextmanager
def demo() -> Iterator[str]:
    """Run the demo and give its page's address."""
    command = [sys.executable, "-m", "webmap", "demo", "--no-browser", "--port", "0"]
    with subprocess.Popen(
        [*command, "--robots", "6"], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        try:
            found = re.search(r"ready at (\S+)", process.stdout.readline())
            if found is None:
                raise SystemExit("the demo did not start; what it said is above")
            yield found[1]
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(10)


def open_page(browser: Browser, picture: Picture, url: str) -> Page:
    """Open the console in the picture's size and colours."""
    context = browser.new_context(
        color_scheme=picture.scheme,
        viewport={"width": 390, "height": 844}
        if picture.phone
        else {"width": 1440, "height": 900},
        device_scale_factor=2,
        has_touch=picture.phone,
    )
    page = context.new_page()
    page.goto(url)
    page.locator(".robot:not(.unplaced)").nth(5).wait_for()
    page.locator("path.dot[d]").nth(5).wait_for(state="attached")
    page.locator('#link[data-link="open"]').wait_for()
    return page


def take(browser: Browser, picture: Picture, url: str) -> None:
    """Drive a robot as an operator does, and take the picture meanwhile."""
    page = open_page(browser, picture, url)
    page.locator('.robot[data-name="Robot 1"] .hit').click()
    page.locator("#card h2", has_text="Robot 1").wait_for(state="attached")
    if picture.phone:
        # A closer look: on a small screen the whole floor is small.
        page.locator("[data-act=follow]").dispatch_event("click")
        following = page.locator("[data-act=follow][aria-pressed=true]")
        following.wait_for(state="attached")
        for _ in range(3):
            page.locator("#zoom-in").click()
    drive(page)
    picture.file.parent.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=picture.file)
    page.keyboard.up("w")
    page.context.close()


def drive(page: Page) -> None:
    """Hold a key until the robot is in motion; the page before may still hold it."""
    driving = page.locator('.webmap-teleop[data-state="driving"]')
    for _ in range(10):
        page.keyboard.down("w")
        page.wait_for_timeout(1500)
        if driving.count():
            return
        page.keyboard.up("w")
        page.wait_for_timeout(500)
    said = page.locator(".webmap-teleop-state").inner_text()
    raise SystemExit(f"the robot could not be driven: {said}")


def main(names: list[str]) -> None:
    """Take the pictures of these names, or all."""
    unknown = set(names) - {picture.name for picture in PICTURES}
    if unknown:
        raise SystemExit(f"there is no picture {', '.join(sorted(unknown))}")
    with demo() as url, sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=which("chromium"), args=ARGS
        )
        for picture in PICTURES:
            if not names or picture.name in names:
                take(browser, picture, url)
                print(picture.file)
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1:])
