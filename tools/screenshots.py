"""Take the pictures of the documentation from running programs, into docs/images.

Usage: tools/screenshots.py [NAME ...]

``console-...`` shows the demo while a robot is driven, ``layers-...`` all layers of
``webmap view``, ``manual-...`` the steps of the operator's manual. Needs Chromium.
Without names, it takes all pictures. ``manual`` takes those of the manual: take them
again after a change of the bar, the driving panel or the list. The names of the buttons
in ``manual-page``, ``manual-bar`` and ``manual-driving-bar`` come from the page.
"""

import io
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory
from typing import Literal

from callouts import box_of, copy_of, draw, parts_of, symbols
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

FOLDER = Path(__file__).parents[1] / "docs" / "images"

ARGS = ["--no-sandbox", "--disable-gpu", "--no-first-run", "--hide-scrollbars"]


CALM = """() => {
  for (const button of document.querySelectorAll(".webmap-notice button"))
    button.click();
  return !document.querySelector(".robot.stale, .laserscan.stale, .webmap-notice");
}"""


@dataclass(frozen=True)
class Picture:
    """One picture."""

    scene: Literal["console", "layers", "manual"]
    scheme: Literal["light", "dark"] = "light"
    phone: bool = False
    step: str = ""
    """The step of the manual: a key of ``STEPS``."""

    @property
    def name(self) -> str:
        """The name of the file, without its suffix."""
        if self.step:
            return f"{self.scene}-{self.step}"
        return f"{self.scene}-{'phone-' if self.phone else ''}{self.scheme}"

    @property
    def file(self) -> Path:
        """The file."""
        return FOLDER / f"{self.name}.png"

    @property
    def size(self) -> tuple[int, int]:
        """The size of the page, in CSS pixels."""
        return (390, 844) if self.phone else (1440, 900)


SCENES: tuple[Literal["console", "layers"], ...] = ("console", "layers")
SCHEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")
PICTURES = [
    Picture(scene, scheme, phone)
    for scene in SCENES
    for phone in (False, True)
    for scheme in SCHEMES
]


@contextmanager
def running(*arguments: str) -> Iterator[str]:
    """Run a command of WebMap and yield the address that it prints."""
    command = [sys.executable, "-m", "webmap", *arguments, "--port", "0"]
    with (
        TemporaryDirectory() as state,  # labels of this machine are in no picture
        subprocess.Popen(
            command,
            stdout=subprocess.PIPE,
            text=True,
            env={**os.environ, "WEBMAP_STATE_DIR": state},
        ) as process,
    ):
        assert process.stdout is not None
        try:
            found = re.search(r"ready at (\S+)", process.stdout.readline())
            if found is None:
                raise SystemExit(f"{command} did not start; its error message is above")
            yield found[1]
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(60)


@contextmanager
def demo(*options: str) -> Iterator[str]:
    """Run the demo and yield its page's address."""
    with running("demo", "--no-browser", *options) as url:
        yield url


@contextmanager
def nothing() -> Iterator[str]:
    """Run nothing, for pictures that each start their own demo."""
    yield ""


@contextmanager
def everything() -> Iterator[str]:
    """Run moving robots, show all their topics, and yield the address."""
    with (
        running("sim", "--robots", "2", "--wander", "--seed", "3") as bridge,
        running("view", bridge, "--no-browser", "--stops-within", "0.25") as url,
    ):
        yield url


def open_page(browser: Browser, picture: Picture, url: str) -> Page:
    """Open the console in the picture's size and colours."""
    width, height = picture.size
    context = browser.new_context(
        color_scheme=picture.scheme,
        viewport={"width": width, "height": height},
        device_scale_factor=1 if picture.step and not picture.phone else 2,
        has_touch=picture.phone,
    )
    page = context.new_page()
    page.set_default_timeout(90_000)
    page.goto(url)
    page.locator(".robot:not(.unplaced)").nth(1).wait_for()
    page.locator(".laserscan > path.dot[d]").nth(1).wait_for(state="attached")
    page.locator('#link[data-link="open"]').wait_for()
    return page


