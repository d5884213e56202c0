"""The console as an operator sees and uses it."""

import re
from contextlib import contextmanager, suppress

import pytest
from console_ready import send_away, unfold
from playwright.sync_api import Page, TimeoutError, expect

pytestmark = [pytest.mark.browser, pytest.mark.slow]

ROBOTS = 6


def row(page: Page, name: str):
    return page.get_by_role("button", name=re.compile(rf"^{name}\b"))


def test_a_robot_selected_in_the_list_is_selected_on_the_map(open_console):
    page = open_console()
    row(page, "Robot 3").click()
    expect(page.locator(".robot.selected")).to_have_attribute("data-name", "Robot 3")
    expect(page.get_by_role("heading", name="Robot 3")).to_be_visible()
    expect(row(page, "Robot 3")).to_have_attribute("aria-pressed", "true")


def test_a_browser_can_install_the_console_in_a_window_of_its_own(open_console, demo):
    page = open_console()
    cdp = page.context.new_cdp_session(page)
    found = cdp.send("Page.getAppManifest")
    assert found["errors"] == []
    assert found["manifest"]["startUrl"] == demo.url.partition("?")[0]
    problems = cdp.send("Page.getInstallabilityErrors")["installabilityErrors"]
    # The window of a test is a private one.
    assert {problem["errorId"] for problem in problems} <= {"in-incognito"}


def test_a_gamepad_without_the_standard_mapping_is_named_until_it_is_gone(open_console):
    page = open_console()
    known = "index: 0, id: 'Joystick', connected: true, mapping: ''"
    pad = f"{{{known}, axes: [], buttons: []}}"
    page.evaluate(f"navigator.getGamepads = () => [{pad}]")
    notice = page.locator('.webmap-notice:has-text("Joystick")')
    expect(notice).to_contain_text(
        "has no standard layout and cannot drive: open Gamepad settings"
    )
    expect(notice).to_have_count(1)
    page.evaluate("navigator.getGamepads = () => []")
    expect(notice).to_have_count(0)


def test_a_click_on_a_robot_on_the_map_opens_its_card(open_console):
    page = open_console()
    page.locator('.robot[data-name="Robot 1"] .hit').click()
    expect(page.locator("#card h2")).to_have_text("Robot 1")
    expect(page.locator("#card dd.age")).not_to_have_class(re.compile("stale"))
    page.get_by_role("button", name="Deselect the robot").click()
    expect(page.locator("#card")).to_be_hidden()


def test_the_list_shows_the_age_the_battery_and_the_state_of_a_robot(open_console):
    page = open_console()
    first = page.locator("#robots .row").first
    expect(first.locator(".state .holder")).to_have_text("Free")
    expect(first.locator(".battery")).to_have_text(re.compile(r"^battery \d+ %$"))
    expect(first.locator(".age")).to_have_text(re.compile(r"^0\.\d s$"))


def test_the_operator_sees_you_have_control_and_another_page_sees_has_control(
    open_console,
):
    mine, theirs = open_console(), open_console()
    row(mine, "Robot 2").click()
    you = mine.locator("#card .state .you:visible")
    for _ in range(5):  # commands of a busy page are refused
        mine.get_by_role("button", name="Take control of Robot 2").click()
        with suppress(AssertionError):
            expect(you).to_have_text("You have control", timeout=3000)
            break
    expect(you).to_have_text("You have control")
    other = theirs.locator('#robots [aria-pressed]:has-text("Robot 2") .holder')
    expect(other).to_contain_text("has control")
    expect(other).to_be_visible()
    mine.get_by_role("button", name="Release control of Robot 2").click()
    expect(mine.locator("#card .state .holder")).to_have_text("Free")


@pytest.mark.parametrize("size", ["desk", "phone"])
def test_stop_all_is_visible_and_large_and_stops_all_robots(open_console, size):
    page = open_console(size)
    stop = page.get_by_role("button", name="STOP ALL")
    expect(stop).to_be_in_viewport(ratio=1)
    assert stop.bounding_box()["height"] >= 56
    row_ = page.locator("#sheet")
    if size == "phone":
        row_.click()
        expect(page.locator("#robots")).to_be_in_viewport()
        expect(stop).to_be_in_viewport(ratio=1)
        assert stop.bounding_box()["width"] > 250
    stop.click()
    expect(page.locator(".webmap-stop-verdict").first).to_be_visible()
    expect(page.locator(".webmap-stop-standing")).to_contain_text(f"{ROBOTS} robots")
    reset = page.get_by_role("button", name="Reset all")
    reset.click()
    page.wait_for_timeout(400)
    page.get_by_role("button", name="Press again").click()
    expect(page.locator("#robots .row .holder").first).to_have_text("Free")


