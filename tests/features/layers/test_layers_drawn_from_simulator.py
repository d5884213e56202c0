"""Every layer in a browser, compared with the true places in the simulator.

A simulator of each dialect runs in this process, a page of another process shows it
over a real bridge, and the test reads the places of everything on the map of the page.
"""

import io
import math
import re
import threading
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from urllib.parse import urljoin

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Browser, Page, expect
from running_simulators import Running, simulators

from equipment.chromium import watched_tab
from equipment.waiting import wait_for
from equipment.webmap_process import page_of
from webmap.base.geometry import Pose
from webmap.sim.navigator import SimGoal

pytestmark = pytest.mark.browser

HERE = Path(__file__).parents[1]
HELPERS = """
const world = () => document.querySelector("svg.webmap .world");
window.toWorld = (element, x, y) => {
  const m = world().getScreenCTM().inverse().multiply(element.getScreenCTM());
  return [m.a * x + m.c * y + m.e, m.b * x + m.d * y + m.f];
};
window.inWorld = (selector, points) => {
  const element = document.querySelector(selector);
  return element ? points.map(([x, y]) => toWorld(element, x, y)) : [];
};
window.polyline = (selector) => [...document.querySelectorAll(selector)].flatMap(
  (line) => [...line.points].map(({ x, y }) => toWorld(line, x, y)));
window.dots = (selector) => [...document.querySelectorAll(selector)].flatMap((path) =>
  [...(path.getAttribute("d") ?? "").matchAll(/M(-?\\d+) (-?\\d+)h(\\d+)/g)].map(
    ([, x, y, s]) => toWorld(path, +x + (s >> 1), +y + (s >> 1))));
window.starts = (selector) => {
  const path = document.querySelector(selector);
  const found = (path.getAttribute("d") ?? "").matchAll(/M(-?[\\d.]+) (-?[\\d.]+)/g);
  return [...found].map(([, x, y]) => toWorld(path, +x, +y));
};
window.pixels = async (selector, places) => {
  const image = document.querySelector(selector);
  const bitmap = new Image();
  bitmap.src = image.getAttribute("href");
  await bitmap.decode();
  const canvas = new OffscreenCanvas(bitmap.naturalWidth, bitmap.naturalHeight);
  const context = canvas.getContext("2d");
  context.drawImage(bitmap, 0, 0);
  const data = context.getImageData(0, 0, canvas.width, canvas.height);
  const m = image.getScreenCTM().inverse().multiply(world().getScreenCTM());
  return places.map(([x, y]) => {
    const u = (m.a * x + m.c * y + m.e) / image.width.baseVal.value;
    const v = (m.b * x + m.d * y + m.f) / image.height.baseVal.value;
    if (!(u >= 0 && u < 1 && v >= 0 && v < 1)) return null;
    const [column, row] = [u * canvas.width, v * canvas.height].map(Math.floor);
    const at = 4 * (column + canvas.width * row);
    return [...data.data.subarray(at, at + 4)];
  });
};
"""
WALL, FREE, CLEAR = [0, 0, 0, 255], [255, 255, 255, 255], [0, 0, 0, 0]
LETHAL, INSCRIBED = [79, 70, 229, 255], pytest.approx([79, 70, 229, 190], abs=1)

INFLATED = "/robot_0/inflated_obstacles"
LAYERS = {
    "Maps": ".occupancy-grid.map > image",
    "Pictures": ".images > image",
    "Costmaps": ".occupancy-grid.local > image",
    "Cells": ".gridcells > .cells",
    "Scans": ".laserscan > .dot",
    "Clouds": ".pointcloud > .dot.band-0",
    "Plans": ".path > polyline",
    "Trails": ".trail",
    "Poses": ".posearray > .arrow",
    "Points": ".pointstamped > .point",
    "Uncertainty": ".covariance > .ellipse",
    "Footprints": ".polygon > polygon",
    "Ranges": ".range > .cone",
    "Markers": ".markers .marker",
    "Satellite fixes": ".navsatfix > .cross",
    "Health": ".diagnostics",
}


