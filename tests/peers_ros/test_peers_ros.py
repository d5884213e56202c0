"""A real ROS 2 graph behind a rosbridge that this project did not write.

The robot is given by ``--robot``, as discovery gets no answers there: the bridge's
own rosapi needs the types of ``rosapi_msgs``, and the graph has no ``/tf``, which needs
those of ``tf2_msgs``. No registry has wheels of either. Discovery by rosapi and frames
are tested with the simulator, and with frames captured from real bridges.
"""

import math
import re
import subprocess
import sys
import time

import pytest
from playwright.sync_api import expect
from ros_facts import (
    ANGLE_MIN,
    ANGLE_STEP,
    CELL,
    CELLS,
    CORNER,
    DRAWN,
    ROBOT,
    START,
    TOPICS,
)

from equipment.chromium import hold
from equipment.processes import WEB, matrix, running
from equipment.waiting import wait_for

# The first run installs ROS, which may take minutes.
pytestmark = [
    pytest.mark.peer,
    pytest.mark.browser,
    pytest.mark.slow,
    pytest.mark.timeout(300),
]

ROBOT_OPTION = f"Bob:{ROBOT}/odom:{ROBOT}/cmd_vel:{ROBOT}/scan"
BOB = '.robot[data-name="Bob"]'

SOON = 1.0
"""Seconds; the gate takes at most 0.25, and the machine may be busy."""


@pytest.fixture(scope="module")
def server(ros):
    command = ("view", ros.url, "--robot", ROBOT_OPTION, "--port", 0, "--no-browser")
    with running(*command, pattern=WEB) as process:
        yield process


@pytest.fixture
def opened(server, tab):
    tab.goto(server.url)
    drawn_now(tab).wait_for(state="attached")
    tab.locator(f"{BOB} > .laserscan:not(.stale) > .dot[d]").wait_for(state="attached")
    return tab


def drawn_now(tab):
    return tab.locator(f"{BOB}:not(.unplaced):not(.stale)")


def dots(tab):
    """The middle of each dot that the browser draws, in metres of the world."""
    return tab.locator(f"{BOB} > .laserscan > .dot").evaluate(
        """dot => {
            const world = dot.closest(".world");
            const tf = world.getCTM().inverse().multiply(dot.getCTM());
            const squares = /M(-?\\d+) (-?\\d+)h(\\d+)/g;
            const found = [...dot.getAttribute("d").matchAll(squares)];
            return found.map(([, x, y, size]) => {
                const half = Number(size) / 2;
                const middle = new DOMPoint(Number(x) + half, Number(y) + half);
                const at = middle.matrixTransform(tf);
                return [at.x, at.y];
            });
        }"""
    )


def drive(tab, ros):
    """Hold the key that drives forward until the robot's node reports motion."""
    tab.locator("#robots .row button").click()
    tab.locator("svg.webmap").focus()
    x, y = place(ros)

    def has_moved():
        newest = ros.twists()[-1:]
        return bool(newest) and not newest[0].is_zero and away(ros, x, y) > 0.05

    hold(tab.keyboard, "w", has_moved)


def place(ros):
    """Return where the robot was when it last received a velocity."""
    twists = ros.twists()
    return twists[-1].pose[:2] if twists else START[:2]


def away(ros, x, y):
    return math.dist(place(ros), (x, y))


def is_stopped(ros):
    twists = ros.twists()
    return bool(twists) and twists[-1].is_zero


def expect_drawn_where_it_is(tab, ros):
    """Wait until the drawn pose of a robot that does not move is its true pose."""
    x, y, yaw = ros.twists()[-1].pose
    here = pytest.approx([math.cos(yaw), math.sin(yaw), x, y], abs=0.002)

    def drawn():
        m = matrix(tab, BOB)
        return [m[0], m[1], m[4], m[5]]

    wait_for(lambda: drawn() == here, what=f"drawing it at {x:.3f}, {y:.3f}")


def test_the_robot_and_its_scan_are_drawn_at_the_positions_from_its_ros_nodes(opened):
    x, y, yaw = START
    cos, sin = math.cos(yaw), math.sin(yaw)
    assert matrix(opened, BOB) == pytest.approx([cos, sin, -sin, cos, x, y], abs=1e-5)
    bearings = {ray: yaw + ANGLE_MIN + ANGLE_STEP * ray for ray in DRAWN}
    expected = [
        (x + reach * math.cos(bearings[ray]), y + reach * math.sin(bearings[ray]))
        for ray, reach in DRAWN.items()
    ]
    drawn = dots(opened)
    assert len(drawn) == len(expected), "invalid ranges are not drawn"
    for dot, place in zip(drawn, expected, strict=True):
        assert dot == pytest.approx(place, abs=0.003)


