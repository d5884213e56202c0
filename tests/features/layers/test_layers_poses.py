"""Poses with their uncertainty, footprints and the cones of sonars."""

import json
import math

import numpy as np
import pytest
from module_fakes import header, numbers, pose, to_root, typed


@pytest.fixture
def robot(robot, link):
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
    link.publish("/odom", {"header": header(), "pose": pose(4, -2, 0.7)})
    return robot


def arrows(module) -> list[tuple[tuple[float, float], float]]:
    """Return where each arrow begins on the map, and its yaw."""
    place = to_root(module.arrows)
    found = []
    for triangle in (module.arrows.get("d") or "").split("z"):
        if not triangle:
            continue
        x, y, dx, dy, bx, by = numbers(triangle)
        first, tip = np.array([x, y]), np.array([x + dx, y + dy])
        other = np.add(tip, (bx, by))
        base = (first + other) / 2
        start, end = place.apply(*base), place.apply(*tip)
        found.append((start, math.atan2(end[1] - start[1], end[0] - start[0])))
    return found


@pytest.mark.parametrize(
    ("type", "key"),
    [
        ("geometry_msgs/PoseArray", "poses"),
        ("geometry_msgs/msg/PoseArray", "poses"),
        ("nav2_msgs/msg/ParticleCloud", "particles"),
    ],
)
def test_each_pose_is_an_arrow_at_its_position_on_the_map(link, robot, type, key):
    module = robot.add_module("PoseArray", link, "/particles", type=type)
    wanted = [(1.5, 2.5, 0.0), (-3.25, 40.0, 2.0), (0.0, 0.0, -1.5)]
    poses = [pose(*at) for at in wanted]
    if key == "particles":
        poses = [{"pose": each, "weight": 0.5} for each in poses]
    link.publish("/particles", {"header": header(ros2=True), key: poses})
    drawn = arrows(module)
    assert [at for at, _ in drawn] == [
        pytest.approx((x, y), abs=3e-3) for x, y, _ in wanted
    ]
    assert [yaw for _, yaw in drawn] == pytest.approx(
        [yaw for _, _, yaw in wanted], abs=0.02
    )
    link.publish("/odom", {"header": header(), "pose": pose(-40, 2, 3.0)})
    assert arrows(module)[1][0] == pytest.approx((-3.25, 40.0), abs=3e-3)


def test_poses_in_the_robot_frame_move_with_the_robot(link, robot):
    module = robot.add_module("PoseArray", link, "/seen", frame="robot")
    link.publish("/seen", {"header": header("base_link"), "poses": [pose(1, 0)]})
    ((at, yaw),) = arrows(module)
    assert at == pytest.approx((4 + math.cos(0.7), -2 + math.sin(0.7)), abs=3e-3)
    assert yaw == pytest.approx(0.7, abs=0.02)


def test_two_thousand_particles_are_thinned(link, robot):
    module = robot.add_module("PoseArray", link, "/particles", max_poses=300)
    poses = [pose(0.01 * i, 0) for i in range(2000)]
    link.publish("/particles", {"header": header(), "poses": poses})
    assert len(arrows(module)) == 300
    assert len(module.poses) == 2000
    link.publish("/particles", {"header": header(), "poses": []})
    assert arrows(module) == []


ZEROS = {"x": 0, "y": 0, "z": 0, "w": 0}


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        (pose(math.nan, 0), "finite"),
        ({**pose(math.inf, 2), "orientation": {**ZEROS, "z": math.nan}}, "finite"),
    ],
)
def test_an_array_with_a_non_finite_pose_is_refused_and_the_last_array_stays(
    link, robot, wrong, why
):
    module = robot.add_module("PoseArray", link, "/particles")
    link.publish("/particles", {"header": header(), "poses": [pose(1, 2)]})
    link.publish("/particles", {"header": header(), "poses": [pose(8, 8), wrong]})
    assert len(arrows(module)) == 1
    (problem,) = robot.problems.values()
    assert why in problem
    link.publish("/particles", {"header": header(), "poses": []})
    assert robot.problems == {}