@pytest.fixture(scope="module")
def worlds() -> Iterator[dict[str, Running]]:
    with simulators("ros1", "ros2") as found:
        for each in found.values():
            spot = _reachable(each.world, each.world.robots[0].pose, 1.8, 3)
            each.do(partial(_arrange, each, spot))
        yield found


def _arrange(running: Running, spot: Pose) -> None:
    one, other = running.world.robots
    other.pose = other.odometry = spot
    # Coordinates from the start of the robot differ from those on the map.
    one.odometry = Pose(1.5, -2.0, 0.7)
    running.node.advertise(INFLATED, "nav_msgs/GridCells")


@pytest.fixture(scope="module")
def url(worlds) -> Iterator[str]:
    where = {f"LAYERS_{name.upper()}": each.url for name, each in worlds.items()}
    with page_of(HERE / "page_of_layers.py", **where) as found:
        yield found


@pytest.fixture(scope="module", params=["ros1", "ros2"])
def running(request, worlds) -> Running:
    return worlds[request.param]


@pytest.fixture(scope="module")
def tab(chromium: Browser, url: str, running: Running, worlds) -> Iterator[Page]:
    name = next(name for name, each in worlds.items() if each is running)
    with watched_tab(chromium, 1000, 900) as page:
        page.add_init_script(HELPERS)
        page.set_default_timeout(30_000)
        page.goto(url.replace("/?", f"/{name}?"))
        for selector in LAYERS.values():
            page.wait_for_selector(selector, state="attached")
        for grid in ("map", "local", "global"):
            picture = f".occupancy-grid.{grid} > image[href]"
            page.wait_for_selector(picture, state="attached")
        page.wait_for_selector(".covariance > .ellipse[rx]", state="attached")
        yield page


def until(look, wanted, what: str) -> None:
    """Wait until the result of ``look`` satisfies ``wanted``."""
    wait_for(lambda: wanted(look()), lambda: f"{what}, not {look()}")


def near(tab: Page, script: str, wanted, within: float, what: str) -> None:
    """Wait until points of the page are at the expected places, in metres."""

    def off(found) -> float:
        truth = np.array(wanted() if callable(wanted) else wanted, float)
        points = np.array(found, float)
        if points.shape != truth.shape:
            return math.inf
        return float(abs(points - truth).max())

    until(lambda: tab.evaluate(script), lambda found: off(found) <= within, what)


def test_the_robot_is_drawn_at_its_true_pose(tab, running):
    pose = running.world.robots[0].pose
    odometry = running.world.robots[0].odometry
    assert math.dist((odometry.x, odometry.y), (pose.x, pose.y)) > 5
    front = pose @ Pose(1.0)
    script = 'inWorld("g.robot[data-name=Bob]", [[0, 0], [1, 0]])'
    near(tab, script, [(pose.x, pose.y), (front.x, front.y)], 0.005, "robot")


def test_every_dot_of_a_scan_is_at_the_end_of_its_ray(tab, running):
    pose = running.world.robots[0].pose
    ranges = running.world.sweep([0])[0]
    turns = pose.yaw - math.pi + np.arange(len(ranges)) * math.tau / len(ranges)
    hit = np.isfinite(ranges)
    xs = pose.x + ranges[hit] * np.cos(turns[hit])
    ys = pose.y + ranges[hit] * np.sin(turns[hit])
    near(tab, 'dots(".laserscan > .dot")', np.column_stack((xs, ys)), 0.005, "scan")


