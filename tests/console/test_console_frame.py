"""The frame of the console: the visible part of the map, the docked panels, the palette
and north up."""

import re

import pytest
from console_ready import select, title
from playwright.sync_api import Page, expect

from equipment.chromium import end_stops, hold

pytestmark = [pytest.mark.browser, pytest.mark.slow]

ROBOTS = 10

WIDE = {"width": 1440, "height": 900}

UNCOVERED = """() => {
  const step = 10;
  let [seen, all] = [0, 0];
  for (let x = step / 2; x < innerWidth; x += step) {
    for (let y = step / 2; y < innerHeight; y += step) {
      all += 1;
      if (document.elementFromPoint(x, y)?.closest("svg.webmap")) seen += 1;
    }
  }
  return seen / all;
}"""
"""The share of the window in which the map is visible."""

SIZE = """name => {
  const { width, height } = document.querySelector(name).getBoundingClientRect();
  return [width, height];
}"""

ROBOT = """() => {
  const { e, f } = document.querySelector(".robot.selected").getScreenCTM();
  return document.elementFromPoint(e, f)?.closest("svg.webmap") ? "free" : "covered";
}"""
"""Whether an element covers the selected robot."""


@pytest.mark.serial  # a late command stops the robot
def test_seven_tenths_of_the_window_are_map_while_a_robot_is_driven(open_console):
    page = open_console()
    page.set_viewport_size(WIDE)
    select(page, "Robot 1")
    hold(page.keyboard, "a", lambda: title(page).text_content() == "You are driving")
    share = page.evaluate(UNCOVERED)
    page.keyboard.up("a")
    assert share >= 0.7
    heights = [page.evaluate(SIZE, name)[1] for name in (".bar", ".drive-bar")]
    assert sum(heights) <= 90
    assert page.evaluate(SIZE, "#panel")[0] <= 320


@pytest.mark.parametrize("width", [1024, 1440])
def test_an_open_list_in_the_dock_does_not_cover_the_selected_robot(
    open_console, width
):
    page = open_console()
    page.set_viewport_size({"width": width, "height": 600})
    for name in ("Robot 1", "Robot 4", "Robot 7"):
        select(page, name)
        for tool in ("Layers", "Log", "Route"):
            summary = page.locator(f".tools summary[title={tool}]")
            summary.evaluate("e => e.click()")  # it may be folded into More
            page.wait_for_timeout(300)
            assert page.evaluate(ROBOT) == "free", (name, tool)
            summary.evaluate("e => e.click()")


PLACES = """() => {
  const robots = [...document.querySelectorAll(".robot:not(.unplaced)")];
  const places = robots.map((robot) => robot.getScreenCTM());
  return places.map(({ e, f }) => [Math.round(e), Math.round(f)]);
}"""
"""Where the robots are, in pixels of the window."""

TURNS = (
    ".tools summary:has-text('Layers')",
    ".tools summary:has-text('Alerts')",
    "#panel-turn",
)
"""What opens and closes parts beside the map."""


def turn(page: Page, part: str) -> list[list[int]]:
    """Open or close a part of the page; return where the robots are then."""
    page.locator(part).click()
    page.wait_for_timeout(300)
    return page.evaluate(PLACES)


def test_the_robots_stay_where_they_are_when_panels_open_and_close(open_console):
    page = open_console()
    page.set_viewport_size(WIDE)
    page.wait_for_timeout(300)
    places = page.evaluate(PLACES)
    assert len(places) == ROBOTS
    for part in TURNS:
        assert turn(page, part) == places, part
        assert turn(page, part) == places, part