@pytest.mark.parametrize("size", ["desk", "phone"])
def test_every_button_input_and_summary_is_at_least_44_pixels_large(open_console, size):
    page = open_console(size)
    if size == "phone":
        page.locator("#sheet").click()
    row(page, "Robot 0").click()
    expect(page.locator("#card")).to_be_visible()
    # A press on the label of a checkbox is a press on the checkbox.
    small = page.evaluate(
        """() => [...document.querySelectorAll('button, input, summary')]
            .map(e => e.closest('label') ?? e)
            .map(e => [e.innerText || e.getAttribute('aria-label') || e.id,
                       e.getBoundingClientRect()])
            .filter(([, r]) => r.width > 0 && (r.width < 43.9 || r.height < 43.9))
            .map(([name, r]) => `${name} ${r.width}x${r.height}`)"""
    )
    assert small == []


def test_the_sheet_opens_over_the_map_and_closes(open_console):
    page = open_console("phone")
    before = page.locator("svg.webmap").bounding_box()
    handle = page.locator("#sheet")
    expect(page.locator("#robots")).to_be_hidden()
    handle.click()
    expect(handle).to_have_attribute("aria-expanded", "true")
    expect(page.locator("#robots")).to_be_visible()
    assert page.locator("svg.webmap").bounding_box() == before
    handle.click()
    expect(page.locator("#robots")).to_be_hidden()


def test_the_page_is_not_wider_than_a_phone(open_console):
    page = open_console("phone")
    width = page.evaluate("document.documentElement.scrollWidth")
    assert width == 390


def test_help_opens_by_its_key_and_closes(open_console):
    page = open_console()
    help_ = page.get_by_role("dialog", name="Keys and gestures")
    page.keyboard.press("?")
    expect(help_).to_be_visible()
    page.keyboard.press("?")
    expect(help_).to_be_hidden()
    page.get_by_role("button", name="Help: keys and gestures").click()
    expect(help_).to_be_visible()
    page.get_by_role("button", name="Close help").click()
    expect(help_).to_be_hidden()


def scale_of(page: Page) -> float:
    return page.locator("g.world").evaluate(
        "g => Math.hypot(g.getCTM().a, g.getCTM().b)"
    )


def test_the_buttons_of_the_view_zoom_in_and_show_everything(open_console):
    page = open_console()
    whole = scale_of(page)
    page.get_by_role("button", name="Zoom in").click()
    assert scale_of(page) == pytest.approx(1.5 * whole)
    page.get_by_role("button", name="Show everything").click()
    assert scale_of(page) == pytest.approx(whole, rel=0.02)


@pytest.mark.parametrize("way", ["button", "key"])
def test_show_everything_fits_the_floor_and_all_robots_beside_the_card(
    open_console, way
):
    page = open_console()
    page.locator("g.world").evaluate(
        """world => {
          const far = world.querySelector(".robot").cloneNode();
          far.id = "far";
          far.setAttribute("transform", "matrix(1 0 0 1 60 45)");
          world.append(far);
        }"""
    )
    row(page, "Robot 4").click()
    expect(page.locator("#card")).to_be_visible()
    if way == "key":
        page.locator("svg.webmap").focus()
        page.keyboard.press("0")
    else:
        page.get_by_role("button", name="Show everything").click()
    card = page.locator("#card").bounding_box()
    free = card["x"] + card["width"]
    top = page.locator("svg.webmap").bounding_box()["y"]
    for name in ("#far", ".floor.day"):
        box = page.locator(name).evaluate(
            """one => {
              const box = one.getBBox();
              const { a, b, c, d, e, f } = one.getScreenCTM();
              const at = (x, y) => [a * x + c * y + e, b * x + d * y + f];
              return [at(box.x, box.y), at(box.x + box.width, box.y + box.height)];
            }"""
        )
        for x, y in box:
            assert free < x < page.viewport_size["width"]
            assert top < y < page.viewport_size["height"]