@pytest.mark.parametrize(
    "options", [{"type": "nav_msgs/Path"}, {"max_poses": 0}, {"length": 0}]
)
def test_invalid_pose_array_options_are_refused(link, robot, options):
    with pytest.raises(ValueError, match="got"):
        robot.add_module("PoseArray", link, "/particles", **options)


def covariance(xx, yy, xy=0.0, turn=0.0) -> list[float]:
    numbers = [0.0] * 36
    numbers[0], numbers[1], numbers[6], numbers[7], numbers[35] = xx, xy, xy, yy, turn
    return numbers


def doubtful(at, spread) -> dict:
    return {"header": header(), "pose": {"pose": at, "covariance": spread}}


@pytest.mark.parametrize("cbor", [False, True])
def test_the_ellipse_has_the_axes_of_the_covariance(link, robot, cbor):
    module = robot.add_module("PoseWithCovariance", link, "/amcl", deviations=2.0)
    # Half axes of 0.5 m and 0.2 m, the longer one turned by 30 degrees.
    turn = math.radians(30)
    spin = np.array(
        [[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]]
    )
    plane = spin @ np.diag([0.25, 0.04]) @ spin.T
    spread = covariance(plane[0, 0], plane[1, 1], plane[0, 1], 0.01)
    if cbor:
        spread = typed(86, np.array(spread))
    link.publish("/amcl", doubtful(pose(7, 8, 1.0), spread), cbor=cbor)
    rx, ry = float(module.ellipse.get("rx")), float(module.ellipse.get("ry"))
    assert (rx, ry) == pytest.approx((1.0, 0.4))
    place = to_root(module.ellipse)
    assert place.apply(0, 0) == pytest.approx((7, 8))
    end = place.apply(rx, 0)
    assert math.atan2(end[1] - 8, end[0] - 7) == pytest.approx(turn)
    # The heading's sector: 0.1 rad, twice, to either side of 1 rad.
    _, _, x, y, *_ = numbers(module.heading.get("d"))
    low = to_root(module.heading).apply(x, y)
    assert math.atan2(low[1] - 8, low[0] - 7) == pytest.approx(0.8, abs=1e-3)


def test_the_covariance_of_odometry_is_drawn(link, robot):
    module = robot.add_module(
        "PoseWithCovariance", link, "/o", type="nav_msgs/msg/Odometry"
    )
    still = {"linear": dict(x=0, y=0, z=0), "angular": dict(x=0, y=0, z=0)}
    message = doubtful(pose(1, 1), covariance(0.01, 0.01))
    message["twist"] = {"twist": still, "covariance": [0.0] * 36}
    link.publish("/o", message)
    assert float(module.ellipse.get("rx")) == pytest.approx(0.2)
    assert module.heading.get("d") is None


def test_an_unknown_heading_is_drawn_as_a_full_circle(link, robot):
    module = robot.add_module("PoseWithCovariance", link, "/amcl")
    link.publish("/amcl", doubtful(pose(0, 0), covariance(1, 1, 0, 1e6)))
    assert "A2.0000 2.0000 0 1 1" in module.heading.get("d")


@pytest.mark.parametrize(
    ("spread", "why"),
    [
        ([0.0] * 9, "36 numbers, got 9"),
        (covariance(None, 1), "finite"),
        (covariance(1, 1, 5), "spread below 0"),
        (covariance(-1, 1), "spread below 0"),
        (covariance(1, 1, 0, -1), "below 0"),
    ],
)
def test_an_invalid_covariance_is_refused(link, robot, spread, why):
    module = robot.add_module("PoseWithCovariance", link, "/amcl")
    link.publish("/amcl", doubtful(pose(1, 1), covariance(1, 1)))
    before = module.ellipse.attributes
    link.publish("/amcl", doubtful(pose(5, 5), spread))
    assert module.ellipse.attributes == before
    assert to_root(module.ellipse).apply(0, 0) == pytest.approx((1, 1))
    (problem,) = robot.problems.values()
    assert why in problem


def polygon(points, *, ros2=False) -> dict:
    points = [{"x": x, "y": y, "z": 0} for x, y in points]
    return {"header": header("odom", ros2=ros2), "polygon": {"points": points}}


FOOT = [(0.3, 0.2), (0.3, -0.2), (-0.3, -0.2), (-0.3, 0.2)]