def test_the_view_moves_as_little_as_possible_to_uncover_the_robot_and_back(
    open_console,
):
    page = open_console()
    page.set_viewport_size(WIDE)
    select(page, "Robot 1")
    map = page.locator("svg.webmap").bounding_box()
    x, y = page.locator(".robot.selected").evaluate(
        "r => (({ e, f }) => [e, f])(r.getScreenCTM())"
    )
    # To where the dock covers the robot.
    page.mouse.move(map["x"] + 300, map["y"] + 20)
    page.mouse.down()
    right = map["x"] + map["width"] - 100
    page.mouse.move(map["x"] + 300 + right - x, map["y"] + 20, steps=4)
    page.mouse.up()
    before = page.evaluate(PLACES)
    opened = turn(page, TURNS[0])
    assert page.evaluate(ROBOT) == "free"
    dock = page.locator(".webmap-layers .webmap-tool-body").bounding_box()
    for (x, y), (was_x, was_y) in zip(opened, before, strict=True):
        assert y == was_y
        assert 0 < was_x - x < right - dock["x"] + 60
    assert turn(page, TURNS[0]) == before
    # Not back if somebody has moved the view meanwhile.
    opened = turn(page, TURNS[0])
    page.locator("svg.webmap").focus()
    page.get_by_role("button", name="Zoom in").click()
    zoomed = page.evaluate(PLACES)
    assert zoomed != opened
    assert turn(page, TURNS[0]) == zoomed


def test_the_view_uncovers_the_robot_beside_the_camera_and_the_wall_and_moves_back(
    open_console,
):
    page = open_console()
    page.set_viewport_size(WIDE)
    select(page, "Robot 1")
    map = page.locator("svg.webmap").bounding_box()
    [(x, _)] = page.locator(".robot.selected").evaluate_all(
        "all => all.map(r => (({ e, f }) => [e, f])(r.getScreenCTM()))"
    )
    # To where the camera covers the robot.
    page.mouse.move(map["x"] + 600, map["y"] + 20)
    page.mouse.down()
    page.mouse.move(map["x"] + 600 + map["x"] + 100 - x, map["y"] + 20, steps=4)
    page.mouse.up()
    before = page.evaluate(PLACES)
    camera = turn(page, "#card [title^='Show the camera']")
    wall = turn(page, ".camera-wall")
    assert page.evaluate(ROBOT) == "free"
    for places in (camera, wall):
        assert all(x > was_x for (x, _), (was_x, _) in zip(places, before, strict=True))
    assert turn(page, ".camera-wall") == camera
    assert turn(page, "[aria-label='Close the camera']") == before


def width_of_panel(page: Page) -> float:
    return page.evaluate(SIZE, "#panel")[0]


def test_the_list_is_resized_and_collapsed_and_the_page_remembers_both(open_console):
    page = open_console()
    usual = width_of_panel(page)
    edge = page.get_by_role("separator", name="Width of the list")
    box = edge.bounding_box()
    page.mouse.move(box["x"] + 4, 300)
    page.mouse.down()
    page.mouse.move(400, 300, steps=4)
    page.mouse.up()
    assert width_of_panel(page) == pytest.approx(400, abs=2)
    edge.focus()
    page.keyboard.press("ArrowRight")
    wider = width_of_panel(page)
    assert wider == pytest.approx(416, abs=2)
    page.reload()
    expect(page.locator("#robots .row").first).to_be_visible()
    page.wait_for_function(
        "w => document.querySelector('#panel').clientWidth > w", arg=usual + 50
    )
    page.locator("#panel-edge").dblclick(position={"x": 4, "y": 300})
    assert width_of_panel(page) == usual
    turn = page.get_by_role("button", name="List of robots")
    turn.click()
    expect(page.locator("#panel")).to_be_hidden()
    expect(turn).to_have_attribute("aria-expanded", "false")
    page.reload()
    expect(turn).to_have_attribute("aria-expanded", "false")
    expect(page.locator("#panel")).to_be_hidden()
    turn.click()
    expect(page.locator("#panel")).to_be_visible()


