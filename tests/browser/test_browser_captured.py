"""Frames of real rosbridge servers, played back, in the console of ``webmap view``."""

import array
import json
import math
import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager

import cbor2
import pytest
from playwright.sync_api import expect

from equipment.captured_frames import PLAYER, frame_file, played
from equipment.processes import BRIDGE, WEB, Process, matrix, running
from equipment.waiting import wait_for

pytestmark = [pytest.mark.browser, pytest.mark.slow]

ROBOT = "/robot_0/odom:/robot_0/cmd_vel:/robot_0/base_scan"


@pytest.fixture(scope="module")
def ros1():
    with playing("ros1") as url:
        yield url


@pytest.fixture(scope="module")
def ros2():
    with playing("ros2") as url:
        yield url


@contextmanager
def playing(dialect: str) -> Iterator[str]:
    command = (*played(dialect), "--port", 0)
    with running(*command, pattern=BRIDGE, **PLAYER) as process:
        yield process.url


@contextmanager
def viewing(*urls: str, robots: list[str]) -> Iterator:
    options = [part for robot in robots for part in ("--robot", robot)]
    command = ("view", *urls, *options, "--only-given", "--port", 0, "--no-browser")
    with running(*command, pattern=WEB) as process:
        yield process


def recorded_pose(dialect: str) -> tuple[float, float, float]:
    """The pose of the robot in the captured odometry: x, y, yaw."""
    frame = json.loads(frame_file(dialect, "publish_odom.json").read_text())
    pose = frame["msg"]["pose"]["pose"]
    q = pose["orientation"]
    assert (q["x"], q["y"]) == (0, 0)
    return pose["position"]["x"], pose["position"]["y"], 2 * math.atan2(q["z"], q["w"])


def recorded_dots(dialect: str) -> list[tuple[float, float]]:
    """The ends of the rays of the captured scan, in the robot's frame, in metres."""
    frame = frame_file(dialect, "cbor_scan_inf_nan.bin").read_bytes()
    scan = cbor2.loads(frame)["msg"]
    little_endian_floats = 85
    assert scan["ranges"].tag == little_endian_floats
    ranges = array.array("f", scan["ranges"].value)
    assert any(map(math.isnan, ranges))
    assert any(map(math.isinf, ranges))
    dots = []
    for ray, reach in enumerate(ranges):
        if scan["range_min"] <= reach <= scan["range_max"]:
            bearing = scan["angle_min"] + ray * scan["angle_increment"]
            dots.append((reach * math.cos(bearing), reach * math.sin(bearing)))
    return dots


def dots_in_world(tab, selector: str) -> list[list[float]]:
    """The middle of each dot that the browser draws, in metres of the world."""
    return tab.locator(f"{selector} > .laserscan > .dot").evaluate(
        """dot => {
            const world = dot.closest(".world");
            const tf = world.getCTM().inverse().multiply(dot.getCTM());
            const square = /M(-?\\d+) (-?\\d+)h(\\d+)v(\\d+)h-\\d+/y;
            const d = dot.getAttribute("d"), places = [];
            while (square.lastIndex < d.length) {
                const [, x, y, w, h] = square.exec(d).map(Number);
                const p = new DOMPoint(x + w / 2, y + h / 2).matrixTransform(tf);
                places.push([p.x, p.y]);
            }
            return places;
        }"""
    )


def robot(name: str) -> str:
    return f'.robot[data-name="{name}"]'


def row(tab, name: str):
    return tab.locator("#robots > li").filter(has_text=name)


def expect_recorded(tab, name: str, dialect: str) -> None:
    """Check that a robot and its scan are drawn at the recorded place."""
    x, y, yaw = recorded_pose(dialect)
    cos, sin = math.cos(yaw), math.sin(yaw)
    drawn = matrix(tab, robot(name))
    assert drawn == pytest.approx([cos, sin, -sin, cos, x, y], abs=1e-5)
    expected = [
        (x + cos * u - sin * v, y + sin * u + cos * v)
        for u, v in recorded_dots(dialect)
    ]
    # There are fewer dots before the view is fitted to the robots.
    drawn = lambda: dots_in_world(tab, robot(name))  # noqa: E731
    wait_for(lambda: len(drawn()) == len(expected), f"{len(expected)} dots", page=tab)
    dots = drawn()
    assert len(dots) > 500
    for dot, place in zip(dots, expected, strict=True):
        assert dot == pytest.approx(place, abs=0.003)


