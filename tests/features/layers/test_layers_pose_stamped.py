"""A published pose, such as a goal, is drawn as an arrow at its place."""

import math
import time

import pytest
from module_fakes import header, matrix_of, pose, to_root

from webmap.base.errors import ConfigError
from webmap.console.card_parts import GoalLine


@pytest.fixture
def robot(robot, link):
    robot.set_odometry_topic(link, "/odom", type="geometry_msgs/PoseStamped")
    link.publish("/odom", {"header": header(), "pose": pose(4, -2, 0.7)})
    return robot


def at(module) -> tuple[float, float, float]:
    """Return where the arrow is on the map, and where it points."""
    place = to_root(module.arrow)
    (x, y), (to_x, to_y) = place.apply(0, 0), place.apply(1, 0)
    return x, y, math.atan2(to_y - y, to_x - x)


def test_a_pose_is_an_arrow_that_keeps_its_position_and_heading_on_the_map(link, robot):
    module = robot.add_module("PoseStamped", link, "/target", name="far")
    assert module.svg.get("visibility") == "hidden", "there is no pose yet"
    assert {"posestamped", "far"} <= set(module.svg.classes)
    link.publish("/target", {"header": header(), "pose": pose(-3, 40, 2.0)})
    assert module.svg.get("visibility") is None
    assert at(module) == pytest.approx((-3, 40, 2.0), abs=1e-3)
    link.publish("/odom", {"header": header(), "pose": pose(-3, 40, 3.0)})
    assert at(module) == pytest.approx((-3, 40, 2.0), abs=1e-3)
    assert module.svg.get("visibility") is None, "only goals are hidden"
    link.publish("/target", {"header": header(), "pose": pose(1, 1, 0.0)})
    assert at(module) == pytest.approx((1, 1, 0.0), abs=1e-3)


def test_a_pose_is_placed_by_the_alignment_of_the_robot(link, robot):
    module = robot.add_module("PoseStamped", link, "/target")
    link.publish("/target", {"header": header(), "pose": pose(1, 0, 0.0)})
    robot.set_alignment(10.0, 0.0, 90.0)
    assert at(module) == pytest.approx((10, 1, math.pi / 2), abs=1e-3)


def test_a_reached_goal_is_hidden(link, robot):
    module = robot.add_module("PoseStamped", link, "/goal_pose", name="goal")
    robot.set_alignment(10.0, 0.0, 90.0)
    link.publish("/goal_pose", {"header": header(), "pose": pose(8, 8, 0.0)})
    first = module.svg.get("data-pose")
    link.publish("/odom", {"header": header(), "pose": pose(7, 8, 0.0)})
    assert module.svg.get("visibility") is None, "a metre away is not reached"
    link.publish("/odom", {"header": header(), "pose": pose(7.8, 8, 0.0)})
    assert module.svg.get("visibility") == "hidden"
    link.publish("/odom", {"header": header(), "pose": pose(7, 8, 0.0)})
    assert module.svg.get("visibility") == "hidden", "the goal was reached before"
    link.publish("/goal_pose", {"header": header(), "pose": pose(2, 2, 0.0)})
    assert module.svg.get("visibility") is None
    assert module.svg.get("data-pose") != first, (
        "the page can distinguish the two goals"
    )


@pytest.mark.parametrize(("frame", "seen"), [("odom", "hidden"), ("map", None)])
def test_a_goal_is_reached_only_in_the_frame_used_to_draw_the_robot(
    link, robot, frame, seen
):
    robot.set_tf(link, map_frame="odom", namespace="/bob", quiet=True)
    module = robot.add_module("PoseStamped", link, "/goal_pose", name="goal")
    link.publish("/goal_pose", {"header": header(frame), "pose": pose(8, 8, 0.0)})
    assert module.svg.get("visibility") is None
    link.publish("/odom", {"header": header("odom"), "pose": pose(8, 8, 0.0)})
    assert module.svg.get("visibility") == seen


def test_a_non_finite_pose_is_refused_and_the_last_pose_stays(link, robot):
    module = robot.add_module("PoseStamped", link, "/target")
    link.publish("/target", {"header": header(), "pose": pose(1, 2)})
    before = matrix_of(module.arrow)
    link.publish("/target", {"header": header(), "pose": pose(math.nan, 2)})
    assert matrix_of(module.arrow) == before
    assert any("finite" in problem for problem in robot.problems.values())


@pytest.mark.parametrize("wrong", [{"length": 0}, {"reached": math.inf}])
def test_invalid_lengths_are_refused(link, robot, wrong):
    with pytest.raises(ConfigError, match="must be metres above 0"):
        robot.add_module("PoseStamped", link, "/target", **wrong)


def test_the_name_of_a_scanner_is_a_class_of_its_element(link, robot):
    front = robot.add_module("LaserScanner", link, "/front", name="front")
    plain = robot.add_module("LaserScanner", link, "/scan")
    assert list(front.svg.classes) == ["laserscan", "front"]
    assert list(plain.svg.classes) == ["laserscan"]


def test_the_data_layer_attribute_omits_the_namespace_of_the_robot(link, robot):
    names = {
        "/bob/front/scan": "front/scan",  # the robot is called Bob
        "/scan": "/scan",
        "/bob": "/bob",
        "/ann/scan": "/ann/scan",
    }
    for topic, name in names.items():
        module = robot.add_module("LaserScanner", link, topic)
        assert module.svg.get("data-layer") == name


def test_a_goal_on_the_map_is_a_goal_of_the_robot_until_it_is_reached(link, robot):
    robot.add_module("PoseStamped", link, "/target")
    robot.add_module("PoseStamped", link, "/goal_pose", name="goal")
    link.publish("/target", {"header": header(), "pose": pose(8, 8, 0.0)})
    assert not robot.has_own_goal
    assert card_goal(robot) == "No goal"
    link.publish("/goal_pose", {"header": header(), "pose": pose(8, 8, 0.0)})
    assert robot.has_own_goal
    assert card_goal(robot) == "Goal shown on the map"
    link.publish("/odom", {"header": header(), "pose": pose(8, 8, 0.0)})
    assert not robot.has_own_goal


def test_a_plan_is_active_while_it_is_new_or_the_robot_is_on_it(
    link, robot, monkeypatch
):
    module = robot.add_module("Path", link, "/plan")
    now = time.monotonic()
    line = [{"header": header(), "pose": pose(x, 0, 0.0)} for x in (0, 10)]

    def own_goal(x, y, later):
        link.publish("/odom", {"header": header(), "pose": pose(x, y, 0.0)})
        monkeypatch.setattr(time, "monotonic", lambda: now + later)
        return robot.has_own_goal

    assert not own_goal(5, 0, 0.0)
    link.publish("/plan", {"header": header(), "poses": line})
    assert own_goal(5, 3, 1.0), "the plan is new"
    assert own_goal(5, 0.2, 60.0), "a planner may send its plan once"
    assert not own_goal(5, 3, 60.0), "the robot left the plan"
    assert not own_goal(10, 0.2, 60.0), "the robot is at the end"
    link.publish("/plan", {"header": header(), "poses": []})
    assert not own_goal(5, 0.2, 60.0)
    assert module.points == []


def card_goal(robot):
    line = GoalLine()
    line.show(robot)
    return line._words.text