def test_the_palette_finds_robots_tools_and_layers_by_keyboard(open_console):
    page = open_console()
    palette = page.get_by_role("dialog", name="Find")

    def find(text: str) -> None:
        page.keyboard.press("Control+k")
        expect(palette).to_be_visible()
        page.keyboard.type(text)
        page.keyboard.press("Enter")
        expect(palette).to_be_hidden()

    find("robot 7")
    expect(page.locator("#card h2")).to_have_text("Robot 7")
    scans = page.locator(".webmap-layers-row", has_text="Scans").locator("input")
    find("layer scans")
    expect(scans).not_to_be_checked()
    find("measure")
    expect(page.locator(".webmap-measure-word")).to_contain_text("Press")
    page.keyboard.press("Control+k")
    page.keyboard.type("no such thing")
    expect(palette).to_contain_text("Nothing on this page has this name.")
    page.keyboard.press("Escape")
    expect(palette).to_be_hidden()
    expect(title(page)).to_have_text("Free")


@pytest.mark.serial  # a late command stops the robot
def test_the_open_palette_lets_no_key_drive_and_stop_closes_it(open_console):
    page = open_console()
    select(page, "Robot 1")
    hold(page.keyboard, "a", lambda: title(page).text_content() == "You are driving")
    page.keyboard.press("Control+k")
    expect(page.get_by_role("dialog", name="Find")).to_be_visible()
    # On a busy machine the gate also ends control.
    released = re.compile("You have control|Stopping|Preparing input|Free")
    expect(title(page)).to_have_text(released)
    page.keyboard.up("a")
    page.get_by_role("button", name="STOP ALL").click()
    expect(page.get_by_role("dialog", name="Find")).to_be_hidden()
    end_stops(page.locator(".webmap-stop-list .webmap-reset"))


def test_the_palette_finds_stop_and_a_reset_that_is_pressed_twice(open_console):
    page = open_console()

    def find(text: str) -> None:
        page.keyboard.press("Control+k")
        page.keyboard.type(text)
        page.keyboard.press("Enter")

    select(page, "Robot 2")
    find("stop")  # of the selected robot
    expect(title(page)).to_have_text("STOP active")
    standing = page.locator(".webmap-stop-standing")
    expect(standing).to_contain_text("Robot 2")
    find("stop all")
    expect(standing).to_contain_text(f"{ROBOTS} robots")
    find("reset all")
    page.wait_for_timeout(600)
    expect(title(page)).to_have_text("STOP active")
    again = page.get_by_role("button", name="Press again to reset")
    expect(again).to_be_focused()
    page.keyboard.press("Enter")
    expect(standing).to_be_empty()
    find("follow")
    expect(page.get_by_role("button", name="Follow")).to_have_attribute(
        "aria-pressed", "true"
    )


def test_the_needle_shows_the_rotation_and_turns_north_up(open_console):
    page = open_console()
    north = page.get_by_role("button", name="Turn north up")
    expect(north).to_have_attribute("title", re.compile(r"turned by 0°"))
    page.locator("svg.webmap").focus()
    page.keyboard.press("]")
    expect(north).not_to_have_attribute("title", re.compile(r"turned by 0°"))
    north.click()
    expect(north).to_have_attribute("title", re.compile(r"turned by 0°"))


SIZES_ON_A_WALL = """() => {
  const names = [".row .name", "#card h2", ".robot .label", ".webmap-teleop-state"];
  return names.map((name) => {
    const element = document.querySelector(name);
    const drawn = element instanceof SVGElement && element.getScreenCTM();
    const size = Number.parseFloat(getComputedStyle(element).fontSize);
    return drawn ? size * Math.hypot(drawn.a, drawn.b) : size;
  });
}"""
"""The sizes of texts on the screen, in pixels."""


def test_a_wall_has_text_that_is_read_from_some_metres(open_console):
    page = open_console()
    page.set_viewport_size({"width": 3840, "height": 2160})
    select(page, "Robot 1")
    sizes = page.evaluate(SIZES_ON_A_WALL)
    assert min(sizes) >= 21, sizes
    assert page.evaluate(ROBOT) == "free"
