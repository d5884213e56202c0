"""Take screenshots of every state of the console, and put them on contact sheets.

Usage: tools/contact_sheet.py [FOLDER] [SIZE ...] [light] [dark] [forced]

Each sheet has the states of one size of the window in one theme, as PNG files in the
folder, ``test-results/screenshots`` by default. Needs Chromium. The sizes are the keys
of ``SIZES``; without any, the sheets of all sizes are made. Without a theme, light and
dark sheets are made; ``forced`` is light with forced colours.
"""

import io
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

from PIL import Image, ImageDraw
from playwright.sync_api import Browser, Page, sync_playwright
from screenshots import ARGS, running

FOLDER = Path(__file__).parents[1] / "test-results" / "screenshots"

SIZES = {
    "1024x600": (1024, 600),
    "1440x900": (1440, 900),
    "1920x1080": (1920, 1080),
    "3840x2160": (3840, 2160),
    "phone": (390, 844),
    "phone-landscape": (844, 390),
    "tablet": (820, 1180),
}

THEMES = ("light", "dark", "forced")

TOUCH = {"phone", "phone-landscape", "tablet"}

THUMBNAIL = 480
"""Width of a thumbnail in pixels; a row of the sheet is 2400 pixels wide."""


def click(selector: str) -> Callable[[Page], None]:
    """Return a step that clicks an element, even if the element is not visible."""
    return lambda page: page.locator(selector).first.dispatch_event("click")


def press(*keys: str) -> Callable[[Page], None]:
    """Return a step that presses keys, one after the other."""

    def step(page: Page) -> None:
        for key in keys:
            page.keyboard.press(key)

    return step


def unfold(selector: str, *, on: bool = True) -> Callable[[Page], None]:
    """Return a step that opens or closes a list."""
    change = f"e => {{ e.open = {str(on).lower()}; }}"
    return lambda page: page.locator(selector).first.evaluate(change)


def hold(key: str) -> Callable[[Page], None]:
    """Return a step that presses a key and does not release it."""
    return lambda page: page.keyboard.down(key)


def release(key: str) -> Callable[[Page], None]:
    """Return a step that releases a key."""
    return lambda page: page.keyboard.up(key)


def send_goal(page: Page) -> None:
    """Send the selected robot to the middle of the map."""
    box = page.locator("svg.webmap").bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] * 0.55)
    page.mouse.down()
    page.mouse.up()


def reset(page: Page) -> None:
    """End a STOP, if there is one: its button needs two deliberate presses."""
    button = page.locator(".webmap-stop-list .webmap-reset").first
    if not button.count():
        return
    button.dispatch_event("click")
    page.wait_for_timeout(500)
    button.dispatch_event("click")


def mark_all(page: Page) -> None:
    """Select the other robots too."""
    page.evaluate("document.querySelectorAll('.besides').forEach((e) => e.click())")


def turn_sheet(page: Page) -> None:
    """Open or close the sheet with the list and the card, if it is visible."""
    sheet = page.locator("#sheet")
    if sheet.is_visible():
        sheet.dispatch_event("click")


STATES: tuple[tuple[str, tuple[Callable[[Page], None], ...]], ...] = (
    ("nothing selected", ()),
    ("selected", (click("#robots > .row > button"),)),
    ("list and card of a phone", (turn_sheet,)),
    ("more", (unfold("#card .more"),)),
    ("the map again", (unfold("#card .more", on=False), turn_sheet)),
    ("driving", (hold("a"),)),
    ("figures", (click(".webmap-teleop-fold"),)),
    ("STOP", (click(".webmap-teleop-fold"), release("a"), press("Shift+Escape"))),
    ("reset", (reset,)),
    ("aiming a goal", (press("g"),)),
    ("a goal", (send_goal,)),
    ("layers", (unfold(".webmap-layers"),)),
    ("log", (unfold(".webmap-rosout"),)),
    ("route", (unfold(".webmap-route"),)),
    ("palette", (unfold(".webmap-route", on=False), press("Control+k"))),
    ("help", (press("Escape", "?"),)),
    ("camera", (press("Escape"), click(".camera-small"))),
    ("measuring", (press("m"),)),
    ("several robots", (press("m"), click(".camera-close"), mark_all)),
)
"""The name of each state, and the steps from the state before."""


def pictures(browser: Browser, url: str, size: str, scheme: str) -> list[Image.Image]:
    """Open the page in each state and return the thumbnails."""
    width, height = SIZES[size]
    context = browser.new_context(
        color_scheme="dark" if scheme == "dark" else "light",
        forced_colors="active" if scheme == "forced" else "none",
        viewport={"width": width, "height": height},
        has_touch=size in TOUCH,
    )
    page = context.new_page()
    page.goto(url.partition("?")[0])
    found = [thumbnail(page, "sign-in")]
    page.goto(url)
    page.locator(".robot:not(.unplaced)").nth(1).wait_for()
    page.locator(".webmap-teleop-stop").wait_for(state="attached")
    page.wait_for_timeout(2000)
    reset(page)  # the sheet before ended with a STOP
    narrow = width <= 896
    for name, steps in STATES:
        if "phone" in name and not narrow:
            continue
        for step in steps:
            step(page)
        page.wait_for_timeout(900)
        found.append(thumbnail(page, name))
    context.close()
    return found


def thumbnail(page: Page, name: str) -> Image.Image:
    """Return a picture of the page with the name of its state below."""
    picture = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
    across = THUMBNAIL if picture.width >= picture.height else THUMBNAIL // 2
    down = round(picture.height * across / picture.width)
    sheet = Image.new("RGB", (across, down + 18), "white")
    sheet.paste(picture.resize((across, down), Image.Resampling.LANCZOS))
    ImageDraw.Draw(sheet).text((4, down + 3), name, fill="black")
    return sheet


def joined(images: list[Image.Image]) -> Image.Image:
    """Return all pictures in rows."""
    across, down = images[0].size
    columns = 2400 // across
    rows = -(-len(images) // columns)
    sheet = Image.new("RGB", (columns * (across + 8), rows * (down + 8)), "#888888")
    for index, image in enumerate(images):
        row, column = divmod(index, columns)
        sheet.paste(image, (column * (across + 8), row * (down + 8)))
    return sheet


def main(arguments: list[str]) -> None:
    """Make the contact sheets."""
    sizes = [name for name in arguments if name in SIZES] or list(SIZES)
    schemes = [name for name in THEMES if name in arguments] or THEMES[:2]
    others = [name for name in arguments if name not in (*SIZES, *THEMES)]
    folder = Path(others[0]) if others else FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    with sync_playwright() as playwright, running("demo", "--no-browser") as url:
        browser = playwright.chromium.launch(
            executable_path=shutil.which("chromium"), args=ARGS
        )
        for size in sizes:
            for scheme in schemes:
                file = folder / f"{size}-{scheme}.png"
                joined(pictures(browser, url, size, scheme)).save(file)
                print(file)
        browser.close()


if __name__ == "__main__":
    main(sys.argv[1:])