def test_a_cloud_shows_walls_and_other_robots_but_no_floor(tab, running):
    pose = running.world.robots[0].pose
    ranges = running.world.sweep([0])[0]
    walls = running.world.scanner.sweep([pose])[0]
    turns = pose.yaw - math.pi + np.arange(len(ranges)) * math.tau / len(ranges)
    true = np.concatenate(
        [
            np.column_stack(
                (pose.x + r[ok] * np.cos(turns[ok]), pose.y + r[ok] * np.sin(turns[ok]))
            )
            for r in (ranges, walls)
            for ok in [np.isfinite(r)]
        ]
    )
    near_floor = 0.1 / math.tan(math.radians(6))  # the lowest ring sees lower

    def look() -> tuple[float, float]:
        """Return the distances of dots from obstacles, and the share that is drawn."""
        drawn = np.array(tab.evaluate('dots(".pointcloud > .dot")')).reshape(-1, 2)
        if not len(drawn):
            return math.inf, 0.0
        apart = np.hypot(*(drawn[:, np.newaxis] - true).transpose(2, 0, 1))
        from_robot = np.hypot(*(drawn - (pose.x, pose.y)).T)
        off = apart.min(axis=1)[from_robot > near_floor].max(initial=0.0)
        return float(off), float((apart.min(axis=0) < 0.1).mean())

    until(look, lambda found: found[0] < 0.03 and found[1] > 0.95, "a cloud")
    bands = tab.locator(".pointcloud > .dot").evaluate_all(
        "paths => paths.map((path) => (path.getAttribute('d') ?? '').length > 0)"
    )
    assert len(bands) == 8
    assert bands[0]
    assert bands[-1]


def test_the_map_shows_walls_and_free_space(tab, running):
    plan = running.world.plan
    rows, columns = np.nonzero(plan.occupancy == 100)
    solid = [plan.center(rows[i], columns[i]) for i in range(0, len(rows), 97)]
    rows, columns = np.nonzero(plan.occupancy == 0)
    free = [plan.center(rows[i], columns[i]) for i in range(0, len(rows), 4999)]
    find = '(places) => pixels(".occupancy-grid.map > image", places)'
    assert tab.evaluate(find, solid) == [WALL] * len(solid)
    assert tab.evaluate(find, free) == [FREE] * len(free)


@pytest.mark.parametrize("part", ["local", "global"])
def test_costs_are_lethal_at_walls_and_decrease_with_distance(tab, running, part):
    world = running.world
    pose, obstacles = world.robots[0].pose, world.obstacles
    places, kinds = [], []
    for x in np.arange(pose.x - 1.7, pose.x + 1.7, 0.11):
        for y in np.arange(pose.y - 1.7, pose.y + 1.7, 0.11):
            cell = world.plan.cell(x, y)
            if any(math.hypot(ox - x, oy - y) < 1.2 for ox, oy, _ in world.others(0)):
                continue
            if obstacles.solid[cell] and not _edge(obstacles, cell):
                kinds.append("lethal")
            elif not obstacles.touches(x, y, 0.64):
                kinds.append("free")
            elif obstacles.touches(x, y, 0.16) and not obstacles.touches(x, y, 0.06):
                kinds.append("inscribed")
            elif obstacles.touches(x, y, 0.45) and not obstacles.touches(x, y, 0.33):
                kinds.append("near")
            else:
                continue
            places.append((float(x), float(y)))
    find = f'(places) => pixels(".occupancy-grid.{part} > image", places)'
    found = tab.evaluate(find, places)
    assert {"free", "inscribed", "near"} <= set(kinds)
    for place, kind, colour in zip(places, kinds, found, strict=True):
        if kind == "near":
            assert 0 < colour[3] < 190, place
        else:
            expected = {"lethal": LETHAL, "free": CLEAR, "inscribed": INSCRIBED}
            assert colour == expected[kind], (place, kind)


def _edge(obstacles, cell) -> bool:
    row, column = cell
    return not obstacles.solid[row - 1 : row + 2, column - 1 : column + 2].all()


def test_costmap_updates_follow_a_passing_robot(tab, running):
    one, other = running.world.robots
    home = other.pose
    find = '(at) => pixels(".occupancy-grid.local > image", [at])'
    for ahead in (0.9, 1.6):
        at = one.pose @ Pose(ahead)

        def put(at=at) -> None:
            other.pose = Pose(at.x, at.y)

        running.do(put)
        until(
            lambda at=at: tab.evaluate(find, [at.x, at.y]),
            lambda found: found == [LETHAL],
            "costs of a robot",
        )
    first = one.pose @ Pose(0.9)
    until(
        lambda: tab.evaluate(find, [first.x, first.y]),
        lambda found: found != [LETHAL],
        "costs where it was",
    )
    near(
        tab,
        'inWorld(".markers .marker.cylinder > *", [[0, 0]])',
        [(other.pose.x, other.pose.y)],
        0.01,
        "its marker",
    )
    running.do(lambda: setattr(other, "pose", home))