def test_one_map_shows_ros_1_and_ros_2_robots_at_their_recorded_poses(tab, ros1, ros2):
    robots = [f"1@Anna:{ROBOT}", f"2@Berta:{ROBOT}"]
    with viewing(ros1, ros2, robots=robots) as server:
        tab.goto(server.url)
        for name, dialect in (("Anna", "ros1"), ("Berta", "ros2")):
            tab.locator(f"{robot(name)}:not(.unplaced)").wait_for(state="attached")
            dot = tab.locator(f"{robot(name)} > .laserscan > .dot[d]")
            dot.wait_for(state="attached")
            expect_recorded(tab, name, dialect)
            box = tab.locator(f"{robot(name)} .model").bounding_box()
            assert 0 < box["x"] < 1200, "out of sight"
            assert 0 < box["y"] < 800, "out of sight"
            expect(row(tab, name)).to_contain_text(DRIVEN)
        expect(tab.locator("#bridges summary")).to_have_text("2 bridges connected")
        expect(tab.locator(".robot.stale")).to_have_count(0)
        expect(tab.locator(".laserscan.stale")).to_have_count(0)
        assert tab.locator(".webmap-notice").count() == 0
        tab.goto("about:blank")


DRIVEN = "Moved by another program"
"""The recorded robot was driven by another program."""


def closed_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def expect_going_on(tab, name: str, dialect: str) -> None:
    """Check that the page still receives and shows new data of a robot."""
    expect(tab.locator(f"{robot(name)}:not(.unplaced):not(.stale)")).to_be_attached()
    tab.wait_for_timeout(1500)
    expect(tab.locator(f"{robot(name)}.stale")).to_have_count(0)
    expect_recorded(tab, name, dialect)


def test_an_unreachable_bridge_is_reported_and_the_other_robot_is_still_updated(
    tab, ros1
):
    gone = f"ws://127.0.0.1:{closed_port()}"
    with viewing(ros1, gone, robots=[f"1@Anna:{ROBOT}", f"2@Gone:{ROBOT}"]) as server:
        tab.goto(server.url)
        expect_going_on(tab, "Anna", "ros1")
        expect(tab.locator(f"{robot('Gone')}.unplaced")).to_be_attached()
        bridges = tab.locator("#bridges")
        expect(bridges.locator("summary")).to_have_text("1 of 2 bridges connected")
        bridges.locator("summary").click()
        line = bridges.locator("li").filter(has_text=gone)
        expect(line).to_contain_text("no connection")
        expect(line).to_contain_text("refused")
        expect(row(tab, "Gone")).to_contain_text("No connection to the bridge")
        expect(row(tab, "Anna")).to_contain_text(DRIVEN)
        assert re.search(f"cannot reach the rosbridge at {gone}", server.log)
        tab.goto("about:blank")


@pytest.mark.parametrize(
    ("topics", "sentence"),
    [
        ("/map::", r"Odd: topic '/map': '.+Grid' has no pose of a robot"),
        ("/robot_1/odom::/map", r"/map: expected sensor_msgs/LaserScan, .+Grid"),
    ],
    ids=["odometry", "scan"],
)
@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_a_topic_with_a_wrong_type_is_reported_and_the_other_robot_is_still_updated(
    tab, request, dialect, topics, sentence
):
    url = request.getfixturevalue(dialect)
    with viewing(url, robots=[f"Good:{ROBOT}", f"Odd:{topics}"]) as server:
        for _ in range(2):  # a page that is loaded again shows the notice again
            tab.goto(server.url)
            notice = tab.locator(".webmap-notice.alert")
            expect(notice.filter(has_text=re.compile(sentence))).to_be_visible()
            expect_going_on(tab, "Good", dialect)
        assert re.search(sentence, server.log)
        tab.goto("about:blank")


@pytest.mark.parametrize("url", ["http://robot:9090", "robot:9090", "ws://robot:x"])
def test_an_invalid_url_is_refused_with_one_line(url):
    # There is no server, and so no page that could show the error.
    process = Process("view", url, "--port", 0, "--no-browser")
    assert process.popen.wait(30) == 2
    assert process.log.count("\n") == 1
    assert "is not the address of a bridge" in process.log
    process.end()
