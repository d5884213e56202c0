"""The advanced tutorial and the module tutorial in a real browser."""

import math
import re
import signal
import threading
from contextlib import contextmanager

import pytest
import roslibpy
from playwright.sync_api import expect
from robots import Witness

from equipment.chromium import hold
from equipment.processes import BRIDGE, matrix, place_on_screen, running, serving
from equipment.waiting import wait_for

pytestmark = pytest.mark.browser

ODOM = "/robot_0/odom"
RED, PALE = "rgb(255, 0, 0)", "rgb(255, 102, 102)"


@pytest.fixture(scope="module")
def simulator():
    with running("sim", "--port", 0, "--seed", 7, pattern=BRIDGE) as process:
        yield process.url


@pytest.fixture(scope="module")
def advanced(simulator, tmp_path_factory):
    folder = tmp_path_factory.mktemp("advanced")
    with serving("advanced/advanced.py", simulator, folder) as process:
        yield process


@pytest.fixture(scope="module")
def module(simulator, tmp_path_factory):
    folder = tmp_path_factory.mktemp("module")
    with serving("module/show_selected.py", simulator, folder) as process:
        yield process


@pytest.fixture(scope="module")
def witness(simulator):
    witness = Witness(simulator)
    witness.follow(ODOM, "nav_msgs/Odometry")
    yield witness
    witness.close()


def opened(tab, server, robots):
    tab.goto(server.url)
    expect(tab.locator(".robot:not(.unplaced)")).to_have_count(robots)
    return tab


def robot(name):
    return f'.robot[data-name="{name}"]'


def style(tab, selector, name):
    return tab.locator(selector).evaluate(
        "(e, name) => getComputedStyle(e).getPropertyValue(name)", name
    )


def shape(tab, name):
    """The fill and the outline of a robot's own model."""
    circle = f"{robot(name)} > g:not(.laserscan) > circle"
    return tuple(style(tab, circle, what) for what in ("fill", "stroke"))


# The advanced tutorial.


def test_the_log_shows_that_the_connection_is_established(tab, advanced):
    opened(tab, advanced, robots=2)
    expect(tab.locator("#log")).to_have_text("Connection established.\n")
    assert style(tab, "#log", "white-space-collapse") == "preserve"


def test_each_robot_is_drawn_with_its_own_model_and_css_classes(tab, advanced, witness):
    opened(tab, advanced, robots=2)
    for index in range(2):
        group = tab.locator(robot(f"Robot {index}"))
        expect(group).to_have_class(re.compile(rf"\bstage stage_{index}\b"))
        model = group.locator("> g:not(.laserscan)")
        expect(model.locator("circle")).to_have_attribute("r", "0.2")
        expect(model.locator("line")).to_have_attribute("x2", "0.2")
        expect(group.locator("> .laserscan > .dot[d]")).to_be_attached()
    place = matrix(tab, robot("Robot 0"))[4:]
    assert place == pytest.approx(witness.place(ODOM), abs=0.01)


def test_the_style_sheet_of_the_page_applies_to_robots(tab, advanced):
    opened(tab, advanced, robots=2)
    assert shape(tab, "Robot 0") == (RED, "rgb(0, 0, 0)")
    assert style(tab, robot("Robot 0"), "stroke-width") == "0.01px"


def test_the_image_of_the_map_is_loaded(tab, advanced):
    opened(tab, advanced, robots=2)
    assert tab.locator(".world image").evaluate(
        "async e => { const i = new Image(); i.src = e.href.baseVal;"
        " await i.decode(); return i.naturalWidth; }"
    )


def test_the_page_names_the_selected_robot_and_changes_its_colour(tab, advanced):
    opened(tab, advanced, robots=2)
    selected = tab.locator("#selected")
    expect(selected).to_have_text("No selection")
    tab.mouse.click(*place_on_screen(tab, robot("Robot 1")))
    expect(selected).to_have_text("Robot 1")
    assert shape(tab, "Robot 1") == (PALE, "rgb(255, 204, 204)")
    assert shape(tab, "Robot 0") == (RED, "rgb(0, 0, 0)")
    tab.mouse.click(*place_on_screen(tab, robot("Robot 0")))
    expect(selected).to_have_text("Robot 0")
    assert shape(tab, "Robot 1") == (RED, "rgb(0, 0, 0)")
    box = tab.locator("svg.webmap").bounding_box()
    tab.mouse.click(box["x"] + 5, box["y"] + 5)
    expect(selected).to_have_text("No selection")
    assert shape(tab, "Robot 0") == (RED, "rgb(0, 0, 0)")