def test_particles_and_the_ellipse_show_the_uncertainty_of_the_pose(tab, running):
    pose = running.world.robots[0].pose

    def drawn_from() -> list[tuple[float, float]]:
        poses = running.published["/robot_0/particlecloud"]["poses"]
        return [(p["position"]["x"], p["position"]["y"]) for p in poses]

    # The line of an arrow begins at one end of its base, beside the pose.
    near(tab, 'starts(".posearray > .arrow")', drawn_from, 0.03, "particles")
    ellipse = 'document.querySelector(".covariance > .ellipse")'
    script = f"""(() => {{ const e = {ellipse};
      return inWorld(".covariance > .ellipse", [[0, 0], [e.rx.baseVal.value, 0],
                                                [0, e.ry.baseVal.value]]); }})()"""
    middle, along, aside = (np.array(at) for at in tab.evaluate(script))
    assert middle == pytest.approx((pose.x, pose.y), abs=0.005)
    assert math.dist(middle, along) == pytest.approx(0.24, abs=0.002)
    assert math.dist(middle, aside) == pytest.approx(0.10, abs=0.002)
    turn = math.atan2(*(along - middle)[::-1]) - pose.yaw
    assert math.sin(turn) == pytest.approx(0, abs=0.01), "the long axis points ahead"


def test_a_footprint_in_the_odom_frame_is_drawn_around_the_robot(tab, running):
    pose = running.world.robots[0].pose
    turns = [pose.yaw + i * math.tau / 16 for i in range(16)]
    outline = [
        (pose.x + 0.25 * math.cos(t), pose.y + 0.25 * math.sin(t)) for t in turns
    ]
    near(tab, 'polyline(".polygon > polygon")', outline, 0.005, "footprint")


def test_a_cone_begins_at_the_sonar_and_ends_at_its_measured_distance(tab, running):
    sonar = running.world.robots[0].pose @ Pose(0.25)
    near(tab, 'starts(".range > .cone")', [(sonar.x, sonar.y)], 0.005, "cone")
    arc = 'document.querySelector(".range > .cone").getAttribute("d")'

    def apart(path: str) -> float:
        sonar_message = running.published["/robot_0/sonar"]
        reach = min(sonar_message["range"], sonar_message["max_range"])
        assert reach > 0.1
        return abs(float(re.search(r"A([\d.]+)", path).group(1)) - reach)

    until(
        lambda: tab.evaluate(arc),
        lambda path: apart(path) < 0.002,
        "the length of the cone",
    )


def test_points_in_base_link_and_cells_in_odom_are_in_place_on_the_map(tab, running):
    node, robot = running.node, running.world.robots[0]
    at = robot.odometry @ Pose(1.0, 0.5)
    messages = {
        "/robot_0/lookahead_point": ("base_link", {"point": place(1.2, -0.4)}),
        INFLATED: (
            "odom",
            {
                "cell_width": 0.2,
                "cell_height": 0.1,
                "cells": [place(at.x, at.y), place(at.x + 0.2, at.y)],
            },
        ),
    }

    def publish() -> None:
        stamp = node.graph.clock()
        for topic, (frame, message) in messages.items():
            name = f"{robot.frames}{frame}"
            header = node.messages.dialect.header(topic, stamp, name)
            node.publish(topic, {"header": header, **message})

    running.do(publish)
    ahead = robot.pose @ Pose(1.2, -0.4)
    find = 'inWorld(".pointstamped > .point", [[0, 0]])'
    near(tab, find, [(ahead.x, ahead.y)], 0.005, "point")
    map_from_odom = robot.pose @ robot.odometry.inverse
    corners = ((-0.1, -0.05), (0.3, -0.05), (0.3, 0.05))
    there = [map_from_odom @ Pose(at.x + x, at.y + y) for x, y in corners]
    find = """(() => {
      const { x, y, width, height } =
        document.querySelector(".gridcells > .cells").getBBox();
      const [right, top] = [x + width, y + height];
      return inWorld(".gridcells > .cells", [[x, y], [right, y], [right, top]]);
    })()"""
    near(tab, find, [(corner.x, corner.y) for corner in there], 0.005, "cells")


