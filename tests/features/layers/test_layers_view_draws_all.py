"""``webmap view`` draws all topics of simulated robots without a configuration."""

import math

import numpy as np
import pytest
from playwright.sync_api import Browser, Page
from running_simulators import simulators
from test_layers_drawn_from_simulator import HELPERS, until

from equipment.chromium import watched_tab
from equipment.webmap_process import webmap
from webmap.base.geometry import Pose

pytestmark = pytest.mark.browser

# The layers of each robot; costmaps and markers are on the map.
OF_A_ROBOT = (
    ".laserscan > .dot[d]",
    ".pointcloud > .dot.band-7[d]",
    ".path > polyline",
    ".trail",
    ".posearray > .arrow[d]",
    ".covariance > .ellipse[rx]",
    ".polygon > polygon[points]",
    ".range > .cone[d]",
    ".navsatfix > .cross:not([visibility])",
)
# In ROS 2 the names of parts do not contain the robot.
HEALTH = {"ros1": ".diagnostics.ok", "ros2": ".diagnostics.unheard"}
# Further topics of a real robot, with names that cannot be known before.
ODD = (
    '.laserscan.scan-2[data-layer="rear/ranges"] > .dot[d]',
    '.path[data-layer="transformed_global_plan"] > polyline[points]',
    '.posestamped[data-layer="dock"]:not([visibility]) > .arrow[d]',
    '.posearray[data-layer="trees"] > .arrow[d]',
    '.pointstamped[data-layer="clicked_point"]:not([visibility]) > .point',
    '.gridcells[data-layer="inflated_obstacles"] > .cells[d]',
    '.polygon.other[data-layer="keep_in"] > polygon[points]',
)
ON_THE_MAP = {
    ".occupancy-grid.map > image[href]": 3,
    '.occupancy-grid.map[data-layer="/robot_0/map"] > image[href]': 1,
    '.occupancy-grid.map[data-layer="/second_map"] > image[href]': 1,
    ".occupancy-grid.costmap > image[href]": 4,
    '.costmap[data-layer="local_costmap/costmap"] > image[href]': 2,
    '.costmap[data-layer="global_costmap/costmap"] > image[href]': 2,
    ".markers": 2,
}


@pytest.mark.parametrize(
    ("dialect", "tilted"), [("ros1", False), ("ros2", True)], ids=["ros1", "ros2"]
)
def test_webmap_view_draws_all_layers_of_simulated_robots(
    chromium: Browser, dialect, tilted
):
    """This includes lasers upside down and a cloud in its optical frame."""
    with simulators(dialect, tilted=tilted) as found:
        world = found[dialect].world
        found[dialect].do(lambda: face_a_wall(world, 1))
        found[dialect].do(lambda: publish_more(found[dialect].node))
        view = webmap("view", found[dialect].url, "--port", "0", "--no-browser")
        with view as url, watched_tab(chromium, 1000, 700) as tab:
            tab.set_default_timeout(20_000)
            tab.add_init_script(HELPERS)
            tab.goto(url)
            for selector in (*OF_A_ROBOT, HEALTH[dialect]):
                for name in ("robot_0", "robot_1"):
                    inside = f'.robot[data-name="{name}"] {selector}'
                    tab.wait_for_selector(inside, state="attached")
            for selector in ODD:
                inside = f'.robot[data-name="robot_0"] {selector}'
                tab.wait_for_selector(inside, state="attached")
            for selector, count in ON_THE_MAP.items():
                tab.locator(selector).nth(count - 1).wait_for(state="attached")
                assert tab.locator(selector).count() == count
            ellipse = '[data-name="robot_1"] .covariance > .ellipse'
            is_placed(tab, ellipse, world.robots[1].pose)
            dots_are_where_walls_are(tab, world, clouds=2 if tilted else 1)
            is_placed(tab, '[data-layer="dock"] > .arrow', DOCK)
            is_placed(tab, '[data-layer="clicked_point"] > .point', DOCK)
            switch_one_map(tab)
            assert tab.locator(".webmap-notice").count() == 0


def is_placed(tab: Page, selector: str, at: Pose) -> None:
    """Check the place of an element on the map."""
    off = lambda: math.dist(tab.evaluate(PLACE, selector), (at.x, at.y))  # noqa: E731
    until(off, lambda metres: metres < 0.05, selector)


