"""Paths to goals and trails, in the frame of the map."""

import itertools
import math
import sys

import pytest
from module_fakes import header, numbers, pose, to_root

from webmap.base.geometry import Quaternion, Vector3
from webmap.scene.wire.encode import encode_changes


def path(points, frame="map", *, ros2=False) -> dict:
    head = header(frame, ros2=ros2)
    poses = [{"header": head, "pose": pose(x, y)} for x, y in points]
    return {"header": head, "poses": poses}


def go(link, x, y, yaw=0.0, frame="odom"):
    link.publish("/odom", {"header": header(frame), "pose": pose(x, y, yaw)})


@pytest.fixture
def robot(robot, link):
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
    return robot


def in_world(line) -> list[tuple[float, float]]:
    """Return the points of a line on the map."""
    values = numbers(line.get("points") or "")
    place = to_root(line)
    pairs = zip(values[::2], values[1::2], strict=True)
    return [place.apply(x, y) for x, y in pairs]


def near(points):
    return [pytest.approx(point, abs=2e-3) for point in points]


@pytest.mark.parametrize("ros2", [False, True])
def test_a_path_keeps_its_position_on_the_map_while_the_robot_moves(link, robot, ros2):
    module = robot.add_module("Path", link, "/plan")
    points = [(1.0, 2.0), (3.5, -4.25), (-7.125, 0.0)]
    link.publish("/plan", path(points, ros2=ros2))
    for at in [(0, 0, 0), (5, -3, 1), (-200.5, 77, math.pi), (1, 1, -2)]:
        go(link, *at)
        assert in_world(module.line) == near(points)


def test_a_path_added_to_a_robot_away_from_the_origin_is_in_place(link, robot):
    go(link, 10, 20, 2.0)
    module = robot.add_module("Path", link, "/plan")
    link.publish("/plan", path([(1, 2), (3, 4)]))
    assert in_world(module.line) == near([(1, 2), (3, 4)])


def test_a_path_is_drawn_under_the_robot_and_ignores_clicks(link, robot):
    module = robot.add_module("Path", link, "/plan", name="local")
    children = list(robot.svg.children)
    assert children.index(module.svg) < children.index(robot.model)
    assert module.svg.get("pointer-events") == "none"
    assert set(module.svg.classes) == {"path", "local"}
    robot.remove_module(module)
    assert module.svg.parent is None
    assert "/plan" not in link.listeners


def test_a_path_without_poses_removes_the_line(link, robot):
    module = robot.add_module("Path", link, "/plan")
    link.publish("/plan", path([(1, 2), (4, 6)]))
    assert module.length == pytest.approx(5.0)
    link.publish("/plan", path([]))
    assert in_world(module.line) == []
    assert module.length == 0


def test_a_long_path_is_thinned_evenly_and_keeps_both_ends(link, robot):
    module = robot.add_module("Path", link, "/plan", max_points=100)
    link.publish("/plan", path([(i * 0.01, 0) for i in range(5000)]))
    drawn = in_world(module.line)
    assert len(drawn) == 100
    assert drawn[0] == pytest.approx((0, 0))
    assert drawn[-1] == pytest.approx((49.99, 0))
    gaps = [b[0] - a[0] for a, b in itertools.pairwise(drawn)]
    assert max(gaps) < 1.1
    assert len(module.points) == 5000


@pytest.mark.parametrize("wrong", [None, math.nan, math.inf])
def test_a_path_with_a_non_finite_point_is_refused(link, robot, wrong):
    module = robot.add_module("Path", link, "/plan")
    link.publish("/plan", path([(1, 2), (3, 4)]))
    link.publish("/plan", path([(1, 2), (3, wrong)]))
    assert in_world(module.line) == near([(1, 2), (3, 4)])
    (problem,) = robot.problems.values()
    assert "as point 1 of 2" in problem
    assert "/plan" in problem
    link.publish("/plan", path([(5, 6), (7, 8)]))
    assert robot.problems == {}
    assert in_world(module.line) == near([(5, 6), (7, 8)])


def test_a_path_with_zero_quaternions_is_drawn(link, robot):
    message = path([(1, 2), (3, 4)])
    for each in message["poses"]:
        each["pose"]["orientation"] = {"x": 0, "y": 0, "z": 0, "w": 0}
    module = robot.add_module("Path", link, "/plan")
    link.publish("/plan", message)
    assert in_world(module.line) == near([(1, 2), (3, 4)])


def test_removing_a_path_removes_its_problem(link, robot):
    module = robot.add_module("Path", link, "/plan")
    link.publish("/plan", path([(math.nan, 0)]))
    robot.remove_module(module)
    assert robot.problems == {}


def test_a_path_update_triggers_other_modules_of_the_robot(link, robot):
    received = []

    class Listener:
        def __init__(self, robot) -> None:
            pass

        def on_path_update(self, path):
            received.append(path.length)

    robot.add_module(Listener)
    robot.add_module("Path", link, "/plan")
    link.publish("/plan", path([(0, 0), (0, 3)]))
    assert received == [3.0]


def test_a_trail_follows_the_past_positions_of_the_robot(link, robot):
    trail = robot.add_module("Trail")
    way = [(0.1 * i, 0.05 * i, 0.3 * i) for i in range(30)]
    for at in way:
        go(link, *at)
    (line,) = trail.svg.children
    assert in_world(line) == near([(x, y) for x, y, _ in way])