def from_the_middle(page: Page) -> list[float]:
    """Return how far from the map's middle the selected robot is, in pixels."""
    return page.evaluate(
        """() => {
          const map = document.querySelector("svg.webmap").getBoundingClientRect();
          const { e, f } = document.querySelector(".robot.selected").getCTM();
          return [e - map.width / 2, f - map.height / 2];
        }"""
    )


IN_THE_MIDDLE = pytest.approx([0, 0], abs=3)

WENT = """([x, y]) => {
  const robot = document.querySelector(".robot.selected");
  const { e, f } = robot.transform.baseVal[0].matrix;
  return Math.hypot(e - x, f - y) >= 0.5;
}"""


@contextmanager
def driven(page: Page):
    """Drive the selected robot half a metre forward or back, and keep driving."""
    start = page.locator(".robot.selected").evaluate(
        "r => (({ e, f }) => [e, f])(r.transform.baseVal[0].matrix)"
    )
    page.locator("svg.webmap").focus()
    for key in 4 * "ws":  # a busy page drives nothing
        page.wait_for_timeout(
            300
        )  # the keys must be released for a while before a press
        page.keyboard.down(key)
        try:
            page.wait_for_function(WENT, arg=start, timeout=3000)
        except TimeoutError:
            continue
        else:
            yield
            return
        finally:
            page.keyboard.up(key)
    raise AssertionError(page.locator(".webmap-teleop").inner_text())


@pytest.mark.serial  # a late command stops the robot
def test_follow_keeps_a_driven_robot_in_the_centre_until_pressed_again(
    open_console,
):
    page = open_console()
    row(page, "Robot 4").click()
    follow = page.get_by_role("button", name="Follow")
    follow.click()
    expect(follow).to_have_attribute("aria-pressed", "true")
    for _ in range(2):
        page.get_by_role("button", name="Zoom in").click()
        assert from_the_middle(page) == IN_THE_MIDDLE
    with driven(page):
        assert from_the_middle(page) == IN_THE_MIDDLE
    follow.click()
    expect(follow).to_have_attribute("aria-pressed", "false")
    with driven(page):
        assert from_the_middle(page) != IN_THE_MIDDLE


def test_send_goal_first_shows_an_instruction(open_console):
    page = open_console()
    row(page, "Robot 5").click()
    page.get_by_role("button", name="Send goal…").click()
    expect(page.locator(".webmap-goal-word")).to_have_text(
        re.compile("Press on the map")
    )
    page.keyboard.press("Escape")
    expect(page.locator(".webmap-goal-word")).to_be_hidden()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_has_enough_contrast_on_its_background(open_console, scheme):
    page = open_console(scheme=scheme)
    row(page, "Robot 0").click()
    expect(page.locator("#card")).to_be_visible()
    low = page.evaluate(CONTRAST)
    assert low == []


CONTRAST = """() => {
  const rgb = c => c.match(/[\\d.]+/g).map(Number);
  const lum = ([r, g, b]) => [r, g, b].map(v => v / 255)
    .map(v => v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const surface = e => {
    for (; e; e = e.parentElement) {
      const c = rgb(getComputedStyle(e).backgroundColor);
      if (c.length < 4 || c[3] > 0.9) return c;
    }
    return [255, 255, 255];
  };
  const low = [];
  for (const e of document.querySelectorAll('header *, aside *')) {
    if (!e.checkVisibility() || e.disabled || e.namespaceURI.includes('svg')) continue;
    const own = [...e.childNodes].some(n => n.nodeType === 3 && n.data.trim());
    if (!own) continue;
    const a = lum(rgb(getComputedStyle(e).color)), b = lum(surface(e));
    const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (ratio < 4.5) low.push(`${e.textContent} ${ratio.toFixed(1)}`);
  }
  return low;
}"""


def test_the_card_shows_the_camera_picture_of_the_selected_robot(open_console):
    page = open_console()
    row(page, "Robot 1").click()
    picture = page.get_by_role("img", name="Camera of Robot 1")
    expect(picture).to_be_visible()
    page.wait_for_function(
        "document.querySelector('.cameras img').naturalWidth === 320"
    )
    expect(page.locator(".cameras .picture-age")).to_have_text(re.compile(r"^0\.\d s$"))
    row(page, "Robot 2").click()
    expect(page.get_by_role("img", name="Camera of Robot 2")).to_be_visible()
    expect(picture).to_have_count(0)