def take_layers(browser: Browser, picture: Picture, url: str) -> None:
    """Switch all layers on, zoom in on a robot, and take the picture."""
    page = open_page(browser, picture, url)
    for selector in (
        ".posearray > .arrow[d]",
        ".range > .cone[d]",
        ".pointcloud > [d]",
    ):
        page.locator(f'.robot[data-name="robot_1"] {selector}').first.wait_for(
            state="attached"
        )
    page.locator(".webmap-layers > summary").dispatch_event("click")
    page.get_by_label("Costmaps").dispatch_event("click")
    # The costmap of the whole map would cover everything.
    page.get_by_label("global_costmap/costmap").dispatch_event("click")
    page.locator(".occupancy-grid.costmap > image[href]").nth(1).wait_for(
        state="attached"
    )
    if picture.phone:
        page.locator(".webmap-layers > summary").dispatch_event("click")
    page.locator('.robot[data-name="robot_1"] .hit').dispatch_event("click")
    page.locator("#card h2", has_text="robot_1").wait_for(state="attached")
    page.locator("[data-act=follow]").dispatch_event("click")
    page.locator("[data-act=follow][aria-pressed=true]").wait_for(state="attached")
    for _ in range(4 if picture.phone else 1):
        page.locator("#zoom-in").dispatch_event("click")
    page.locator('.robot[data-name="robot_1"] .path > polyline[points]').wait_for(
        state="attached"
    )
    page.wait_for_timeout(2000)
    # A busy machine shows stale data and warnings: wait until there are none.
    page.wait_for_function(CALM, polling=200)
    page.screenshot(path=picture.file)
    page.context.close()


def take(browser: Browser, picture: Picture, url: str) -> None:
    """Drive a robot like an operator, and take the picture while it moves."""
    page = open_page(browser, picture, url)
    page.locator('.robot[data-name="Robot 1"] .hit').click()
    page.locator("#card h2", has_text="Robot 1").wait_for(state="attached")
    if picture.phone:
        # Zoom in: on a small screen the whole floor is small.
        page.locator("[data-act=follow]").dispatch_event("click")
        following = page.locator("[data-act=follow][aria-pressed=true]")
        following.wait_for(state="attached")
        for _ in range(3):
            page.locator("#zoom-in").click()
    drive(page)
    page.screenshot(path=picture.file)
    page.keyboard.up("w")
    page.context.close()


def select(page: Page, name: str) -> None:
    """Select a robot by a click on the map."""
    page.locator(f'.robot[data-name="{name}"] .hit').click()
    page.locator("#card h2", has_text=name).wait_for(state="attached")


def show_stop(page: Page, browser: Browser, picture: Picture, url: str) -> None:
    """Stop a robot that is driven, and wait until odometry confirms the STOP."""
    drive(page)
    page.keyboard.press("Space")
    page.locator('.webmap-stop-verdict[data-state="confirmed"]').wait_for()
    page.keyboard.up("w")


def show_goal(page: Page, browser: Browser, picture: Picture, url: str) -> None:
    """Send a robot to a pose."""
    page.locator("[data-act=send]").click()
    x, y = picture.size[0] * 0.58, picture.size[1] * 0.495
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 50, y, steps=5)
    page.mouse.up()
    page.locator('#card[data-state^="navigating"]').wait_for()
    page.wait_for_timeout(1000)


def show_request(page: Page, browser: Browser, picture: Picture, url: str) -> None:
    """Take control, and request it from a second page."""
    other = open_page(browser, picture, url)
    select(other, ROBOT)
    page.bring_to_front()
    page.locator(".webmap-teleop-lease").click()
    page.locator('.webmap-teleop[data-state="ready"]').wait_for()
    page.wait_for_timeout(1000)
    other.locator(".webmap-teleop-lease").dispatch_event("click")
    page.locator(".webmap-request").wait_for()


