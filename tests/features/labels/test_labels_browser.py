"""Labels in a real browser: upright, added, saved, and used as goals."""

import math
import re
from collections.abc import Iterator
from contextlib import ExitStack

import pytest
from button_robot import robot_node
from gate_words import TOO_LATE
from playwright.sync_api import Browser, Page, expect

from equipment.chromium import watched_tab
from equipment.waiting import wait_for
from equipment.webmap_process import page_of, simulator, webmap

pytestmark = pytest.mark.browser

"""Why the gate refuses a goal from a busy machine; a person presses again."""

FLEET = """\
[bridges]
hall = "{url}"

[[robots]]
name = "Bob"
odometry = "/robot_0/odom"
twist = {{ topic = "/robot_0/cmd_vel", stops_within = 0.25 }}
move = "/robot_0/move_base_simple/goal"

[map]
topic = "/map"

[[labels]]
name = "Äpfel <b>"
x = 3.0
y = 2.0
icon = "shelf"
kind = "fruit"

[[labels]]
name = "Next to it"
x = 3.1
y = 2.1
"""


@pytest.fixture(scope="module")
def bridge() -> Iterator[str]:
    with simulator("--robots", "1") as url:
        yield url


@pytest.fixture(scope="module")
def state(tmp_path_factory):
    return tmp_path_factory.mktemp("state")


@pytest.fixture(scope="module")
def serve(bridge, state, tmp_path_factory):
    """Start the console; a second console uses the same state."""
    file = tmp_path_factory.mktemp("fleet") / "fleet.toml"
    file.write_text(FLEET.format(url=bridge))
    running = ExitStack()

    def serve_() -> str:
        shown = page_of(file, WEBMAP_STATE_DIR=str(state))
        serve_.url = running.enter_context(shown)  # with the token
        return serve_.url

    serve_.end, serve_.url = running.close, ""
    with running:
        yield serve_


@pytest.fixture(scope="module")
def tab(chromium: Browser, serve) -> Iterator[Page]:
    with watched_tab(chromium, 1280, 800) as page:
        opened(page, serve())
        yield page


def opened(tab: Page, url: str) -> None:
    tab.goto(url)
    expect(tab.locator("#link")).to_have_attribute("data-link", "open")
    expect(tab.locator(".robot:not(.unplaced)")).to_have_count(1)
    expect(tab.locator(".occupancy-grid image")).to_have_attribute(
        "href", re.compile(".")
    )
    # From here on the test moves the view and presses labels.
    tab.locator("svg.webmap-view-control").wait_for()
    expect(tab.locator(".webmap-labels-go")).to_be_visible()
    tab.locator("#show-all").click()


def label(tab: Page, name: str):
    return tab.locator(f'.labels > .label[data-name="{name}"]')


def turn_and_size(tab: Page, name: str) -> tuple[float, float]:
    """Return the angle of a label on the screen, in radians, and its size."""
    a, b, c, d = (
        label(tab, name)
        .locator(".upright")
        .evaluate("e => { const m = e.getScreenCTM(); return [m.a, m.b, m.c, m.d]; }")
    )
    assert math.hypot(a, b) == pytest.approx(math.hypot(c, d), rel=1e-3)
    assert a * d - b * c > 0, "it is not mirrored"
    return math.atan2(b, a), math.hypot(a, b)


def test_labels_stay_upright_and_keep_their_size_in_every_view(tab):
    expect(label(tab, "Äpfel <b>").locator("text.name")).to_have_text("Äpfel <b>")
    assert "fruit" in label(tab, "Äpfel <b>").get_attribute("class").split()
    tab.mouse.move(800, 450)
    views = set()
    for shift, delta in [(False, 0), (False, -900), (True, 400), (False, 1200)]:
        at = tab.locator("svg.webmap .world").evaluate(
            "e => { const m = e.getCTM(); return [m.a, m.b]; }"
        )
        if shift:
            tab.keyboard.down("Shift")
        tab.mouse.wheel(0, delta)
        if shift:
            tab.keyboard.up("Shift")
        # Labels are turned back in the next frame.
        tab.wait_for_function(
            "([name, before]) => {"
            " const world = document.querySelector('svg.webmap .world').getCTM();"
            " const label = document.querySelector(`[data-name='${name}'] .upright`);"
            " const m = label.getScreenCTM();"
            " const moved = before === null || Math.hypot(world.a - before[0],"
            " world.b - before[1]) > 1e-6;"
            " return moved && Math.abs(m.b) < 0.005 && Math.abs(m.a - 1) < 0.005; }",
            arg=["Äpfel <b>", at if delta else None],
        )
        turn, size = turn_and_size(tab, "Äpfel <b>")
        assert turn == pytest.approx(0, abs=0.01)
        assert size == pytest.approx(1, rel=0.01)
        views.add(tab.locator("svg.webmap .world").evaluate("e => e.getCTM().a"))
    assert len(views) >= 3
    tab.locator("#show-all").click()


def test_an_overlapping_name_is_hidden_until_the_pointer_is_on_its_label(tab):
    beside = label(tab, "Next to it")
    expect(beside).to_have_class(re.compile("crowded"))
    expect(label(tab, "Äpfel <b>")).not_to_have_class(re.compile("crowded"))
    expect(beside.locator(".name")).to_be_hidden()
    x, y = place(tab, 3.1, 2.1)
    tab.mouse.move(x + 9, y - 9)  # only this spot belongs to one label
    expect(beside.locator(".name")).to_be_visible()


def place(tab: Page, x: float, y: float) -> tuple[float, float]:
    """Return where a place of the world is in the window."""
    return tab.locator("svg.webmap .world").evaluate(
        "(e, [x, y]) => { const m = e.getScreenCTM();"
        " return [m.a * x + m.c * y + m.e, m.b * x + m.d * y + m.f]; }",
        [x, y],
    )