def test_keys_drive_the_selected_robot(tab, advanced, witness):
    opened(tab, advanced, robots=2)
    tab.mouse.click(*place_on_screen(tab, robot("Robot 0")))
    expect(tab.locator("#selected")).to_have_text("Robot 0")
    hold(tab.keyboard, "a", lambda: witness.speed(ODOM)[1] > 0.3)
    tab.keyboard.up("a")
    wait_for(lambda: witness.speed(ODOM) == (0.0, 0.0), what="standing still")


def test_the_log_reports_when_the_simulator_dies_and_restarts(tab, tmp_path):
    with running("sim", "--port", 0, pattern=BRIDGE) as first:
        port = first.url.rpartition(":")[2]
        with serving("advanced/advanced.py", first.url, tmp_path) as server:
            opened(tab, server, robots=2)
            log = tab.locator("#log")
            expect(log).to_have_text("Connection established.\n")
            first.popen.send_signal(signal.SIGKILL)
            closed = r"Connection closed: .+\.\nConnection established\.\n$"
            expect(log).to_have_text(re.compile(closed))
            error = r"^Error: cannot reach the rosbridge at .+\.\n.*"
            expect(log).to_have_text(re.compile(error + closed, re.DOTALL))
            expect(tab.locator(".robot.stale")).to_have_count(2)
            with running("sim", "--port", port, pattern=BRIDGE):
                again = re.compile(r"^Connection established\.\nError: .+", re.DOTALL)
                expect(log).to_have_text(again, timeout=20_000)
                expect(tab.locator(".robot:not(.stale)")).to_have_count(2)
            tab.goto(
                "about:blank"
            )  # before the server ends, as the page would report an error


# The module tutorial.


def test_the_module_of_the_tutorial_names_the_selected_robot(tab, module):
    opened(tab, module, robots=1)
    shown = tab.locator("#show_selected")
    expect(shown).to_have_text("No selection")
    tab.mouse.click(*place_on_screen(tab, robot("Robot 0")))
    expect(shown).to_have_text("Robot 0")
    box = tab.locator("svg.webmap").bounding_box()
    tab.mouse.click(box["x"] + 5, box["y"] + 5)
    expect(shown).to_have_text("No selection")


def test_the_layer_of_the_tutorial_shows_the_voltage_of_the_robot(
    tab, simulator, tmp_path
):
    with serving("module/voltage.py", simulator, tmp_path) as server:
        opened(tab, server, robots=1)
        text = tab.locator(".robot .voltage > text")
        expect(text).to_have_text(re.compile(r"^\d+\.\d V$"))
        tab.locator(".webmap-layers > summary").click()
        tab.get_by_role("checkbox", name="Voltages").uncheck()
        expect(text).to_be_hidden()
        tab.goto("about:blank")


@contextmanager
def driven(ros, topic, x, turn):
    """Publish a velocity at 20 Hz, as another program of the robot's system would."""
    velocity = roslibpy.Topic(ros, topic, "geometry_msgs/Twist")
    message = {"linear": {"x": x, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0}}
    message["angular"]["z"] = turn
    ending = threading.Event()

    def drive() -> None:
        while not ending.wait(0.05):
            velocity.publish(message)

    thread = threading.Thread(target=drive)
    thread.start()
    try:
        yield
    finally:
        ending.set()
        thread.join()
        velocity.unadvertise()


def test_a_followed_robot_stays_at_its_screen_position_while_moving(
    tab, module, witness
):
    opened(tab, module, robots=1)
    group, world = robot("Robot 0"), "svg.webmap > .world"
    place, view = place_on_screen(tab, group), matrix(tab, world)
    start = matrix(tab, group)[4:]
    box = tab.locator("svg.webmap").bounding_box()
    assert box["x"] < place[0] < box["x"] + box["width"]
    assert box["y"] < place[1] < box["y"] + box["height"]
    way = 0.0
    with driven(witness.ros, "/robot_0/cmd_vel", 0.5, 0.8):

        def gone() -> bool:
            nonlocal way
            assert place_on_screen(tab, group) == pytest.approx(place, abs=0.5)
            way = math.dist(start, matrix(tab, group)[4:])
            return way > 0.5

        wait_for(gone, what="moving half a metre")
    wait_for(lambda: witness.speed(ODOM) == (0.0, 0.0), what="standing still")
    wait_for(
        lambda: matrix(tab, group)[4:] == pytest.approx(witness.place(ODOM), abs=0.01),
        what="the page showing where the robot is",
    )
    assert place_on_screen(tab, group) == pytest.approx(place, abs=0.5)
    end, after = matrix(tab, group)[4:], matrix(tab, world)
    assert after[:4] == pytest.approx(view[:4]), (
        "following neither zooms nor rotates the view"
    )
    moved = math.dist(view[4:], after[4:])
    assert moved == pytest.approx(40 * math.dist(start, end), abs=1)
