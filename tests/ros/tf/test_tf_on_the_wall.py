"""On a page, the dots of a scan stay on the wall while the robot turns."""

import json
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from websockets.sync.client import connect

from equipment.chromium import watched_tab
from equipment.webmap_process import page_of, simulator
from webmap.sim.maps import FLOOR, OCCUPIED, load_map

# The test measures how late the simulator stamps its scans.
pytestmark = [pytest.mark.browser, pytest.mark.serial]

TURN = 1.2
"""Radians a second."""

# Reads the places of the dots on the map after each new drawing of the page.
SAMPLE = """async (seconds) => {
  const path = document.querySelector('.laserscan > .dot');
  const world = document.querySelector('svg.webmap .world');
  const robot = document.querySelector('.robot');
  const found = [];
  const end = performance.now() + seconds * 1000;
  while (performance.now() < end) {
    await new Promise(requestAnimationFrame);
    const inverse = world.getScreenCTM().inverse();
    const { a, b } = inverse.multiply(robot.getScreenCTM());
    const { a: p, b: q, c, d, e, f } = inverse.multiply(path.getScreenCTM());
    found.push({
      yaw: Math.atan2(b, a),
      matrix: [p, q, c, d, e, f],
      d: path.getAttribute('d') ?? '',
    });
  }
  return found;
}"""


PAGE = Path(__file__).with_name("page_of_turning.py")


@contextmanager
def turning(url: str, dialect: str) -> Iterator[None]:
    """Let another client turn the simulated robot on the spot."""
    twist = "geometry_msgs/Twist" if dialect == "ros1" else "geometry_msgs/msg/Twist"
    message = {
        "linear": {"x": 0.0, "y": 0.0, "z": 0.0},
        "angular": {"x": 0.0, "y": 0.0, "z": TURN},
    }
    over = threading.Event()

    def command() -> None:
        with connect(url, compression=None) as link:
            link.send(json.dumps({"op": "advertise", "topic": TOPIC, "type": twist}))
            while not over.wait(0.05):
                publish = {"op": "publish", "topic": TOPIC, "msg": message}
                link.send(json.dumps(publish))

    thread = threading.Thread(target=command)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join(10)


TOPIC = "/robot_0/cmd_vel"


def places(sample) -> np.ndarray:
    """Where the dots of a sample are on the map: the middles of their squares."""
    found = re.findall(r"M(-?\d+) (-?\d+)h(\d+)", sample["d"].replace(",", " "))
    corners = np.array([[float(n) for n in one] for one in found]).reshape(-1, 3)
    x, y = corners[:, 0] + corners[:, 2] / 2, corners[:, 1] + corners[:, 2] / 2
    a, b, c, d, e, f = sample["matrix"]
    return np.column_stack((a * x + c * y + e, b * x + d * y + f))


PLAN = load_map(FLOOR)
AROUND = [(row, column) for row in range(-4, 5) for column in range(-4, 5)]


def to_wall(points: np.ndarray) -> np.ndarray:
    """How far points are from the nearest cell that is occupied, in metres.

    A point that is more than four cells away counts as one metre away.
    """
    side = PLAN.resolution
    own = np.floor((points - (PLAN.x, PLAN.y)) / side).astype(int)
    far = np.ones(len(points))
    for row, column in AROUND:
        cells = own + np.array((column, row))
        low = cells * side + (PLAN.x, PLAN.y)
        gap = np.maximum(0, np.maximum(low - points, points - low - side))
        occupied = PLAN.occupancy[cells[:, 1], cells[:, 0]] == OCCUPIED
        far = np.minimum(far, np.where(occupied, np.hypot(*gap.T), 1.0))
    return far


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_scan_dots_stay_on_the_wall_while_the_robot_turns(chromium, dialect):
    with (
        simulator("-n", "1", "--dialect", dialect) as sim,
        page_of(PAGE, TURNING_URL=sim) as url,
        watched_tab(chromium, 800, 600) as page,
    ):
        page.goto(url)
        page.wait_for_selector(".laserscan > .dot[d]", state="attached")
        with turning(sim, dialect):
            first = page.evaluate(f"({SAMPLE})(0.1)")[0]["yaw"]
            page.wait_for_function(TURNED, arg=first)
            samples = page.evaluate(f"({SAMPLE})(2)")
    drawn = {json.dumps([s["matrix"], s["d"]]): s for s in samples}
    assert len(drawn) > 10, "the scan is drawn too rarely"
    yaws = np.unwrap([sample["yaw"] for sample in samples])
    assert yaws[-1] - yaws[0] > 1.0, "the robot does not turn"
    worst = [np.percentile(to_wall(places(s)), 90) for s in drawn.values()]
    # On a busy machine the simulator stamps a scan later than it measured it.
    assert np.percentile(worst, 90) < 0.02, np.round(worst, 3)
    assert max(worst) < 0.2, np.round(worst, 3)


TURNED = """(first) => {
  const world = document.querySelector('svg.webmap .world').getScreenCTM().inverse();
  const { a, b } = world.multiply(document.querySelector('.robot').getScreenCTM());
  return Math.abs(Math.sin(Math.atan2(b, a) - first)) > 0.3;
}"""
