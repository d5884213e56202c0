"""Goals, routes and initial poses go from a real page through the real gate to robots.

The robots are simulated, in ROS 1 and ROS 2, each behind a rosbridge of its own.
"""

import json
import math
import re
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
from gate_words import TOO_LATE
from playwright.sync_api import Browser, Locator, Page, expect
from websockets.sync.client import ClientConnection, connect

from equipment.chromium import end_stops, watched_tab
from equipment.webmap_process import page_of
from webmap.cli.demo import simulator

# Serial, as the gate refuses a goal that arrives more than 0.3 s late.
pytestmark = [pytest.mark.browser, pytest.mark.serial]

HERE = Path(__file__).parents[1]
OUTSIDE = (1180, 400)
"""A place on the screen outside of the house."""

WORDS = (
    ".webmap-goal-word, .webmap-locate-word, "
    ".webmap-route > .webmap-tool-body > .webmap-route-word"
)

PLACE = """name => {
  const robot = document.querySelector(`.robot[data-name="${name}"]`);
  const m = robot.getCTM(), w = robot.ownerSVGElement.getScreenCTM();
  return [w.e + m.e, w.f + m.f];
}"""


def open_floor(folder: Path) -> Path:
    """Write an empty hall of 16 m as a map file of map_server."""
    side = 320
    wall, inside = bytes(side), b"\0" + b"\xfe" * (side - 2) + b"\0"
    pixels = wall + inside * (side - 2) + wall
    (folder / "hall.pgm").write_bytes(b"P5 %d %d 255\n" % (side, side) + pixels)
    (folder / "hall.yaml").write_text(
        "image: hall.pgm\nresolution: 0.05\norigin: [-8, -8, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return folder / "hall.yaml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("goals")


@pytest.fixture(scope="module")
def bridges(folder) -> Iterator[dict[str, str]]:
    floor = open_floor(folder)
    with ExitStack() as stack:
        yield {
            name.upper(): stack.enter_context(
                simulator(
                    *("--dialect", name, "--map", floor, "--port", 0),
                    *("--robots", 2, "--no-extras"),
                )
            )
            for name in ("ros1", "ros2")
        }


@pytest.fixture(scope="module")
def url(folder, bridges) -> Iterator[str]:
    with ExitStack() as stack:
        where = {**bridges, "WEBMAP_STATE_DIR": str(folder)}
        yield stack.enter_context(page_of(HERE / "site_of_goals.py", **where))


@pytest.fixture
def tab(chromium: Browser, url: str) -> Iterator[Page]:
    with watched_tab(chromium, 1200, 800) as page:
        page.goto(url)
        expect(page.locator(".robot:not(.unplaced)")).to_have_count(4)
        page.wait_for_selector(".webmap-route > summary")
        page.wait_for_selector(".webmap-goal-go", state="attached")
        yield page


def pick(tab: Page, name: str, *, shift: bool = False) -> None:
    tab.evaluate(
        """([name, shiftKey]) => document.querySelector(`.robot[data-name="${name}"]`)
        .dispatchEvent(new MouseEvent("click", { bubbles: true, shiftKey }))""",
        [name, shift],
    )
    kind = "marked" if shift else "selected"
    expect(tab.locator(f'.robot.{kind}[data-name="{name}"]')).to_have_count(1)


def press(tab: Page, x: float, y: float, *, drag: float = 0.0) -> None:
    tab.mouse.move(x, y)
    tab.mouse.down()
    tab.mouse.move(x + drag, y)
    tab.mouse.up()


def beside(tab: Page, name: str, dx: float = 16.0) -> tuple[float, float]:
    """Return a place on the screen near a robot."""
    x, y = tab.evaluate(PLACE, name)
    middle = tab.viewport_size["width"] / 2
    return x + math.copysign(dx, middle - x), y


def repeat_until_accepted(tab: Page, act, status: Locator) -> None:
    """Send a command, and send it again while it reaches the gate too late.

    On a busy machine a command may be older than the gate allows, and is then refused.
    A person would try again, too.
    """
    for _ in range(10):
        act()
        tab.wait_for_function(
            """selector => {
              const words = [...document.querySelectorAll(selector)];
              return words.some(word => /^Not |^Pose sent|^Halted|goes to/.test(
                word.textContent)) || document.querySelector(
                ".webmap-goal-arrow:not(.aimed, .asked)");
            }""",
            arg=WORDS,
            timeout=20_000,
        )
        if not TOO_LATE.search(status.inner_text()):
            return
    raise AssertionError(f"too slow ten times: {status.inner_text()}")


def send(tab: Page, name: str, to: str = "") -> None:
    """Send a robot to a place beside another robot, or to a place nearby."""
    pick(tab, name)

    def act():
        tab.keyboard.press("g")
        press(tab, *beside(tab, to or name, 45.0 if to else 16.0), drag=30)

    repeat_until_accepted(tab, act, tab.locator(".webmap-goal-word"))


def label(tab: Page):
    return tab.locator(".webmap-goal-label.mine")


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("Old 0", r"Navigating to goal, [\d.]+ m to go"),
        ("New 0", r"m to go, about \d+ s left"),
    ],
)
def test_the_map_shows_the_progress_of_a_goal_until_it_is_reached(tab, name, expected):
    send(tab, name)
    expect(label(tab)).to_contain_text("Navigating to goal")
    expect(label(tab)).to_contain_text(re.compile(expected))
    expect(tab.locator(".webmap-goal-arrow.way")).to_have_count(1)
    expect(label(tab)).to_contain_text("Goal reached", timeout=15_000)