def face_a_wall(world, index: int) -> None:
    """Turn a robot towards a wall that its camera can see."""
    robot, (ranges,) = world.robots[index], world.sweep([index])
    near = np.flatnonzero((ranges > 1.5) & (ranges < 4.0))
    turn = near[len(near) // 2] * math.tau / len(ranges) - math.pi
    robot.pose = robot.odometry = robot.pose @ Pose(0.0, 0.0, turn)


def dots_are_where_walls_are(tab: Page, world, clouds: int) -> None:
    """Check the places of the dots of a robot's laser and clouds on the map."""
    robot = '.robot[data-name="robot_1"]'
    pose, ranges = world.robots[1].pose, world.sweep([1])[0]
    turns = pose.yaw - math.pi + np.arange(len(ranges)) * math.tau / len(ranges)
    hit = np.isfinite(ranges)
    rays = np.column_stack((np.cos(turns[hit]), np.sin(turns[hit])))
    walls = (pose.x, pose.y) + ranges[hit, np.newaxis] * rays

    def apart(selector: str) -> np.ndarray:
        drawn = np.array(tab.evaluate(f"dots('{robot} {selector}')")).reshape(-1, 2)
        return np.hypot(*(drawn[:, np.newaxis] - walls).transpose(2, 0, 1))

    def is_scan(off: np.ndarray) -> bool:
        return len(off) == len(walls) and off.min(axis=0).max() < 0.01

    scan = lambda: apart(".laserscan > .dot")  # noqa: E731
    until(scan, is_scan, "each ray has a dot at its end")
    there = tab.locator(f"{robot} .pointcloud")
    drawn = there.filter(has=tab.locator('.dot[d^="M"]'))
    until(lambda: (there.count(), drawn.count()), (clouds, clouds).__eq__, "clouds")

    def share() -> float:
        return float((apart(".pointcloud > .dot").min(axis=0) < 0.1).mean())

    until(share, lambda part: part > 0.95, "walls are in the clouds")
    if clouds == 1:
        return
    (optical,) = (
        number
        for number in range(clouds)
        if len(apart(f".pointcloud:nth-child({number + 1} of .pointcloud) > .dot"))
        and _sees_only_ahead(tab, robot, number, pose)
    )
    mine = apart(f".pointcloud:nth-child({optical + 1} of .pointcloud) > .dot")
    ahead = abs((turns[hit] - pose.yaw + math.pi) % math.tau - math.pi)
    seen = (ahead < math.radians(20)) & (ranges[hit] < 5.5)
    assert seen.sum() > 10
    assert (mine[:, seen].min(axis=0) < 0.15).mean() > 0.9, "points ahead are seen"


def _sees_only_ahead(tab: Page, robot: str, number: int, pose) -> bool:
    nth = f".pointcloud:nth-child({number + 1} of .pointcloud) > .dot"
    x, y = (np.array(tab.evaluate(f"dots('{robot} {nth}')")) - (pose.x, pose.y)).T
    aside = np.arctan2(y, x) - pose.yaw
    return bool(abs((aside + math.pi) % math.tau - math.pi).max() < math.radians(32))


DOCK = Pose(3.0, -2.0, 1.0)


def publish_more(node):
    """Give the first robot a second scan, a map of its own, and unusual topic names."""
    robot, plan = node.world.robots[0], node.world.plan
    kinds = {
        "rear/ranges": "sensor_msgs/LaserScan",
        "transformed_global_plan": "nav_msgs/Path",
        "dock": "geometry_msgs/PoseStamped",
        "trees": "geometry_msgs/PoseArray",
        "clicked_point": "geometry_msgs/PointStamped",
        "inflated_obstacles": "nav_msgs/GridCells",
        "keep_in": "geometry_msgs/PolygonStamped",
    }
    for name, type in kinds.items():
        node.advertise(f"{robot.topics}/{name}", type)
    for topic in (f"{robot.topics}/map", "/second_map"):
        node.advertise(topic, "nav_msgs/OccupancyGrid", latch=True)
        node.publish(topic, node.messages.grid(topic, node.graph.clock(), plan))
    corners = [{"x": float(x), "y": float(y), "z": 0.0} for x, y in SQUARE]

    def publish_all():
        now, messages = node.graph.clock(), node.messages
        topic = f"{robot.topics}/rear/ranges"
        (ranges,) = node.world.sweep([0])
        scanner = node.world.options.scanner
        node.publish(topic, messages.scan(topic, now, robot, scanner, ranges))
        topic = f"{robot.topics}/transformed_global_plan"
        node.publish(topic, messages.path(topic, now, [(0.0, 0.0), (2.0, 1.0)]))
        at = messages.pose_stamped(now, DOCK)
        node.publish(f"{robot.topics}/dock", at)
        trees = {"header": at["header"], "poses": [at["pose"]]}
        node.publish(f"{robot.topics}/trees", trees)
        here = at["pose"]["position"]
        clicked = {"header": at["header"], "point": here}
        node.publish(f"{robot.topics}/clicked_point", clicked)
        sides = {"cell_width": 0.25, "cell_height": 0.25}
        grown = {"header": at["header"], **sides, "cells": [here]}
        node.publish(f"{robot.topics}/inflated_obstacles", grown)
        fence = {"header": at["header"], "polygon": {"points": corners}}
        node.publish(f"{robot.topics}/keep_in", fence)

    node.on_step.append(publish_all)


SQUARE = ((0, 0), (4, 0), (4, 4), (0, 4))


def switch_one_map(tab):
    """Switch off one of three maps, and check that the others stay."""
    seen = """() => [...document.querySelectorAll(".occupancy-grid.map")]
      .filter((grid) => getComputedStyle(grid).display !== "none")
      .map((grid) => grid.dataset.layer).sort()"""
    tab.locator(".webmap-layers > summary").click()
    assert tab.evaluate(seen) == ["/map", "/robot_0/map", "/second_map"]
    tab.get_by_role("checkbox", name="/second_map", exact=True).uncheck()
    assert tab.evaluate(seen) == ["/map", "/robot_0/map"]


PLACE = """(selector) => {
  const world = document.querySelector("svg.webmap .world").getScreenCTM().inverse();
  const m = world.multiply(document.querySelector(selector).getScreenCTM());
  return [m.e, m.f];
}"""