def added(tab: Page, name: str, x: float, y: float) -> None:
    tab.locator("svg.webmap").focus()
    tab.keyboard.press("l")
    expect(tab.locator(".webmap-labels-word")).to_have_text(
        "Press on the map where the label goes."
    )
    tab.mouse.click(*place(tab, x, y))
    tab.keyboard.type(name)
    tab.locator(".webmap-labels-sheet select").select_option("charger")
    tab.locator(".webmap-labels-save").click()


def test_an_added_label_is_on_other_pages_and_persists_after_a_restart(
    tab, chromium, serve
):
    added(tab, "Wall <i>", 6.0, 3.0)
    expect(label(tab, "Wall <i>")).to_have_count(1)
    expect(tab.locator(".webmap-labels-sheet")).to_be_hidden()
    with watched_tab(chromium, 1280, 800) as other:
        opened(other, serve.url)
        expect(label(other, "Wall <i>")).to_have_count(1)
    serve.end()
    tab.allowed.extend(["WebSocket", "ERR_CONNECTION"])
    with watched_tab(chromium, 1280, 800) as later:
        opened(later, serve())
        wall = label(later, "Wall <i>")
        expect(wall).to_have_count(1)
        expect(wall).to_have_class(re.compile("charger"))
        m = wall.evaluate("e => e.transform.baseVal.getItem(0).matrix.e")
        assert m == pytest.approx(6.0, abs=0.1)
        moved(later, wall)
        wall.locator(".spot").click()
        later.locator(".webmap-labels-remove").click()
        expect(wall).to_have_count(0)
        label(later, "Äpfel <b>").press("Enter")
        expect(later.locator(".webmap-labels-send")).to_be_visible()
        expect(later.locator(".webmap-labels-remove")).to_be_hidden()


def test_labels_added_in_the_demo_persist_after_a_restart(chromium, tmp_path):
    demo = ("demo", "--robots", "1", "--quiet", "--port", "0", "--no-browser")
    for restarted in (False, True):
        with (
            webmap(*demo, WEBMAP_STATE_DIR=str(tmp_path)) as url,
            watched_tab(chromium, 1280, 800) as page,
        ):
            page.goto(url)
            expect(page.locator(".robot:not(.unplaced)")).to_have_count(1)
            page.locator("svg.webmap-view-control").wait_for()
            expect(page.locator(".webmap-labels-go")).to_be_visible()
            if not restarted:
                page.locator("#show-all").click()
                added(page, "Dock", 4.0, 3.0)
            expect(label(page, "Dock")).to_have_count(1)
            page.allowed.extend(["WebSocket", "ERR_CONNECTION"])


def moved(tab: Page, wall) -> None:
    """Drag a label, move it by keys, and check that only Save keeps the place."""

    def where() -> tuple[float, float]:
        return tuple(
            wall.evaluate(
                "e => { const { matrix: m } = e.transform.baseVal.getItem(0);"
                " return [m.e, m.f]; }"
            )
        )

    before, seen = where(), tab.evaluate("document.querySelector('.world').getCTM().e")
    spot, keep = wall.locator(".spot"), tab.locator(".webmap-labels-keep")
    x, y = place(tab, 8.0, 1.0)
    for ending in ("cancel", "keep"):
        spot.click()
        tab.locator(".webmap-labels-move").click()
        box = spot.bounding_box()
        tab.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
        tab.mouse.down()
        tab.mouse.move(x, y, steps=3)
        tab.mouse.up()
        assert where() == pytest.approx((8.0, 1.0), abs=0.1)
        tab.locator('[data-axis="x"]').press("ArrowUp")
        assert where()[0] == pytest.approx(8.1, abs=0.11)
        there = where()
        tab.locator(f".webmap-labels-{ending}").click()
        expect(keep).to_be_hidden()
        assert where() == pytest.approx(before if ending == "cancel" else there)
    assert tab.evaluate("document.querySelector('.world').getCTM().e") == seen
    # A new page shows the saved labels.
    tab.reload()
    expect(tab.locator("#link")).to_have_attribute("data-link", "open")
    expect(tab.locator(".webmap-labels-go")).to_be_visible()
    expect(wall).to_have_count(1)
    assert where() == pytest.approx(there)
    tab.locator("#show-all").click()


def test_a_label_can_send_the_selected_robot_to_its_position(chromium, serve, bridge):
    goal = "/robot_0/move_base_simple/goal"
    with (
        robot_node(bridge, {}, {goal: "geometry_msgs/PoseStamped"}) as node,
        watched_tab(chromium, 1280, 800) as tab,
    ):
        opened(tab, serve.url or serve())
        label(tab, "Äpfel <b>").press("Enter")
        send = tab.locator(".webmap-labels-send")
        expect(send).to_be_disabled()
        tab.locator("#robots .row").click()
        expect(send).to_have_text("Send goal here")
        status = tab.locator(".webmap-labels-word")
        for _ in range(10):
            send.click()
            expect(status).to_have_text(re.compile("^Goal sent to|^Goal not sent"))
            if not TOO_LATE.search(status.inner_text()):
                break
            label(tab, "Äpfel <b>").press("Enter")  # this removes the text
        expect(status).to_have_text("Goal sent to Äpfel <b>.")
        expect(tab.locator(".robot.selected")).to_have_count(1)
        ((_, message),) = wait_for(lambda: node.received, "the goal", page=tab)
        position = message["pose"]["position"]
        assert (position["x"], position["y"]) == pytest.approx((3.0, 2.0))