@pytest.mark.parametrize(("name", "to"), [("Old 0", "Plain 1"), ("New 0", "New 1")])
def test_the_goal_label_on_the_map_cancels_the_goal(tab, name, to):
    send(tab, name, to)
    expect(label(tab)).to_contain_text("Navigating to goal")
    label(tab).get_by_role("button", name="Cancel goal").click()
    expect(label(tab)).to_contain_text("Goal cancelled")


def test_an_unreachable_goal_shows_the_reason_until_it_is_hidden(tab):
    pick(tab, "New 0")
    tab.keyboard.press("g")
    press(tab, *OUTSIDE, drag=-30)
    expect(label(tab)).to_have_text(re.compile("Goal failed, no path to the goal"))
    expect(tab.locator(".webmap-goal-arrow.failed")).to_have_count(1)
    label(tab).get_by_role("button", name="Hide this goal").click()
    expect(tab.locator(".webmap-goal-arrow")).to_have_count(0)


def test_stop_cancels_a_goal_and_the_label_shows_stop(tab):
    send(tab, "Old 0", "Plain 1")
    expect(label(tab)).to_contain_text("Navigating to goal")
    tab.get_by_role("button", name="STOP ALL").click()
    expect(label(tab)).to_contain_text("Goal cancelled, STOP")
    reset(tab)


def reset(tab: Page) -> None:
    """End the STOP of all robots."""
    robots = tab.locator(".robot").count()
    standing = tab.locator(".webmap-stop-standing")
    expect(standing).to_contain_text(f"STOP active: {robots} robots")
    button = tab.locator(".webmap-stop .webmap-reset")
    button.click(trial=True)  # waits until a person could click
    end_stops(button)


def send_elsewhere(bridge: str) -> None:
    """Send the plain robot to an unreachable place by its topic, as RViz does."""
    pose = {"position": {"x": 40.0, "y": 40.0}, "orientation": {"w": 1.0}}
    message = {"header": {"frame_id": "map"}, "pose": pose}
    topic = "/robot_1/move_base_simple/goal"
    with connect(bridge) as client:
        client.send(json.dumps({"op": "publish", "topic": topic, "msg": message}))


def test_a_goal_on_a_plain_topic_has_no_progress_and_is_drawn_once(tab, bridges):
    published = tab.locator(".posestamped.goal")
    send(tab, "Plain 1", "Old 0")
    expect(label(tab)).to_have_text(re.compile("Goal sent, this robot reports no"))
    expect(published).to_have_attribute("data-pose", re.compile(r"goal \d+$"))
    expect(published).to_be_hidden()
    label(tab).get_by_role("button", name="Cancel goal").click()
    expect(
        tab.locator(".webmap-goal-arrow.way, .webmap-goal-arrow.sent")
    ).to_have_count(0)
    # The goal has ended and is hidden; the topic has published no other goal.
    label(tab).get_by_role("button", name="Hide this goal").click()
    expect(tab.locator(".webmap-goal-arrow")).to_have_count(0)
    expect(published).to_be_hidden()
    send_elsewhere(bridges["ROS1"])
    expect(published).to_be_visible()


WORLD = """([x, y]) => {
  const m = document.querySelector("svg.webmap .world").getScreenCTM().inverse();
  return [m.a * x + m.c * y + m.e, m.b * x + m.d * y + m.f];
}"""


@contextmanager
def subscribed(bridge: str, topic: str) -> Iterator[ClientConnection]:
    """Subscribe to a topic of a robot, as the robot does."""
    with connect(bridge, compression=None) as link:
        link.send(json.dumps({"op": "subscribe", "topic": topic}))
        yield link


def test_an_initial_pose_is_sent_unless_the_robot_is_navigating(tab, bridges):
    with subscribed(bridges["ROS1"], "/robot_0/initialpose") as robot:
        check_poses_sent_and_refused(tab, robot)