@pytest.mark.parametrize(("frame", "goes"), [("map", False), ("robot", True)])
def test_a_footprint_is_placed_by_its_frame(link, robot, frame, goes):
    module = robot.add_module("Polygon", link, "/footprint", frame=frame)
    link.publish("/footprint", polygon(FOOT, ros2=True))
    flat = numbers(module.outline.get("points"))
    place = to_root(module.outline)
    drawn = [place.apply(*p) for p in zip(flat[::2], flat[1::2], strict=True)]
    there = to_root(robot.svg) if goes else None
    wanted = [there.apply(*p) if there else p for p in FOOT]
    assert drawn == [pytest.approx(p, abs=2e-3) for p in wanted]
    assert set(module.svg.classes) == {"polygon", "footprint"}


def test_a_polygon_without_points_is_empty_and_an_invalid_one_is_refused(link, robot):
    module = robot.add_module("Polygon", link, "/footprint")
    link.publish("/footprint", polygon(FOOT))
    before = module.outline.get("points")
    link.publish("/footprint", polygon([(0, 0), (math.nan, 1)]))
    link.publish("/footprint", polygon([(0, 0)] * 10_001))
    assert module.outline.get("points") == before
    (problem,) = robot.problems.values()
    assert "10001 points" in problem
    link.publish("/footprint", polygon([]))
    assert not module.outline.get("points")
    assert robot.problems == {}


def test_an_unknown_frame_option_is_refused(link, robot):
    with pytest.raises(ValueError, match='"map" or "robot", got \'odom\''):
        robot.add_module("Polygon", link, "/footprint", frame="odom")
    assert link.listeners.keys() == {"/odom"}


def sonar(distance, *, view=0.5, low=0.1, high=4.0) -> dict:
    return {
        "header": header("sonar"),
        "radiation_type": 0,
        "field_of_view": view,
        "min_range": low,
        "max_range": high,
        "range": distance,
    }


def test_the_cone_reaches_from_the_sensor_to_the_measured_distance(link, robot):
    module = robot.add_module("Range", link, "/sonar", 0.2, 0.1, 90.0)
    link.publish("/sonar", sonar(2.0))
    x0, y0, x, y, radius, *_ = numbers(module.cone.get("d"))
    on_robot = to_root(robot.svg).inverse @ to_root(module.cone)
    assert on_robot.apply(x0, y0) == pytest.approx((0.2, 0.1))
    assert radius == pytest.approx(2.0)
    right = on_robot.apply(x, y)
    bearing = math.pi / 2 - 0.25
    assert right == pytest.approx(
        (0.2 + 2 * math.cos(bearing), 0.1 + 2 * math.sin(bearing)), abs=1e-3
    )
    assert "clear" not in module.cone.classes
    assert module.distance == 2.0


@pytest.mark.parametrize(
    ("number", "distance", "radius"),
    [
        ("4.5", math.inf, 4.0),
        ("Infinity", math.inf, 4.0),
        ("-Infinity", 0.1, 0.1),
        ("null", None, None),
        ("NaN", None, None),
        ("0.05", None, None),
        ("-1", None, None),
    ],
)
def test_a_sonar_distinguishes_no_echo_from_an_invalid_distance(
    link, robot, number, distance, radius
):
    module = robot.add_module("Range", link, "/sonar")
    text = json.dumps(sonar(12345)).replace("12345", number)
    link.publish("/sonar", text)
    assert module.distance == distance
    drawn = module.cone.get("d")
    assert (drawn and numbers(drawn)[4]) == radius
    assert ("clear" in module.cone.classes) == (distance == math.inf)
    assert robot.problems == {}


@pytest.mark.parametrize(
    "wrong",
    [{"view": 0}, {"view": 7}, {"view": None}, {"high": 0}, {"high": None}],
)
def test_a_sonar_with_an_invalid_field_of_view_or_max_range_is_refused(
    link, robot, wrong
):
    module = robot.add_module("Range", link, "/sonar")
    link.publish("/sonar", sonar(1.0))
    before = module.cone.get("d")
    link.publish("/sonar", sonar(2.0, **wrong))
    assert module.cone.get("d") == before
    assert len(robot.problems) == 1