def show_phone(page: Page, browser: Browser, picture: Picture, url: str) -> None:
    """Zoom in on a robot, and hold the stick."""
    page.locator("[data-act=follow]").dispatch_event("click")
    page.locator("[data-act=follow][aria-pressed=true]").wait_for(state="attached")
    for _ in range(3):
        page.locator("#zoom-in").click()
    knob = page.locator(".webmap-stick-knob").bounding_box()
    assert knob is not None
    x, y = knob["x"] + knob["width"] / 2, knob["y"] + knob["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 10, y - 40, steps=5)
    page.locator(DRIVEN).wait_for()
    page.wait_for_timeout(1000)


def show_all_stopped(page: Page, browser: Browser, picture: Picture, url: str) -> None:
    """Stop all robots, and wait until odometry confirms it."""
    page.locator(".webmap-stop-all").click()
    page.locator('.webmap-stop-verdict[data-state="confirmed"]').wait_for()


ROBOT = "Robot 1"

DRIVEN = '.webmap-teleop[data-state="driving"]'

STEPS: dict[str, Callable[[Page, Browser, Picture, str], None]] = {
    "page": lambda page, browser, picture, url: page.wait_for_timeout(1000),
    "bar": lambda page, browser, picture, url: page.wait_for_timeout(1000),
    "legend": lambda page, browser, picture, url: None,
    "symbols": lambda page, browser, picture, url: None,
    "driving-bar": lambda page, browser, picture, url: drive(page),
    "stop": show_stop,
    "goal": show_goal,
    "request": show_request,
    "thirty": show_all_stopped,
    "phone": show_phone,
}
"""The actions for each picture of the operator's manual, after selecting ``ROBOT``."""

BAR = "header.bar :is(button, summary, #link), #stop-place button"
"""What the bar has: buttons, lists that unfold, and the state of the connection."""

DRIVING_BAR = ".drive-bar :is(button, .webmap-teleop-words > p)"

REGIONS = {
    "header.bar": "The bar",
    "#stop-place": "STOP and STOP ALL",
    "#robots-part": "The list of robots",
    "#card": "The card of the selected robot",
    ".map-tools": "The buttons of the view",
    "#map": "The map",
    ".drive-bar": "The driving panel",
}
"""The parts of the page; they have no names on the page itself."""

PICTURES += [Picture("manual", step=step, phone=step == "phone") for step in STEPS]


def shoot_step(page: Page, step: str) -> Image.Image:
    """Return the picture of a step, in three of them with the names of the parts."""
    if step == "legend":
        return copy_of(page, "#legend")
    if step == "symbols":
        return symbols(page)
    box, parts = box_of(page, "body"), []
    if step == "page":
        parts = [box_of(page, part, name) for part, name in REGIONS.items()]
    elif step == "bar":
        box, parts = box_of(page, "header.bar, #stop-place"), parts_of(page, BAR)
    elif step == "driving-bar":
        box, parts = box_of(page, ".drive-bar"), parts_of(page, DRIVING_BAR)
    shot = page.screenshot()
    slow = any("slow connection" in part.name for part in parts)
    if step == "driving-bar" and (slow or not page.locator(DRIVEN).count()):
        drive(page)  # a busy machine limits or ends the driving
        return shoot_step(page, step)
    if parts:
        return draw(page, shot, parts, box)
    return Image.open(io.BytesIO(shot)).convert("RGB")


def take_manual(browser: Browser, picture: Picture, url: str) -> None:
    """Take one picture of the manual, with 256 colours so that its file is small."""
    robots = "30" if picture.step == "thirty" else "3"
    with demo("--robots", robots, "--quiet") as own:
        page = open_page(browser, picture, own)
        select(page, ROBOT)
        STEPS[picture.step](page, browser, picture, own)
        shot = shoot_step(page, picture.step)
        for context in browser.contexts:
            context.close()
    few = shot.quantize(
        256, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE
    )
    few.save(picture.file, optimize=True)


def drive(page: Page) -> None:
    """Hold a key until the robot moves; the previous page may still have control."""
    driving = page.locator(DRIVEN)
    for _ in range(10):
        page.keyboard.up("w")
        page.wait_for_timeout(500)
        page.keyboard.down("w")
        page.wait_for_timeout(1500)
        if driving.count():
            return
    status = page.locator(".webmap-teleop-state").inner_text()
    raise SystemExit(f"the robot could not be driven: {status}")


def main(names: list[str]) -> None:
    """Take the pictures of these names, or all."""
    unknown = set(names) - {picture.name for picture in PICTURES} - {"manual", *SCENES}
    if unknown:
        raise SystemExit(f"there is no picture {', '.join(sorted(unknown))}")
    FOLDER.mkdir(parents=True, exist_ok=True)
    wanted = [
        picture
        for picture in PICTURES
        if not names or {picture.name, picture.scene} & set(names)
    ]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=which("chromium"), args=ARGS
        )
        for scene, show, shoot in (
            ("console", demo, take),
            ("layers", everything, take_layers),
            ("manual", nothing, take_manual),
        ):
            mine = [picture for picture in wanted if picture.scene == scene]
            if not mine:
                continue
            with show() as url:
                for picture in mine:
                    shoot(browser, picture, url)
                    print(picture.file)
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1:])
