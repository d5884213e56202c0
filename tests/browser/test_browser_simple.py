"""The simple tutorial in a real browser: the view, the selection, driving."""

import math
from contextlib import suppress

import pytest
from robots import Witness

from equipment.chromium import hold
from equipment.devtools import Chromium
from equipment.processes import BRIDGE, EXAMPLES, WEB, matrix, reset, running
from equipment.waiting import wait_for

pytestmark = [pytest.mark.browser, pytest.mark.slow]

ODOM = "/odom"


@pytest.fixture(scope="module")
def simulator():
    # This seed puts the robot into a long corridor, looking along it.
    with running("sim", "--flat", "--port", 0, "--seed", 7, pattern=BRIDGE) as process:
        yield process.url


@pytest.fixture(scope="module")
def server(simulator, tmp_path_factory):
    """The example unchanged, except for the port of the simulator."""
    folder = tmp_path_factory.mktemp("simple")
    script = (EXAMPLES / "simple" / "simple.py").read_text()
    assert script.count("ws://localhost:9090") == 1
    (folder / "simple.py").write_text(script.replace("ws://localhost:9090", simulator))
    image = (EXAMPLES / "simple" / "background.png").read_bytes()
    (folder / "background.png").write_bytes(image)
    command = ("run", folder / "simple.py", "--port", 0, "--no-browser")
    with running(*command, pattern=WEB) as process:
        yield process


@pytest.fixture(scope="module")
def witness(simulator):
    witness = Witness(simulator)
    witness.follow(ODOM, "nav_msgs/Odometry")
    witness.follow("/cmd_vel", "geometry_msgs/Twist")
    yield witness
    witness.close()


@pytest.fixture
def opened(server, tab):
    tab.goto(server.url)
    tab.locator(".robot:not(.unplaced)").wait_for(state="attached")
    tab.locator(".dot[d]").wait_for(state="attached")
    tab.get_by_role("button", name="STOP").wait_for()
    tab.locator("svg.webmap-view-control").wait_for()  # receives drags and the wheel
    return tab


def view(tab):
    return matrix(tab, "svg.webmap > .world")


def apply(m, x, y):
    return m[0] * x + m[2] * y + m[4], m[1] * x + m[3] * y + m[5]


def undo(m, x, y):
    det = m[0] * m[3] - m[1] * m[2]
    x, y = x - m[4], y - m[5]
    return (m[3] * x - m[2] * y) / det, (m[0] * y - m[1] * x) / det


def robot_place(tab):
    return tuple(matrix(tab, ".robot")[4:])


def robot_on_screen(tab):
    box = tab.locator("svg.webmap").bounding_box()
    x, y = apply(view(tab), *robot_place(tab))
    return box["x"] + x, box["y"] + y


def middle(tab):
    box = tab.locator("svg.webmap").bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_the_page_removes_the_token_and_draws_the_robot_at_its_odometry_pose(
    opened, witness
):
    assert "token" not in opened.url
    assert opened.locator("svg.webmap").bounding_box()["width"] == 700
    assert robot_place(opened) == pytest.approx(witness.place(ODOM), abs=0.01)
    assert opened.locator(".robot").count() == 1
    assert opened.locator(".robot > title").text_content() == "Bob"
    assert opened.locator(".world image").count() == 1
    assert opened.locator(".laserscan > .dot").count() == 1


def test_dragging_moves_the_view_by_the_same_distance_and_is_not_a_click(opened):
    opened.mouse.click(*robot_on_screen(opened))
    opened.locator(".robot.selected").wait_for()
    before = view(opened)
    x, y = middle(opened)
    opened.mouse.move(x, y)
    opened.mouse.down()
    opened.mouse.move(x + 30, y - 20, steps=4)
    opened.mouse.up()
    moved = (before[4] + 30, before[5] - 20)
    wait_for(
        lambda: tuple(view(opened)[4:]) == pytest.approx(moved, abs=0.5),
        what="following the drag",
    )
    opened.wait_for_timeout(300)
    assert opened.locator(".robot.selected").count() == 1, (
        "the drag changed the selection"
    )


def test_the_wheel_zooms_the_view_about_the_pointer(opened):
    box = opened.locator("svg.webmap").bounding_box()
    px, py = 200, 150
    before = view(opened)
    world = undo(before, px, py)
    opened.mouse.move(box["x"] + px, box["y"] + py)
    opened.mouse.wheel(0, -240)
    wait_for(lambda: view(opened)[0] > before[0] * 1.05, what="zooming")
    assert apply(view(opened), *world) == pytest.approx((px, py), abs=0.5)


def test_shift_and_the_wheel_rotate_the_view_about_the_pointer(opened):
    box = opened.locator("svg.webmap").bounding_box()
    px, py = 420, 300
    before = view(opened)
    world = undo(before, px, py)
    opened.mouse.move(box["x"] + px, box["y"] + py)
    opened.keyboard.down("Shift")
    opened.mouse.wheel(0, 240)
    opened.keyboard.up("Shift")
    wait_for(lambda: abs(view(opened)[1]) > 0.1, what="turning")
    after = view(opened)
    assert apply(after, *world) == pytest.approx((px, py), abs=0.5)
    assert math.hypot(after[0], after[1]) == pytest.approx(
        math.hypot(before[0], before[1])
    )


def test_a_click_on_a_robot_selects_and_a_click_on_the_background_deselects(opened):
    opened.mouse.click(*robot_on_screen(opened))
    opened.locator(".robot.selected").wait_for()
    x, y = middle(opened)
    opened.mouse.click(x, y)
    opened.locator(".robot:not(.selected)").wait_for()