def place(x: float, y: float) -> dict[str, float]:
    return {"x": x, "y": y, "z": 0.0}


def test_a_satellite_fix_is_drawn_at_the_robot(tab, running):
    pose = running.world.robots[0].pose
    near(
        tab, 'inWorld(".navsatfix > .cross", [[0, 0]])', [(pose.x, pose.y)], 0.02, "fix"
    )
    doubt = tab.locator(".navsatfix > .covariance")
    assert float(doubt.get_attribute("r")) == pytest.approx(0.3)


def test_battery_charge_health_and_log_are_shown(tab, running):
    charge = running.world.robots[0].charge
    expect(tab.locator("#charge")).to_have_text(f"{100 * charge:.1f} %")
    expect(tab.locator("#health > li")).to_have_count(3)
    names = tab.locator("#health .name").all_inner_texts()
    space = "" if running.node.messages.dialect.is_ros2 else "robot_0/"
    assert sorted(names) == [
        f"{space}base: Battery",
        f"{space}base: Motors",
        f"{space}laser: Frequency",
    ]
    expect(tab.locator(".diagnostics")).to_have_class(re.compile(r"\bok\b"))
    # This is the lowest charge, so the charge stays there.
    running.do(lambda: setattr(running.world.robots[0], "charge", 0.05))
    expect(tab.locator(".diagnostics.error title")).to_have_text(
        f"{space}base: Battery: 5 %, charge it"
    )
    expect(tab.locator("#health > li").first).to_have_class("error")
    expect(tab.locator("#log > li.warn .message").first).to_have_text(
        "the battery is at 5 %"
    )
    expect(tab.locator("#charge")).to_have_text("5.0 %")


def test_the_shown_picture_matches_the_simulated_camera(tab, running):
    tab.wait_for_function("document.querySelector('#view').naturalWidth === 320")
    true = np.asarray(Image.open(io.BytesIO(running.world.look(0))), float)

    def apart() -> float:
        source = tab.locator("#view").get_attribute("src")
        found = tab.request.get(urljoin(tab.url, source)).body()
        shown = np.asarray(Image.open(io.BytesIO(found)), float)
        return float(abs(shown - true).mean())

    # The newest picture may be older than the last motion of the robots.
    until(apart, lambda mean: mean < 2, "another view would differ by tens")


def test_a_goal_has_a_path_a_marker_a_trail_and_lines_in_the_log(tab, running):
    world = running.world
    robot, navigator = world.robots[0], world.navigators[0]
    way: list[tuple[float, float]] = [(robot.pose.x, robot.pose.y)]
    steered: list[tuple[float, float]] = []
    step, seen = world.step, threading.Event()

    def note(dt: float) -> None:
        if navigator.path and not seen.is_set():
            return  # The simulator waits until the test has read the page.
        step(dt)
        way.append((robot.pose.x, robot.pose.y))
        if navigator.steers_to is not None:
            steered.append(navigator.steers_to)
        if robot.travelled > 1.0:
            world.stop(0)

    target = _reachable(world, robot.pose, 2, 4)
    world.step = note
    try:
        running.do(lambda: world.send_goal(0, SimGoal(target)))
        until(lambda: len(navigator.path), lambda count: count > 1, "a path")
        near(tab, 'polyline(".path > polyline")', navigator.path, 0.005, "path")
        goal = 'inWorld(".markers .marker.arrow > *", [[0, 0]])'
        near(tab, goal, [(target.x, target.y)], 0.5, "the goal's arrow")
        text = tab.locator('.marker.text[data-ns="goal"] text')
        expect(text).to_have_text(re.compile(r"^\d+\.\d m$"))
        seen.set()
        has_stopped = lambda: navigator.goal is None and robot.twist.is_zero  # noqa: E731
        until(has_stopped, bool, "the end of the path")
    finally:
        world.step = step
    trail = 'polyline(".trail > polyline")'
    until(
        lambda: tab.evaluate(trail),
        lambda points: sum(map(math.dist, points, points[1:])) > 0.9,
        "a trail",
    )
    drawn, true = np.array(tab.evaluate(trail)), np.array(way)
    off = np.hypot(*(drawn[:, np.newaxis] - true).transpose(2, 0, 1)).min(axis=1)
    assert off.max() < 0.03
    assert math.dist(drawn[0], way[0]) < 0.1
    # The point keeps its last place: no point is published while the robot stops.
    ahead = 'inWorld(".pointstamped > .point", [[0, 0]])[0]'
    until(
        lambda: tab.evaluate(ahead),
        lambda at: min(math.dist(at, each) for each in steered) < 0.05,
        "the point that the robot steers to",
    )
    log = tab.locator("#log .message")
    line = f"a goal at ({target.x:.2f}, {target.y:.2f})"
    expect(log.get_by_text(line, exact=True)).to_have_count(1)
    expect(log.get_by_text("the goal canceled: stopped")).to_have_count(1)
    expect(tab.locator(".marker.arrow")).to_have_count(0)


