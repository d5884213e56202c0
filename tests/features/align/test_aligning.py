"""Maps are aligned by hand in a real browser, and goals use the alignment."""

import json
import math
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from gate_words import TOO_LATE
from playwright.sync_api import expect
from websockets.sync.client import connect

from equipment.chromium import watched_tab
from equipment.waiting import wait_for
from equipment.webmap_process import page_of, simulator

pytestmark = pytest.mark.browser

PAGE = Path(__file__).parents[1] / "page_of_aligning.py"
GOAL = "/robot_0/move_base_simple/goal"
"""Why the gate refuses a goal from a busy machine; a person sends it again."""

ROBOT = """(name) => {
  const world = document.querySelector('svg.webmap .world').getScreenCTM();
  const robot = document.querySelector(`.robot[data-name="${name}"]`).getScreenCTM();
  const m = world.inverse().multiply(robot);
  return [m.e, m.f, Math.atan2(m.b, m.a) * 180 / Math.PI];
}"""
SCREEN = """([x, y]) => {
  const m = document.querySelector('svg.webmap .world').getScreenCTM();
  return [m.a * x + m.c * y + m.e, m.b * x + m.d * y + m.f];
}"""


@contextmanager
def receiving_goals(url: str) -> Iterator[list[dict]]:
    """Receive the goals that are sent to the robot."""
    received: list[dict] = []
    over = threading.Event()

    def listen() -> None:
        with connect(url, compression=None) as link:
            kind = "geometry_msgs/PoseStamped"
            link.send(json.dumps({"op": "subscribe", "topic": GOAL, "type": kind}))
            while not over.is_set():
                try:
                    received.append(json.loads(link.recv(timeout=0.1))["msg"]["pose"])
                except TimeoutError:
                    continue

    thread = threading.Thread(target=listen)
    thread.start()
    try:
        yield received
    finally:
        over.set()
        thread.join(10)


def open_page(tab, url) -> None:
    tab.goto(url)
    tab.wait_for_selector(".laserscan > .dot[d]", state="attached")
    tab.wait_for_selector(".occupancy-grid image[href]", state="attached")
    expect(tab.locator(".robot:not(.unplaced)")).to_have_count(2)


def select(tab, name) -> None:
    robot = tab.locator(f'.robot[data-name="{name}"]')
    robot.dispatch_event("click")
    expect(robot).to_have_class(re.compile("selected"))


def begin(tab) -> None:
    tab.locator(".webmap-align-go").click()
    expect(tab.locator(".webmap-align-body")).to_be_visible()


def numbers(tab) -> list[float]:
    fields = (tab.locator(f".webmap-align [name={n}]") for n in ("x", "y", "angle"))
    return [float(field.input_value()) for field in fields]


def drag(tab, start, end) -> None:
    tab.mouse.move(*start)
    tab.mouse.down()
    tab.mouse.move(*end, steps=5)
    tab.mouse.up()


def save(tab) -> str:
    tab.locator(".webmap-align-save").click()
    expect(tab.locator(".webmap-align-line")).to_be_visible()
    return tab.locator(".webmap-align-line").inner_text()


