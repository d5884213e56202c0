"""Data of sensors that are tilted, upside down or look along z, drawn from above."""

import math

import numpy as np
import pytest
from module_fakes import dots, numbers, to_root
from test_layers_at_stamp import odometry, scan, stamp
from test_layers_cloud import cloud
from test_layers_frames import send_transforms
from test_layers_poses import sonar
from test_layers_ways import in_world
from tilted_frames import OPTICAL, OVER, frame, matrix, posed, quaternion, transformed

from webmap.base.geometry import Quaternion

MAP = frame("map", "odom", (1.0, -2.0, 0.0), (0.0, 0.0, 0.3), 100.0)
BASE = frame("odom", "base_link", (3.0, 1.0, 0.0), (0.0, 0.0, 2.0), 100.0)
SLOPE = frame("odom", "base_link", (3.0, 1.0, 4.0), (0.1, -0.2, 2.0), 100.0)
"""The same on a floor that is not level and four metres higher."""

POINTS = [[1.0, 0.2, 2.0], [-0.5, 0.1, 1.0], [0.3, -1.5, 3.0], [0.0, 0.3, 5.0]]


@pytest.fixture(autouse=True)
def no_patience(monkeypatch):
    monkeypatch.setattr("webmap.poses.placing.PROBLEM_DELAY", 0.0)
    monkeypatch.setattr("webmap.poses.frames.GRACE", 0.0)


@pytest.fixture(params=[BASE, SLOPE], ids=["level", "slope"])
def base(request, robot, link):
    """The transforms to the base of a robot that does not move, level or on a slope."""
    robot.set_tf(link)
    send_transforms(link, MAP, request.param)
    return MAP, request.param


def mount(link, place, turns) -> dict:
    found = frame("base_link", "sensor", place, turns)
    send_transforms(link, found, static=True)
    return found


def sensed(message: dict, seconds: float = 100.0) -> dict:
    return {**message, "header": {"stamp": stamp(seconds), "frame_id": "sensor"}}


def on_map(*paths) -> np.ndarray:
    found = [to_root(path).apply(*dot) for path in paths for dot in dots(path)]
    return np.array(sorted(found))


def flat(points) -> np.ndarray:
    return np.array(sorted(map(tuple, points[:, :2])))


def near(points, within=0.003):
    return pytest.approx(points, abs=within)


TURNS = {
    "an optical frame": OPTICAL,
    "an optical frame that looks down": (-math.pi / 2 - 0.6, 0.0, -math.pi / 2),
    "upside down": OVER,
    "pitched": (0.0, 0.5, 0.0),
    "on its side": (math.pi / 2, 0.0, 0.4),
    "straight down": (0.0, math.pi / 2, 0.0),
    "all at once": (0.7, -0.9, 2.5),
}


@pytest.mark.parametrize("turns", TURNS.values(), ids=TURNS)
def test_a_cloud_of_a_tilted_sensor_is_rotated_in_3d_and_projected(
    link, robot, base, turns
):
    mounted = mount(link, (0.3, 0.1, 0.8), turns)
    module = robot.add_module("PointCloud", link, "/points", cell=0)
    link.publish("/points", sensed(cloud(POINTS)))
    assert on_map(*module.dots) == near(flat(transformed(POINTS, *base, mounted)))
    assert robot.problems == {}


@pytest.mark.parametrize("turns", TURNS.values(), ids=TURNS)
def test_height_limits_are_measured_vertically_above_the_base(link, robot, base, turns):
    mounted = mount(link, (0.3, 0.1, 0.8), turns)
    there = transformed(POINTS, *base, mounted)
    heights = there[:, 2] - base[1]["transform"]["translation"]["z"]
    lowest, low, high, highest = sorted(heights)
    window = {"z_min": (lowest + low) / 2, "z_max": (high + highest) / 2}
    module = robot.add_module("PointCloud", link, "/points", cell=0, **window)
    link.publish("/points", sensed(cloud(POINTS)))
    within = (heights > lowest) & (heights < highest)
    assert on_map(*module.dots) == near(flat(there[within]))


def test_colours_by_height_use_the_height_above_the_base(link, robot, base):
    mounted = mount(link, (0.3, 0.1, 0.8), OPTICAL)
    module = robot.add_module(
        "PointCloud", link, "/points", cell=0, colour_by="z", low=0.0, high=8.0
    )
    link.publish("/points", sensed(cloud([[0.0, -y, 2.0] for y in (0.7, 3.7, 6.7)])))
    there = transformed([[0.0, -y, 2.0] for y in (0.7, 3.7, 6.7)], *base, mounted)
    heights = there[:, 2] - base[1]["transform"]["translation"]["z"]
    for height, point in zip(heights, there, strict=True):
        band = module.dots[int(height)]
        assert on_map(band) == near(point[np.newaxis, :2]), height