def test_a_selection_does_not_appear_on_other_pages(opened, other, server):
    other.goto(server.url)
    other.locator(".robot:not(.unplaced)").wait_for(state="attached")
    opened.mouse.click(*robot_on_screen(opened))
    opened.locator(".robot.selected").wait_for()
    other.wait_for_timeout(300)
    assert other.locator(".robot.selected").count() == 0


def select(tab):
    tab.mouse.click(*robot_on_screen(tab))
    tab.locator(".robot.selected").wait_for()


@pytest.mark.parametrize(
    ("key", "forward", "turn"),
    [("w", 1, 0), ("s", -1, 0), ("a", 0, 1), ("d", 0, -1)],
)
def test_a_held_key_drives_the_selected_robot_until_release(
    opened, witness, key, forward, turn
):
    select(opened)
    before = robot_place(opened)

    def moving():
        # The speeds of the tutorial. A base without a known command timeout is never
        # driven at these speeds.
        v, w = witness.speed(ODOM)
        if forward:
            return v * forward > 0.9 and math.dist(before, robot_place(opened)) > 0.1
        return w * turn > 1.3

    hold(opened.keyboard, key, moving)
    opened.keyboard.up(key)
    wait_for(lambda: witness.speed(ODOM) == (0.0, 0.0), what="standing still")
    wait_for(
        lambda: robot_place(opened) == pytest.approx(witness.place(ODOM), abs=0.01),
        what="the page showing where the robot is",
    )


def test_a_robot_that_is_not_selected_is_not_driven(opened, witness):
    assert opened.locator(".robot.selected").count() == 0
    opened.keyboard.down("w")
    opened.wait_for_timeout(700)
    opened.keyboard.up("w")
    assert witness.speed(ODOM) == (0.0, 0.0)


ROBOT = """(() => {
    const r = document.querySelector('.robot:not(.unplaced)');
    if (!r || !document.querySelector('button')) return null;
    const b = r.firstElementChild.nextElementSibling.getBoundingClientRect();
    return [b.x + b.width / 2, b.y + b.height / 2];
})()"""


def click_on_robot(tab):
    """Click on the robot until it is selected: a page that loads may move its map."""
    for _ in range(5):
        tab.click(*tab.wait(ROBOT))
        with suppress(AssertionError):
            tab.wait("document.querySelector('.robot.selected') !== null", within=3.0)
            return
    raise AssertionError("no click selected the robot")


def test_a_hidden_tab_stops_the_robot_and_showing_the_tab_again_sends_nothing(
    server, witness
):
    with Chromium() as browser:
        tab = browser.new_tab()
        tab.go(server.url)
        click_on_robot(tab)
        hold(tab, "w", lambda: witness.speed(ODOM)[0] > 0.2)
        other = browser.new_tab()
        wait_for(lambda: witness.speed(ODOM) == (0.0, 0.0), what="stopping")
        # On a busy machine the robot may have stopped earlier, as the page was delayed.
        tab.wait("document.visibilityState === 'hidden'")
        browser.activate(tab)
        tab.wait("document.visibilityState === 'visible'")
        # The zero velocities of the stop end after a while; then nothing is sent.
        tab.evaluate("new Promise(done => setTimeout(done, 1000))")
        before = witness.count("/cmd_vel")
        tab.evaluate("new Promise(done => setTimeout(done, 1000))")
        assert witness.speed(ODOM) == (0.0, 0.0)
        assert witness.count("/cmd_vel") == before, "no message is sent to the robot"
        assert tab.errors == []
        other.close()
        tab.close()


def test_a_closed_tab_stops_the_robot(opened, witness, other, server):
    other.goto(server.url)
    other.locator(".robot:not(.unplaced)").wait_for(state="attached")
    select(other)
    hold(other.keyboard, "s", lambda: witness.speed(ODOM)[0] < -0.2)
    other.context.close()
    wait_for(lambda: witness.speed(ODOM) == (0.0, 0.0), what="stopping")


def test_a_stop_blocks_motion_until_reset_and_a_new_key_press(opened, witness):
    select(opened)
    hold(opened.keyboard, "s", lambda: witness.speed(ODOM)[0] < -0.2)
    opened.keyboard.press("Space")
    wait_for(lambda: witness.speed(ODOM) == (0.0, 0.0), what="stopping")
    opened.wait_for_timeout(700)
    assert witness.speed(ODOM) == (0.0, 0.0), "the held key does not drive"
    opened.keyboard.up("s")
    opened.wait_for_timeout(300)
    opened.keyboard.down("s")
    opened.wait_for_timeout(700)
    assert witness.speed(ODOM) == (0.0, 0.0), (
        "a press does not drive while a STOP is active"
    )
    opened.keyboard.up("s")
    reset(opened)
    hold(opened.keyboard, "s", lambda: witness.speed(ODOM)[0] < -0.2)
    opened.keyboard.up("s")


def test_no_velocity_is_sent_to_an_idle_robot(opened, witness):
    opened.wait_for_timeout(1200)
    before = witness.count("/cmd_vel")
    opened.wait_for_timeout(1000)
    assert witness.count("/cmd_vel") == before


def test_the_view_and_the_selection_survive_a_reload(opened):
    select(opened)
    start = view(opened)
    x, y = middle(opened)
    opened.mouse.move(x, y)
    opened.mouse.wheel(0, -240)
    wait_for(lambda: view(opened)[0] > start[0] * 1.05, what="zooming")
    opened.wait_for_timeout(600)
    before = view(opened)
    opened.reload()
    opened.locator(".robot.selected").wait_for(state="attached")
    assert view(opened) == pytest.approx(before)