def test_the_measure_tool_shows_a_length_on_the_map(open_console):
    page = open_console()
    page.get_by_role("button", name="Measure").click()
    box = page.locator("svg.webmap").bounding_box()
    x, y = box["x"] + 300, box["y"] + 400
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 100, y)
    page.mouse.up()
    scale = page.locator("svg.webmap > .world").evaluate("e => e.getCTM().a")
    expect(page.locator(".webmap-measure-word")).to_have_text(
        f"{100 / scale:.2f} m, 0°"
    )
    assert page.locator(".robot.selected").count() == 0
    page.keyboard.press("Escape")
    expect(page.locator(".webmap-measure-drawing")).to_be_hidden()


def test_a_layer_switched_off_for_one_viewer_stays_off_after_a_reload(open_console):
    page, other = open_console(), open_console()
    scans = page.locator(".robot .laserscan")
    expect(scans.first).to_be_visible()
    page.locator(".webmap-layers > summary").click()
    page.get_by_role("checkbox", name="Scans").uncheck()
    expect(scans.first).to_be_hidden()
    expect(other.locator(".robot .laserscan").first).to_be_visible()
    page.reload()
    expect(page.locator(".robot:not(.unplaced)")).to_have_count(ROBOTS)
    expect(scans.first).to_be_hidden()
    page.locator(".webmap-layers > summary").click()
    page.get_by_role("checkbox", name="Scans").check()
    expect(scans.first).to_be_visible()
    expect(page.get_by_role("checkbox", name="Costmaps")).to_have_count(0)


def test_route_points_can_be_added_by_touch_after_set_pose_in_between(
    open_console,
):
    page = open_console("phone")
    page.locator("#sheet").tap()
    page.locator("#robots .row").first.tap()
    page.locator("#sheet").tap()
    page.locator(".webmap-route > summary").tap()
    edit = page.locator(".webmap-route-edit")
    edit.tap()
    points = page.locator(".webmap-route-list > li")
    floor = page.locator("image.floor.day").bounding_box()

    def tap_floor(count: int) -> None:
        # In the lower left, where there is neither a panel nor the stick.
        page.touchscreen.tap(
            floor["x"] + 0.1 * count * floor["width"],
            floor["y"] + 0.8 * floor["height"],
        )

    tap_floor(1)
    expect(points).to_have_count(1)
    page.locator("#sheet").tap()
    unfold(page)
    page.get_by_role("button", name="Set pose").tap()
    expect(
        page.locator(".webmap-route > .webmap-tool-body > .webmap-route-word")
    ).to_have_text("Waiting: finish the other tool, then add more points.")
    tap_floor(2)
    expect(page.locator(".webmap-locate-word")).to_contain_text(
        re.compile("^Pose sent|^Pose not sent")
    )
    expect(edit).to_have_text("Done")
    for count in (2, 3):
        tap_floor(count)
        expect(points).to_have_count(count)
    expect(page.locator(".robot.selected")).to_have_count(1)
    edit.tap()
    tap_floor(4)
    expect(page.locator(".robot.selected")).to_have_count(0)


def test_the_log_shows_lines_of_robots_of_the_selected_level(
    open_console,
):
    page = open_console()
    log = page.locator(".webmap-rosout")
    log.locator("summary").click()
    expect(log.locator(".webmap-rosout-count")).to_have_text("No log lines yet.")
    page.locator("#robots .row").first.click()
    send_away(page)
    line = log.locator(".webmap-rosout-line", has_text="goal").last
    expect(line).to_have_attribute("data-level", "info")
    expect(line.locator("strong")).to_have_text("Info")
    expect(line.locator(".webmap-rosout-text")).to_contain_text("goal")
    expect(line.locator(".webmap-rosout-age")).to_have_text(re.compile(r"^\d+ s$"))
    log.get_by_label("Show").select_option("error")
    expect(line).to_be_hidden()
    page.reload()
    expect(log.get_by_label("Show")).to_have_value("error")
    log.get_by_label("Show").select_option("debug")
    expect(line).to_be_visible()