def test_height_limits_in_the_map_frame_are_measured_above_the_map(link, robot):
    robot.set_tf(link)
    send_transforms(link, MAP, SLOPE)
    mounted = mount(link, (0.0, 0.0, 0.5), OPTICAL)
    module = robot.add_module(
        "PointCloud", link, "/points", cell=0, frame="map", z_min=4.0, z_max=5.0
    )
    link.publish("/points", sensed(cloud(POINTS)))
    there = transformed(POINTS, MAP, SLOPE, mounted)
    within = (there[:, 2] > 4.0) & (there[:, 2] < 5.0)
    assert 0 < within.sum() < len(POINTS)
    assert on_map(*module.dots) == near(flat(there[within]))


def test_a_cloud_newer_than_the_frames_is_redrawn_when_frames_arrive(link, robot):
    robot.set_tf(link)
    still = (3.0, 1.0, 0.0)
    for seconds in (100.0, 100.1):
        level = frame("map", "base_link", still, (0.0, 0.0, 0.5), seconds)
        send_transforms(link, level)
    mounted = mount(link, (0.3, 0.0, 0.8), OPTICAL)
    module = robot.add_module("PointCloud", link, "/points", cell=0)
    link.publish("/points", sensed(cloud(POINTS), 100.2))
    assert on_map(*module.dots) == near(flat(transformed(POINTS, level, mounted)))
    leaning = frame("map", "base_link", still, (0.2, 0.1, 0.5), 100.2)
    send_transforms(link, leaning)
    assert on_map(*module.dots) == near(flat(transformed(POINTS, leaning, mounted)))


def test_static_frames_place_the_cloud_of_a_robot_without_a_map(link, robot):
    robot.set_odometry_topic(link, "/odom", 0, type="geometry_msgs/PoseStamped")
    robot.set_tf(link, quiet=True)
    mounted = mount(link, (0.3, 0.1, 0.8), OPTICAL)
    module = robot.add_module(
        "PointCloud", link, "/points", cell=0, z_min=0.0, z_max=1.0
    )
    for seconds in (100.0, 100.1):
        odometry(link, seconds, "map")
    link.publish("/points", sensed(cloud(POINTS), 100.0))
    there = transformed(POINTS, frame("map", "base_link", (4.0, 3.0, 0.0)), mounted)
    within = (there[:, 2] >= 0.0) & (there[:, 2] <= 1.0)
    assert 0 < within.sum() < len(POINTS)
    assert on_map(*module.dots) == near(flat(there[within]))


RAYS = [(2.0, 0.5), (1.0, -1.0), (-3.0, 0.25)]


@pytest.mark.parametrize("turns", TURNS.values(), ids=TURNS)
def test_a_scan_of_a_tilted_sensor_is_projected_from_above(link, robot, base, turns):
    mounted = mount(link, (0.2, 0.0, 0.3), turns)
    module = robot.add_module("LaserScanner", link, "/scan", max_dots=None)
    link.publish("/scan", sensed(scan(RAYS, 100.0)))
    (path,) = module.svg.children
    # The rays of the scan are a degree apart.
    rays = [
        (r * math.cos(a), r * math.sin(a), 0.0)
        for x, y in RAYS
        for r, a in [(math.hypot(x, y), math.radians(round(_degrees(x, y))))]
    ]
    assert on_map(path) == near(flat(transformed(rays, *base, mounted)))
    whole = to_root(path)
    assert whole.determinant == pytest.approx(1.0), "dots are still squares"


def _degrees(x, y):
    return math.degrees(math.atan2(y, x))