def check_poses_sent_and_refused(tab: Page, robot: ClientConnection) -> None:
    status = tab.locator(".webmap-locate-word")
    pick(tab, "Old 0")
    tab.keyboard.press("i")
    expect(status).to_contain_text("Press where the robot is")
    expect(status).to_contain_text("(± 1.0 m, ± 30°)")
    x, y = beside(tab, "Old 0", 5)
    tab.mouse.move(x, y)
    tab.mouse.down()
    tab.mouse.move(x + 30, y)
    ellipse = tab.locator(".webmap-locate-ellipse")
    metre = tab.evaluate("document.querySelector('.world').getCTM().a")
    # Two standard deviations of 0.25 m² are a metre to each side.
    box = ellipse.bounding_box()
    assert box["width"] == pytest.approx(2 * metre, abs=2)
    assert box["x"] + box["width"] / 2 == pytest.approx(x, abs=2)
    tab.mouse.up()
    expect(ellipse).to_be_hidden()

    pressed = [(x, y)]

    def again():
        if TOO_LATE.search(status.inner_text()):
            pressed.append(beside(tab, "Old 0", 5))
            tab.keyboard.press("i")
            press(tab, *pressed[-1], drag=30)

    repeat_until_accepted(tab, again, status)
    expect(status).to_have_text("Pose sent.")
    received = json.loads(robot.recv(timeout=10))["msg"]
    at, turn = (received["pose"]["pose"][part] for part in ("position", "orientation"))
    assert received["header"]["frame_id"] == "map"
    assert [at["x"], at["y"]] == pytest.approx(
        tab.evaluate(WORLD, pressed[-1]), abs=0.02
    )
    assert 2 * math.atan2(turn["z"], turn["w"]) == pytest.approx(0.0, abs=0.01)
    sure = received["pose"]["covariance"]
    assert (sure[0], sure[7], sure[35]) == (0.25, 0.25, 0.068)
    send(tab, "Old 0", "Plain 1")
    expect(label(tab)).to_contain_text("Navigating to goal")
    tab.keyboard.press("i")
    press(tab, *beside(tab, "Old 0", 5), drag=30)
    expect(status).to_have_text(
        "Pose not sent: the robot is navigating: cancel the goal first"
    )
    label(tab).get_by_role("button", name="Cancel goal").click()


def test_several_robots_get_goals_beside_each_other(tab):
    pick(tab, "New 0")
    pick(tab, "New 1", shift=True)
    expect(tab.locator(".webmap-goal-go")).to_have_text("Send goal to 2 robots")

    def act():
        tab.keyboard.press("g")
        x, y = beside(tab, "New 0")
        tab.mouse.move(x, y)
        tab.keyboard.down("Alt")
        tab.mouse.down()
        tab.mouse.move(x + 30, y)
        expect(tab.locator(".webmap-goal-arrow.aimed")).to_have_count(2)
        tab.mouse.up()
        tab.keyboard.up("Alt")
        expect(tab.locator(".webmap-goal-arrow:is(.aimed, .asked)")).to_have_count(
            0, timeout=20_000
        )

    repeat_until_accepted(tab, act, tab.locator(".webmap-goal-word"))
    under_way = tab.locator(".webmap-goal-arrow:not(.aimed, .asked)")
    expect(under_way).to_have_count(2)
    spots = [
        list(map(float, re.findall(r"-?[\d.]+", each)))
        for each in under_way.evaluate_all(
            "all => all.map(arrow => arrow.getAttribute('transform'))"
        )
    ]
    metre = tab.evaluate("document.querySelector('.world').getCTM().a")
    (x0, y0, *_), (x1, y1, *_) = spots
    assert ((x0 - x1) ** 2 + (y0 - y1) ** 2) ** 0.5 == pytest.approx(metre, rel=0.02)
    tab.locator(".webmap-goal-cancel").click()
    expect(label(tab)).to_contain_text(re.compile("Goal cancel"))
    pick(tab, "Old 0")
    expect(tab.locator(".robot.marked")).to_have_count(0)