def _reachable(world, here: Pose, near: float, far: float) -> Pose:
    """Return a place that a robot reaches on a straight line, far from other robots."""
    for turn in np.linspace(0, math.tau, 64, endpoint=False).tolist():
        for reach in np.arange(far, near, -0.1).tolist():
            way = [
                Pose(here.x, here.y, turn) @ Pose(r)
                for r in np.arange(0, reach, 0.1).tolist()
            ]
            spot = way[-1]
            if any(world.obstacles.touches(at.x, at.y, 0.5) for at in way[5:]):
                continue
            if all(
                math.hypot(x - spot.x, y - spot.y) > 1 for x, y, _ in world.others(0)
            ):
                return spot
    raise AssertionError("there is no reachable place")


def test_each_layer_can_be_switched_by_keyboard_and_the_choice_persists(
    tab, chromium, url
):
    tab.locator(".webmap-layers > summary").focus()
    tab.keyboard.press("Enter")
    boxes = tab.locator(".webmap-layers-row:not([hidden]) > input")
    expect(boxes).to_have_count(len(LAYERS))
    names = tab.locator(".webmap-layers-row:not([hidden])").all_inner_texts()
    assert [name.strip() for name in names] == list(LAYERS)
    shown = """(selector) => [...document.querySelectorAll(selector)].some((found) => {
      for (let e = found; e; e = e.parentElement)
        if (getComputedStyle(e).display === "none") return false;
      return true; })"""
    for name, selector in LAYERS.items():
        tab.keyboard.press("Tab")
        assert tab.evaluate("document.activeElement.parentElement.innerText") == name
        until(lambda s=selector: tab.evaluate(shown, s), bool, name)
        tab.keyboard.press("Space")
        assert not tab.evaluate(shown, selector), name
        others = {n: s for n, s in LAYERS.items() if n != name}
        if name == "Maps":
            for other in others.values():
                until(lambda s=other: tab.evaluate(shown, s), bool, other)
    map = tab.locator("#webmap_container svg.webmap")
    expect(map.locator("g.robot")).to_have_count(1)
    tab.reload()
    for selector in LAYERS.values():
        tab.wait_for_selector(selector, state="attached")
        hidden = (lambda s=selector: tab.evaluate(shown, s), lambda it: not it)
        until(*hidden, f"{selector} after a reload")
    with watched_tab(chromium, 800, 600) as someone:
        someone.goto(url.replace("/?", tab.url[tab.url.rindex("/") :] + "?"))
        someone.wait_for_selector(LAYERS["Scans"], state="attached")
        assert someone.evaluate(shown, LAYERS["Scans"]), "each viewer has an own choice"
    tab.locator(".webmap-layers > summary").click()
    expect(boxes).to_have_count(len(LAYERS))
    for box in boxes.all():
        box.check()
    for selector in LAYERS.values():
        until(lambda s=selector: tab.evaluate(shown, s), bool, selector)