def test_small_steps_add_no_points(link, robot):
    trail = robot.add_module("Trail", step=0.5)
    for i in range(101):
        go(link, 0.01 * i, 0)
    assert trail.points == [[(0, 0), (0.5, 0), (1.0, 0)]]


def test_a_jump_breaks_the_trail(link, robot):
    trail = robot.add_module("Trail", jump=1.0)
    for x in (0, 0.5, 1.0, 9.0, 9.5):
        go(link, x, 0)
    assert trail.points == [[(0, 0), (0.5, 0), (1.0, 0)], [(9, 0), (9.5, 0)]]
    assert len(trail.svg.children) == 2


def test_a_robot_that_only_jumps_has_no_trail_line(link, robot):
    trail = robot.add_module("Trail")
    for x in range(0, 1000, 10):
        go(link, x, 0)
    assert len(trail.svg.children) == 0


def drawn(trail):
    return [in_world(line) for line in trail.svg.children]


def test_a_trail_is_limited_in_length(link, robot):
    trail = robot.add_module("Trail", length=10.0, step=0.09)
    for i in range(1000):
        go(link, 0.1 * i, 0)
    ((*points,),) = trail.points
    assert 9.8 <= points[-1][0] - points[0][0] <= 10.2
    assert drawn(trail) == [near(points)]


def test_the_parts_of_a_trail_before_a_jump_are_shortened_and_removed(link, robot):
    trail = robot.add_module("Trail", length=1.0)
    for x in (0, 0.5, 1.0, 9.0, 9.5):
        go(link, x, 0)
    assert trail.points == [[(0.5, 0), (1.0, 0)], [(9.0, 0), (9.5, 0)]]
    assert drawn(trail) == [near(part) for part in trail.points]
    go(link, 10.4, 0)
    assert trail.points == [[(9.0, 0), (9.5, 0), (10.4, 0)]]
    assert drawn(trail) == [near(part) for part in trail.points]
    for x in (11.3, 19.0, 19.9, 20.8):
        go(link, x, 0)
    assert trail.points == [[(19.0, 0), (19.9, 0), (20.8, 0)]]
    assert drawn(trail) == [near(part) for part in trail.points]


def test_the_lines_of_a_long_trail_join_without_a_gap(link, robot, monkeypatch):
    monkeypatch.setattr("webmap.features.layers.trail.PART", 20)
    trail = robot.add_module("Trail", length=5.0, step=0.09)
    for i in range(200):
        go(link, 0.1 * i, 0)
    assert [len(part) for part in trail.points[1:]] == [21, 20]
    for one, next in itertools.pairwise(trail.points):
        assert one[-1] == next[0]
    assert drawn(trail) == [near(part) for part in trail.points]


def test_a_pose_takes_as_few_calls_and_bytes_with_a_long_trail(link, robot):
    calls, trail = 0, robot.add_module("Trail", length=30.0)

    def count(frame, event, arg):
        nonlocal calls
        calls += event in ("call", "c_call")

    for i in range(400):
        go(link, 0.125 * i, 0)
    fragment = robot.svg.fragment
    since = fragment.revision
    robot.position = Vector3(50.0, 0.0, 0.0)
    sys.setprofile(count)
    trail.on_odometry_update()
    sys.setprofile(None)
    assert calls <= 22
    assert len(trail.points[0]) > 230
    assert len(encode_changes(fragment, since)) <= 22


def test_a_robot_at_half_a_metre_per_second_adds_a_point_every_second_pose(link, robot):
    trail = robot.add_module("Trail")
    for i in range(41):
        go(link, 0.0501 * i, 0)
    assert len(trail.points[0]) == 21


def test_a_trail_that_is_shorter_than_a_step_is_one_step(link, robot):
    trail = robot.add_module("Trail", length=0.1)
    for x in (0, 0.5, 1.0):
        go(link, x, 0)
    assert trail.points == [[(0.5, 0), (1.0, 0)]]
    assert drawn(trail) == [near(part) for part in trail.points]


def test_a_trail_can_be_cleared(link, robot):
    trail = robot.add_module("Trail")
    go(link, 0, 0)
    go(link, 0.5, 0)
    trail.clear()
    assert trail.svg.children == ()
    go(link, 0.6, 0)
    go(link, 0.8, 0)
    assert trail.points == [[(0.6, 0), (0.8, 0)]]


@pytest.mark.parametrize("name", ["length", "step", "jump"])
@pytest.mark.parametrize("value", [0, -1, math.nan, math.inf])
def test_invalid_trail_lengths_are_refused(robot, name, value):
    with pytest.raises(ValueError, match=f"{name} must be metres above 0"):
        robot.add_module("Trail", **{name: value})


def test_the_path_of_a_robot_on_its_side_is_in_place(link, robot):
    module = robot.add_module("Path", link, "/plan")
    link.publish("/plan", path([(1, 2), (3, 4)]))
    q = Quaternion(0.5, 0.5, 0.5, 0.5)
    message = {"header": header(), "pose": pose(3, 4)}
    message["pose"]["orientation"] = {"x": q.x, "y": q.y, "z": q.z, "w": q.w}
    link.publish("/odom", message)
    assert in_world(module.line) == near([(1, 2), (3, 4)])