def test_a_held_key_drives_the_robot_and_its_release_sends_zero(opened, ros):
    drive(opened, ros)
    opened.keyboard.up("w")
    released = time.monotonic()
    wait_for(lambda: is_stopped(ros), what="zero")
    speeds = {t.speed for t in ros.twists() if not t.is_zero}
    assert 0.05 < max(speeds) <= 0.3 + 1e-9, "a base without a stated stop time is slow"
    assert min(speeds) > 0
    zero = next(t for t in ros.twists() if t.is_zero and t.at > released - SOON)
    assert zero.at - released < SOON
    expect_drawn_where_it_is(opened, ros)
    wait_for(
        lambda: time.monotonic() - ros.twists()[-1].at > SOON,
        what="silence, so that other programs can publish,",
    )
    assert is_stopped(ros)


def test_after_a_restart_of_the_bridge_the_robot_receives_zero_first(opened, ros):
    drive(opened, ros)
    ros.kill_bridge()
    killed = len(ros.twists())
    assert not is_stopped(ros), "without the bridge the robot does not stop"
    row = opened.locator("#robots > li")
    expect(row).to_contain_text("No connection: may still be moving")
    opened.wait_for_timeout(500)  # the key is still held
    ros.start_bridge()
    wait_for(lambda: len(ros.twists()) > killed, seconds=20.0, what="the next velocity")
    wait_for(lambda: is_stopped(ros), what="zero")
    assert all(t.is_zero for t in ros.twists()[killed:]), (
        "the held key still drove the robot"
    )
    opened.keyboard.up("w")
    drawn_now(opened).wait_for(state="attached")
    scan = opened.locator(f"{BOB} > .laserscan:not(.stale)")
    expect(scan).to_be_attached(timeout=30_000)  # the new bridge has to find it
    expect_drawn_where_it_is(opened, ros)
    drive(opened, ros)
    opened.keyboard.up("w")
    wait_for(lambda: is_stopped(ros), what="zero after the robot drove again")


def webmap(*arguments):
    """Run a WebMap command with the topic list of ROS itself."""
    done = subprocess.run(
        [sys.executable, "-m", "webmap", *arguments, "--topics", "-"],
        input=TOPICS,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


def box_in_world(picture):
    """Return the left, low, right and high edge of an image on the map, in metres."""
    return picture.evaluate(
        """image => {
            const world = image.closest(".world");
            const tf = world.getCTM().inverse().multiply(image.getCTM());
            const box = image.getBBox();
            const one = new DOMPoint(box.x, box.y).matrixTransform(tf);
            const far = new DOMPoint(box.x + box.width, box.y + box.height);
            const other = far.matrixTransform(tf);
            return [Math.min(one.x, other.x), Math.min(one.y, other.y),
                    Math.max(one.x, other.x), Math.max(one.y, other.y)];
        }"""
    )


def test_a_fleet_file_from_a_topic_list_shows_the_map_published_earlier(
    ros, tab, tmp_path
):
    code, fleet, output = webmap("discover", ros.url, "--toml")
    assert code == 0, output
    file = tmp_path / "fleet.toml"
    file.write_text(fleet)
    with running("run", file, "--port", 0, "--no-browser", pattern=WEB) as process:
        tab.goto(process.url)
        tab.locator('.robot[data-name="robot_0"]:not(.unplaced)').wait_for(
            state="attached"
        )
        room = tab.locator(".occupancy-grid image")
        room.wait_for(state="attached")
        there = pytest.approx(
            [*CORNER, CORNER[0] + CELL * CELLS[0], CORNER[1] + CELL * CELLS[1]],
            abs=0.001,
        )
        wait_for(lambda: box_in_world(room) == there, what="the room at its place")
        tab.goto("about:blank")


def test_the_readiness_check_measures_the_real_robot(ros):
    code, output, _ = webmap("doctor", ros.url, "--seconds", "2")
    assert code == 0, output
    assert "The topics come from the given list; robots found: robot_0." in output
    rate = re.search(rf"{ROBOT}/odom: (\d+\.\d) messages a second", output)
    assert rate, output
    assert float(rate[1]) == pytest.approx(20, abs=8)
    assert f"{ROBOT}/cmd_vel has the stated type Twist" in output
    assert re.search(rf"Scans come packed as CBOR \({ROBOT}/scan\)", output)