@pytest.mark.parametrize("turns", [OVER, (math.pi / 2, 0, 0), (0, math.pi / 2, 0)])
def test_a_tilted_sweep_is_corrected_for_motion_in_its_own_plane(link, robot, turns):
    robot.set_tf(link)
    for step in range(3):
        seconds = 100.0 + step / 10
        place = (2.0 + 0.5 * step, 1.0, 0.0)
        send_transforms(link, frame("map", "base_link", place, seconds=seconds))
    mounted = mount(link, (0.0, 0.0, 0.3), turns)
    module = robot.add_module("LaserScanner", link, "/scan", max_dots=None)
    message = scan([(2.0, 0.0), (-2.0, 0.0)], 100.0, increment=0.1 / 360)
    link.publish("/scan", sensed(message))
    ahead, back = np.array([[2.0, 0.0, 0.0], [-2.0, 0.0, 0.0]])
    there = transformed([ahead, back], frame("map", "x", (2.0, 1.0, 0.0)), mounted)
    # Half a sweep later, at 5 m/s; outside of the plane there is no correction.
    there[1, 0] += 0.25 * abs(matrix(*turns)[0, 0])
    (path,) = module.svg.children
    assert on_map(path) == near(flat(there))


def outline(cone) -> np.ndarray:
    text = cone.get("d")
    assert "A" not in text
    pairs = [part.split() for part in text.strip("Mz").split("L")]
    place = to_root(cone)
    return np.array([place.apply(float(x), float(y)) for x, y in pairs])


@pytest.mark.parametrize("roll", [0.0, math.pi / 2, math.pi, 2.0])
def test_a_cone_does_not_depend_on_the_rotation_about_its_axis(link, robot, roll):
    robot.set_tf(link)
    send_transforms(link, MAP, BASE)
    mount(link, (0.2, 0.1, 0.4), (roll, 0.0, 0.7))
    module = robot.add_module("Range", link, "/sonar")
    link.publish("/sonar", sensed(sonar(2.0, view=0.5)))
    x0, y0, x, y, *_ = numbers(module.cone.get("d"))
    place = to_root(module.cone)
    side = [2 * math.cos(0.25), -2 * math.sin(0.25), 0.0]
    level = frame("base_link", "sensor", (0.2, 0.1, 0.4), (0.0, 0.0, 0.7))
    tip, corner = transformed([[0, 0, 0], side], MAP, BASE, level)[:, :2]
    assert place.apply(x0, y0) == near(tip)
    assert place.apply(x, y) == near(corner)


def test_a_cone_that_points_down_has_its_outline_from_above(link, robot, base):
    pitch, half, reach = 1.0, 0.25, 2.0
    mounted = mount(link, (0.2, 0.1, 0.4), (0.3, pitch, 0.7))
    module = robot.add_module("Range", link, "/sonar")
    link.publish("/sonar", sensed(sonar(reach, view=2 * half)))
    drawn = outline(module.cone)
    turns = np.linspace(0, math.tau, 200)
    rim = np.column_stack(
        (
            np.full(200, reach * math.cos(half)),
            reach * math.sin(half) * np.cos(turns),
            reach * math.sin(half) * np.sin(turns),
        )
    )
    true = transformed(np.vstack([[0, 0, 0], rim, [[reach, 0, 0]]]), *base, mounted)[
        :, :2
    ]
    for angle in np.linspace(0, math.tau, 36):
        way = np.array([math.cos(angle), math.sin(angle)])
        assert (drawn @ way).max() == pytest.approx((true @ way).max(), abs=0.01)


@pytest.mark.parametrize("turns", TURNS.values(), ids=TURNS)
def test_paths_and_polygons_of_tilted_frames_are_projected_from_above(
    link, robot, base, turns
):
    mounted = mount(link, (0.2, 0.1, 0.4), turns)
    outline = robot.add_module("Polygon", link, "/footprint")
    plan = robot.add_module("Path", link, "/plan")
    wanted = transformed(POINTS, *base, mounted)[:, :2]
    corners = [dict(zip("xyz", point, strict=True)) for point in POINTS]
    link.publish("/footprint", sensed({"polygon": {"points": corners}}))
    poses = [{"header": {}, "pose": posed(point)} for point in POINTS]
    link.publish("/plan", sensed({"poses": poses}))
    assert np.array(in_world(outline.outline)) == near(wanted)
    assert np.array(in_world(plan.line)) == near(wanted)


def test_the_frames_of_these_tests_use_the_rotation_order_of_ros():
    """RViz turns about fixed axes: roll, then pitch, then yaw."""
    right, down, ahead = matrix(*OPTICAL).T
    assert ahead == pytest.approx([1, 0, 0])
    assert down == pytest.approx([0, 0, -1])
    assert right == pytest.approx([0, -1, 0])
    for turns in TURNS.values():
        there = frame("a", "b", (0, 0, 0), turns)
        assert transformed(POINTS, there) == pytest.approx(POINTS @ matrix(*turns).T)
        assert Quaternion(**quaternion(*turns)).norm == pytest.approx(1.0)