def test_a_route_can_be_drawn_saved_run_skipped_paused_and_interrupted(tab):
    pick(tab, "New 1")
    tab.locator(".webmap-route > summary").click()
    tab.locator(".webmap-route-edit").click()
    x, y = beside(tab, "New 1", 0)
    side = x - beside(tab, "New 1", 1.0)[0]
    # Far apart, so that also a slow machine presses before the next point is reached.
    for dx in (10, 65, 120):
        press(tab, x - dx * side, y, drag=20)
    expect(tab.locator(".webmap-route-point")).to_have_count(3)
    tab.locator(".webmap-route-edit").click()
    tab.locator(".webmap-route-name").fill("Round")
    tab.locator(".webmap-route-save").click()
    expect(tab.locator(".webmap-route-saved")).to_contain_text("Saved as Round.")
    status = tab.locator(".webmap-route > .webmap-tool-body > .webmap-route-word")
    repeat_until_accepted(tab, tab.locator(".webmap-route-run").click, status)
    for _ in range(10):
        expect(status).to_have_text(re.compile("point 2 of 3|^Halted"), timeout=15_000)
        if not TOO_LATE.search(status.inner_text()):
            break
        tab.locator(".webmap-route-pause").click()  # the button shows "Resume"
    expect(status).to_have_text("New 1 is navigating to point 2 of 3.")
    tab.locator(".webmap-route-skip").click()
    expect(status).to_have_text("New 1 is navigating to point 3 of 3.")
    tab.locator(".webmap-route-pause").click()
    expect(status).to_have_text("Paused before point 3 of 3.")
    tab.locator(".webmap-route-pause").click()
    expect(status).to_have_text("New 1 is navigating to point 3 of 3.")
    tab.get_by_role("button", name="STOP ALL").click()
    expect(status).to_contain_text("Interrupted before point 3 of 3")
    reset(tab)
    expect(status).to_contain_text("Interrupted before point 3 of 3")

    tab.reload()
    tab.locator(".webmap-route > summary").click()
    tab.locator(".webmap-route-load").click()
    expect(tab.locator(".webmap-route-point")).to_have_count(3)
    for _ in range(2):
        tab.get_by_role("button", name="Remove point 1").click()
    box = tab.locator(".webmap-route-point").bounding_box()
    tab.mouse.move(box["x"] + 12, box["y"] + 12)
    tab.mouse.down()
    tab.mouse.move(*OUTSIDE)
    tab.mouse.up()
    pick(tab, "New 1")
    tab.locator(".webmap-route-run").click()
    expect(status).to_have_text(
        "Interrupted before point 1 of 1: the goal failed: no path to the goal."
    )
    tab.locator(".webmap-route-skip").click()
    expect(status).to_have_text("Route of New 1 ended.")


def drawn_route(tab: Page) -> list[tuple[str, float]]:
    """Return the number and the x on the screen of each drawn point."""
    return [
        (number, float(across))
        for number, across in tab.locator(".webmap-route-point").evaluate_all(
            """all => all.map(point => [point.textContent,
              point.getAttribute("transform").match(/[-\\d.]+/)[0]])"""
        )
    ]


def next_goal(tab: Page, robot: ClientConnection) -> float:
    """Return x of the next goal that move_base receives, in metres."""
    status = tab.locator(".webmap-route > .webmap-tool-body > .webmap-route-word")
    for _ in range(30):
        try:
            message = json.loads(robot.recv(timeout=1))["msg"]
        except TimeoutError:
            if status.get_attribute("data-state") == "halted":
                assert TOO_LATE.search(status.inner_text()), status.inner_text()
                tab.locator(".webmap-route-pause").click()  # the button shows "Resume"
        else:
            return message["goal"]["target_pose"]["pose"]["position"]["x"]
    raise AssertionError(f"no further goal: {status.inner_text()}")


def test_a_reordered_route_with_a_loop_sends_its_goals_in_order(tab, bridges):
    pick(tab, "Old 0")
    tab.locator(".webmap-route > summary").click()
    status = tab.locator(".webmap-route > .webmap-tool-body > .webmap-route-word")
    loop = tab.locator(".webmap-route-loop")
    loop.click()
    expect(status).to_have_text("A loop needs at least 2 points.")
    tab.locator(".webmap-route-edit").click()
    x, y = beside(tab, "Old 0", 0)
    side = beside(tab, "Old 0", 1.0)[0] - x
    a, b, c = (x + dx * side for dx in (16, 32, 48))
    for across in (a, b, c):
        press(tab, across, y, drag=20 * side)
    tab.locator(".webmap-route-edit").click()
    expect(status).to_have_text("")
    first, second, third = (across for _, across in drawn_route(tab))

    tab.get_by_role("button", name="Move point 3 up").click()
    moved = [("1", first), ("2", third), ("3", second)]
    assert drawn_route(tab) == moved
    expect(tab.locator(".webmap-route-up").first).to_be_disabled()
    expect(loop).to_have_attribute("aria-pressed", "true")
    line = tab.locator(".webmap-route-line").get_attribute("points").split()
    assert line[0] == line[-1], "the line back to the first point is drawn"

    with subscribed(bridges["ROS1"], "/robot_0/move_base/goal") as robot:
        repeat_until_accepted(tab, tab.locator(".webmap-route-run").click, status)
        there = [tab.evaluate(WORLD, [across, y])[0] for across in (a, c, b, a)]
        seen = [next_goal(tab, robot) for _ in there]
    assert seen == pytest.approx(there, abs=0.02)
    expect(status).to_have_text("Old 0 is navigating to point 1 of 3, round 2.")
    tab.locator(".webmap-route-end").click()
    expect(status).to_have_text("Route of Old 0 ended.")