def test_an_alignment_made_by_hand_is_saved_and_applies_to_goals(chromium, tmp_path):
    state = {"WEBMAP_STATE_DIR": str(tmp_path)}
    with simulator("-n", "2") as sim:
        state["ALIGNING_URL"] = sim
        with (
            page_of(PAGE, **state) as url,
            watched_tab(chromium, 1000, 800) as tab,
            receiving_goals(sim) as goals,
        ):
            open_page(tab, url)
            before = {n: tab.evaluate(ROBOT, n) for n in ("robot_0", "robot_1")}
            tab.locator(".webmap-align-go").click()
            expect(tab.locator(".webmap-align-word")).to_have_text(
                "Select a robot first."
            )
            select(tab, "robot_0")
            begin(tab)
            assert numbers(tab) == [0.0, 0.0, 0.0]
            assert tab.locator(".webmap-align-shadow use").count() == 3

            # A drag moves by as many metres as pixels, and nothing else moves yet.
            a, b = (tab.evaluate(SCREEN, place) for place in ([0, 0], [1, 1]))
            drag(tab, (500, 600), (500 + 3 * (b[0] - a[0]), 600 + 2 * (b[1] - a[1])))
            assert numbers(tab) == pytest.approx([3.0, 2.0, 0.0], abs=0.03)
            assert tab.evaluate(ROBOT, "robot_0") == pytest.approx(before["robot_0"])

            # Arrow keys move the field with the focus and do not drive a robot.
            x, y, _ = numbers(tab)
            tab.keyboard.press("ArrowRight")
            tab.keyboard.press("Shift+ArrowUp")
            assert numbers(tab) == pytest.approx([x + 0.05, y + 0.5, 0.0], abs=2e-3)

            # The handle turns the map about the robot; the robot keeps its place.
            handle = tab.locator(".webmap-align-knob").bounding_box()
            tip = (
                handle["x"] + handle["width"] / 2,
                handle["y"] + handle["height"] / 2,
            )
            drag(tab, tip, (tip[0] - 84, tip[1] + 84))
            x, y, angle = numbers(tab)
            assert angle == pytest.approx(90.0, abs=1.0)
            rx, ry, _ = before["robot_0"]
            turn = math.radians(angle)
            stays = (x + math.cos(turn) * rx - math.sin(turn) * ry, y)
            assert stays[0] == pytest.approx(rx + 3.05, abs=0.05)

            tab.keyboard.press("Escape")
            expect(tab.locator(".webmap-align-body")).to_be_hidden()
            assert tab.evaluate(ROBOT, "robot_0") == pytest.approx(before["robot_0"])

            # Typed numbers are exact; saved numbers apply to all robots of the bridge.
            begin(tab)
            for name, value in (("x", "10"), ("y", "-2.5"), ("angle", "90")):
                tab.locator(f".webmap-align [name={name}]").fill(value)
            line = save(tab)
            assert line == "alignment = [10.0, -2.5, 90.0] # metres, metres, degrees"
            for name, (x, y, angle) in before.items():
                there = pytest.approx([10.0 - y, -2.5 + x], abs=0.01)
                tab.wait_for_function(f"({ROBOT})('{name}')[1] !== {y}")
                assert tab.evaluate(ROBOT, name)[:2] == there
                turned = tab.evaluate(ROBOT, name)[2] - angle - 90.0
                assert math.remainder(turned, 360) == pytest.approx(0, abs=0.01)

            # The robot receives a clicked goal in the coordinates of its own map.
            x, y, _ = tab.evaluate(ROBOT, "robot_0")
            place = tab.evaluate(SCREEN, [x + 1.0, y + 2.0])
            send(tab, place, (place[0] + 60, place[1]))
            expect(tab.locator(".webmap-goal-arrow.sent")).to_be_attached()
            wait_for(lambda: goals, page=tab)
            rx, ry, _ = before["robot_0"]
            at, way = goals[0]["position"], goals[0]["orientation"]
            assert (at["x"], at["y"]) == pytest.approx((rx + 2.0, ry - 1.0), abs=0.05)
            yaw = 2 * math.atan2(way["z"], way["w"])
            assert yaw == pytest.approx(-math.pi / 2, abs=0.02)

        # The saved alignment is used in the next process.
        with (
            page_of(PAGE, **state) as url,
            watched_tab(chromium, 1000, 800) as tab,
        ):
            open_page(tab, url)
            rx, ry, _ = before["robot_1"]
            there = pytest.approx([10.0 - ry, -2.5 + rx], abs=0.01)
            assert tab.evaluate(ROBOT, "robot_1")[:2] == there
            # One robot may have another alignment than the rest of its bridge.
            select(tab, "robot_1")
            begin(tab)
            tab.locator(".webmap-align-what").select_option("own")
            assert numbers(tab) == [10.0, -2.5, 90.0]
            assert tab.locator(".webmap-align-shadow use").count() == 1
            tab.locator(".webmap-align [name=angle]").fill("0")
            save(tab)
            wait_for(
                lambda: abs(tab.evaluate(ROBOT, "robot_1")[0] - 10.0 - rx) < 0.01,
                page=tab,
            )
            now = tab.evaluate(ROBOT, "robot_0")[:2]
            assert now != pytest.approx(tab.evaluate(ROBOT, "robot_1")[:2])


def send(tab, place, end) -> None:
    """Send a goal; send it again if it reached the gate too late."""
    status = tab.locator(".webmap-goal-word")
    for _ in range(10):
        tab.locator(".webmap-goal-go").click()
        drag(tab, place, end)
        tab.wait_for_function(
            """() => document.querySelector(".webmap-goal-arrow.sent")
              || /^Not sent/.test(
                document.querySelector(".webmap-goal-word").textContent)"""
        )
        if not TOO_LATE.search(status.inner_text()):
            return
