"""The fleet at a glance: the list and the map with many robots in many states."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from console_ready import wait_until_ready
from playwright.sync_api import Browser, Page, expect

from equipment.chromium import watched_tab
from equipment.webmap_process import page_of
from webmap.features.view.view import LAYERS

pytestmark = [pytest.mark.browser, pytest.mark.slow]

SITE = Path(__file__).with_name("crowd_site.py")

ROWS = "#robots > .row:not(.filtered) .name"


@pytest.fixture(scope="module")
def site() -> Iterator[str]:
    """Run the console with 30 robots; yield its URL."""
    with page_of(SITE) as url:
        yield url


@pytest.fixture
def page(site: str, chromium: Browser) -> Iterator[Page]:
    with watched_tab(chromium, 1280, 800) as page:
        page.goto(site)
        wait_until_ready(page)
        expect(page.locator(".robot:not(.unplaced)")).to_have_count(30)
        expect(page.locator(".arrange > summary")).to_be_visible()
        yield page


def test_a_robot_has_few_elements_on_the_map_and_in_the_list(page):
    """An element of each robot costs every page memory, style and layout."""
    count = "(all) => all.length"
    on_map = page.eval_on_selector_all(".robot, .robot *", count) / 30
    in_list = page.eval_on_selector_all("#robots > .row, #robots > .row *", count) / 30
    assert on_map <= 15
    assert in_list < 22  # a condition is one more


HIDDEN_AGAIN = """() => new Promise((done) => {
  const found = new Set();
  const observer = new MutationObserver((changes) => {
    for (const { target, oldValue } of changes) {
      if (target.getAttribute("hidden") === oldValue) found.add(target.className);
    }
  });
  const options = { attributeOldValue: true, attributeFilter: ["hidden"] };
  observer.observe(document, { subtree: true, ...options });
  setTimeout(() => done([...found]), 1500);
})"""
"""The elements that the page hides although they are hidden already."""


def test_the_page_hides_nothing_that_is_hidden_already(page):
    """Each hiding makes the browser compute styles, and ticks arrive at 20 Hz."""
    page.locator("#robots > .row > button").first.click()
    assert page.evaluate(HIDDEN_AGAIN) == []


def names(page: Page) -> list[str]:
    return page.locator(ROWS).all_text_contents()


def choose(page: Page, id: str, value: str) -> None:
    if page.locator(".arrange:not([open])").count():
        page.locator(".arrange > summary").click()
    page.locator(id).select_option(value)


def test_a_long_list_has_the_worst_robots_first(page):
    expect(page.locator(ROWS).first).to_have_text("Robot 3")  # lost
    assert names(page)[:6] == [f"Robot {n}" for n in (3, 1, 2, 4, 5, 6)]


def test_the_counts_by_state_filter_the_list(page):
    chips = page.locator("#attention > .chip")
    expect(chips).to_have_text(["1 lost", "2 stopped", "1 battery low", "Next"])
    expect(page.locator("#robots-count")).to_have_text("30 robots, 4 need someone")
    chips.nth(1).click()
    expect(chips.nth(1)).to_have_attribute("aria-pressed", "true")
    assert names(page) == ["Robot 1", "Robot 2"]
    chips.nth(0).click()
    assert names(page) == ["Robot 3", "Robot 1", "Robot 2"]
    page.locator("#search").fill("robot 2")
    assert names(page) == ["Robot 2"]
    page.locator("#search").fill("nobody")
    expect(page.locator("#not-found")).to_contain_text(
        "No robot has “nobody” in its name among those that are stopped or lost."
    )


def filter_by(page: Page, group: str) -> None:
    if page.locator(".arrange:not([open])").count():
        page.locator(".arrange > summary").click()
    page.locator("#other-states > .chip", has_text=group).click()


def test_the_other_states_filter_too_and_are_above_the_list_while_they_do(page):
    filter_by(page, "driven")
    assert names(page) == ["Robot 5"]
    page.keyboard.press("Escape")
    expect(page.locator(".choices")).to_be_hidden()
    page.locator("#attention > .chip", has_text="1 driven").click()
    expect(page.locator(ROWS)).to_have_count(30)
    expect(page.locator("#attention > .chip", has_text="driven")).to_have_count(0)


def test_n_goes_to_the_next_robot_that_needs_someone(page):
    found = []
    for key in ["n", "n", "n", "n", "n", "Shift+N"]:
        before = page.locator("#card h2").text_content()
        page.keyboard.press(key)
        expect(page.locator("#card h2")).not_to_have_text(before or "")
        found.append(page.locator("#card h2").text_content())
    assert found == ["Robot 3", "Robot 1", "Robot 2", "Robot 4", "Robot 3", "Robot 4"]
    page.locator("#search").fill("")
    page.locator("#search").press("n")
    expect(page.locator("#search")).to_have_value("n")
    expect(page.locator("#card h2")).to_have_text("Robot 4")


VISIBLE = """() => {
  const list = document.querySelector("#robots").getBoundingClientRect();
  return [...document.querySelectorAll("#robots > .row")].filter((row) => {
    const { top, bottom, height } = row.getBoundingClientRect();
    return height > 0 && top >= list.top - 1 && bottom <= list.bottom + 1;
  }).length;
}"""
"""The number of lines that are visible as a whole."""


def test_sixteen_robots_are_visible_nine_beside_a_card_and_more_in_a_compact_list(page):
    page.set_viewport_size({"width": 1440, "height": 900})
    assert page.evaluate(VISIBLE) >= 16
    last = page.locator(ROWS).nth(14)
    name = last.text_content()
    last.click()
    expect(page.locator("#card h2")).to_have_text(name)
    assert page.evaluate(VISIBLE) >= 9
    # The card that opened does not cover the line of its robot.
    expect(last).to_be_in_viewport(ratio=0.9)
    page.locator("#card").get_by_role("button", name="Deselect the robot").click()
    expect(page.locator("#card")).to_be_hidden()
    choose(page, "#robot-rows", "compact")
    page.keyboard.press("Escape")
    assert page.evaluate(VISIBLE) >= 22
    page.reload()
    wait_until_ready(page)
    expect(page.locator("#robot-rows")).to_have_value("compact")
    assert page.evaluate(VISIBLE) >= 22


def test_robots_are_ordered_by_name_in_natural_order(page):
    choose(page, "#robot-order", "name")
    found = [name for name in names(page) if name.startswith("Robot")]
    assert found == [f"Robot {number}" for number in range(1, 25)]


def test_robots_are_grouped_by_their_first_tag(page):
    choose(page, "#robot-group", "tag")
    titles = page.locator("#robots > .group-name")
    expect(titles).to_have_text(["bay 0 (8)", "bay 1 (8)", "bay 2 (8)", "No tag (6)"])
    filter_by(page, "driven")  # Robot 5
    expect(titles.and_(page.locator(":visible"))).to_have_text(["bay 1 (8)"])


def test_order_groups_and_filter_are_remembered_in_the_browser(page):
    choose(page, "#robot-order", "name")
    choose(page, "#robot-group", "tag")
    page.locator(".chip", has_text="stopped").click()
    page.reload()
    wait_until_ready(page)
    expect(page.locator(ROWS)).to_have_text(["Robot 1", "Robot 2"])
    expect(page.locator("#robot-order")).to_have_value("name")
    expect(page.locator("#robot-group")).to_have_value("tag")


def test_the_arrow_keys_move_in_the_list_and_enter_selects(page):
    page.locator("#search").focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    expect(page.locator("#robots .row > button:focus .name")).to_have_text("Robot 1")
    page.keyboard.press("ArrowUp")
    page.keyboard.press("Enter")
    expect(page.locator("#card h2")).to_have_text("Robot 3")


def test_the_order_is_kept_while_the_pointer_is_over_the_list(page):
    expect(page.locator(ROWS).first).to_have_text("Robot 3")
    # As if this robot got the worst state of all robots.
    change = """() => {
      const row = [...document.querySelectorAll("#robots > .row")][9];
      row.dataset.rank = "-1";
      return row.querySelector(".name").textContent;
    }"""
    page.locator("#robots").hover()
    name = page.evaluate(change)
    page.wait_for_timeout(2500)
    assert names(page)[0] == "Robot 3"
    page.mouse.move(800, 400)
    expect(page.locator(ROWS).first).to_have_text(name)


def test_each_robot_on_the_map_has_the_shape_of_its_state_in_the_list(page):
    shape = """() => Object.fromEntries([...document.querySelectorAll(".robot")].map(
      (robot) => [robot.dataset.robot,
        robot.querySelector(".state-mark > use").getAttribute("href")]))"""
    listed = """() => Object.fromEntries([...document.querySelectorAll(".row")].map(
      (row) => [row.dataset.robot,
        row.querySelector(".shape.now use").getAttribute("href")]))"""
    assert page.evaluate(shape) == page.evaluate(listed)
    states = page.locator(".robot .words").all_text_contents()
    assert sorted(filter(None, states)) == [
        "Autonomous · battery low",
        "Lost: no new pose",
        "STOP active",
        "STOP active",
    ]
    robot = page.locator(".robot[data-name='Robot 5']")
    expect(robot.locator("> title")).to_have_text("Robot 5: Ann is driving")


def test_a_free_robot_has_no_symbol_on_the_map(page):
    mark = page.locator(".robot[data-name='Robot 6'] .state-mark")
    expect(mark).to_be_visible()  # navigating
    for free in (".robot[data-group=free]", ".cluster"):
        expect(page.locator(f"{free} .state-mark:visible")).to_have_count(0)


def test_the_list_of_layers_explains_the_colours_of_each_layer(page):
    page.locator(".webmap-layers > summary").click()
    page.locator(".webmap-layers #legend > summary").click()
    explained = page.locator("#legend li b").all_text_contents()
    assert set(LAYERS) <= set(explained)
    expect(page.locator("#legend li").first).to_be_visible()


def test_robots_that_overlap_are_one_mark_that_zooms_in(page):
    mark = page.locator(".cluster")
    expect(mark).to_have_count(1)
    expect(mark.locator(".count")).to_have_text("10")
    expect(mark).to_have_attribute(
        "aria-label", "10 robots, the worst: free. Press to zoom in"
    )
    expect(page.locator(".robot.clustered .model:visible")).to_have_count(0)
    mark.click()
    expect(mark).to_have_count(0)
    expect(page.locator("#card")).to_be_hidden()


def test_long_names_do_not_widen_the_list_and_have_a_title(page):
    name = page.locator(".row .name", has_text="xxxx")
    expect(name).to_have_attribute("title", "x" * 200)
    inside = "(e) => e.scrollWidth <= e.clientWidth"
    assert page.locator("#robots").evaluate(inside)
    label = page.locator(f".robot[data-name='{'x' * 200}'] .label")
    expect(label).to_have_text("x" * 23 + "…")
    arabic = page.locator(".row .name", has_text="عربة")
    assert arabic.evaluate("(e) => getComputedStyle(e).direction") == "rtl"


def test_a_condition_is_beside_the_activity_in_its_own_colour(page):
    row = page.locator(".row", has_text="Robot 4")
    row.locator("button").first.click()
    for place in (row, page.locator("#card")):
        state = place.locator(".state")
        expect(state).to_have_text("Autonomous · battery low", use_inner_text=True)
        colours = state.locator("span:visible").evaluate_all(
            "(all) => all.map((each) => getComputedStyle(each).color)"
        )
        assert len(set(colours)) == 2
    sheet = "Robot 4: Autonomous · battery low"
    expect(page.locator("#sheet-text")).to_have_text(sheet)
    page.keyboard.press("Control+k")
    page.keyboard.type("robot 4")
    line = page.locator(".palette-line").first
    expect(line.locator(".palette-state")).to_have_text("Autonomous · battery low")
    page.keyboard.press("Escape")
