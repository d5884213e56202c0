"""Without an open page fewer poses are enough, and no robot counts as lost."""

import asyncio
from types import SimpleNamespace

import pytest
from pose_script import ODOMETRY, odometry, play, transform, transforms

from webmap import Bridge, Robot
from webmap.base.audience import RARELY, audience
from webmap.features.alerts.alerts import conditions
from webmap.poses.odometry import SharedThrottle
from webmap.poses.silence import PERIODS

LOST_AFTER = PERIODS * RARELY / 1000
"""Seconds without a pose after which an unwatched robot is lost."""


@pytest.fixture(autouse=True)
def somebody_looks():
    yield
    audience._set(True)


@pytest.fixture
def bridge():
    return Bridge("ws://robot:9090")


@pytest.fixture
def robot(bridge):
    robot = Robot("Bob")
    robot.set_odometry_topic(bridge, "/odom", type=ODOMETRY)
    yield robot
    robot.destroy()


@pytest.fixture(autouse=True)
def no_other_robots(monkeypatch):
    """Count only the robots of the test, and not those of earlier tests."""
    monkeypatch.setattr("webmap.poses.odometry.shared_throttle", SharedThrottle())


def throttle(bridge):
    return bridge._topics["/odom"].options().throttle


def held(robot, **changes):
    """Set the gate's report on a robot."""
    robot.report = SimpleNamespace(**{"holder": None, "goal": None} | changes)
    robot.pose_source.keep_on(robot._needs_poses())


def test_few_poses_come_while_nobody_looks(bridge, robot):
    audience._set(False)
    assert throttle(bridge) == RARELY
    audience._set(True)
    assert throttle(bridge) == 16


def test_all_poses_come_while_a_program_has_control_or_sent_a_goal(bridge, robot):
    audience._set(False)
    held(robot, holder=SimpleNamespace(connection="p1", name="patrol"))
    assert throttle(bridge) == 16
    held(robot)
    assert throttle(bridge) == RARELY
    held(robot, goal=SimpleNamespace(state="active"))
    assert throttle(bridge) == 16
    held(robot, goal=SimpleNamespace(state="reached"))
    assert throttle(bridge) == RARELY


def test_all_poses_come_to_a_module_of_the_user_but_not_for_the_trail(bridge, robot):
    class Odometer:
        def __init__(self, robot):
            pass

        def on_odometry_update(self):
            pass

    robot.add_module("Trail")
    audience._set(False)
    held(robot)
    assert throttle(bridge) == RARELY
    odometer = robot.add_module(Odometer)
    held(robot)
    assert throttle(bridge) == 16
    robot.remove_module(odometer)
    held(robot)
    assert throttle(bridge) == RARELY


def test_a_topic_set_while_nobody_looks_begins_with_few_poses(bridge):
    audience._set(False)
    robot = Robot("Bob")
    robot.set_odometry_topic(bridge, "/odom", type=ODOMETRY)
    assert throttle(bridge) == RARELY
    robot.destroy()


def test_moving_frames_are_received_while_somebody_looks(bridge, robot):
    robot.set_tf(bridge)
    audience._set(False)
    assert set(bridge._topics) == {"/odom", "/tf_static"}
    audience._set(True)
    assert set(bridge._topics) == {"/odom", "/tf_static", "/tf"}


def test_frames_that_alone_place_a_robot_show_that_it_is_lost(bridge, robot):
    robot.set_tf(bridge)
    audience._set(False)
    robot.unsubscribe_odometry_topic()
    assert "/tf" in bridge._topics
    robot.set_odometry_topic(bridge, "/odom", type=ODOMETRY)
    assert "/tf" not in bridge._topics
    other = Robot("Eve")
    other.set_tf(bridge, base_frame="eve")
    assert "/tf" in bridge._topics
    other.destroy()
    assert "/tf" not in bridge._topics
    held(robot, holder=SimpleNamespace(connection="p1", name="patrol"))
    assert "/tf" in bridge._topics


def test_frames_that_end_while_nobody_looks_begin_no_more(bridge, robot):
    robot.set_tf(bridge)
    audience._set(False)
    robot.unset_tf()
    audience._set(True)
    assert set(bridge._topics) == {"/odom"}


def names(lines):
    return [line for line in lines if "no pose for" in line or "poses again" in line]


def test_a_robot_with_few_poses_is_not_lost(monkeypatch):
    async def script(stage):
        robot = stage.robot
        robot.remove_modules()
        stage.link.open()
        robot.set_odometry_topic(stage.link, "/odom", type=ODOMETRY)
        stage.publish("/odom", odometry(0.0, stamp=100.0))
        audience._set(False)
        await stage.wait(1.0)
        for number in range(1, 4):
            stage.publish("/odom", odometry(0.1 * number, stamp=100.0 + 2.9 * number))
            await stage.wait(2.9)
        await stage.wait(2.0)
        audience._set(True)  # the bridge has sent nothing for 4.9 s
        assert "lost" not in conditions(robot)
        assert robot.state.name != "lost"
        assert robot.pose_age == pytest.approx(4.9)  # and the page shows that age
        stage.publish("/odom", odometry(0.5, stamp=113.6))
        await stage.wait(2.9)
        assert "lost" not in conditions(robot)
        await stage.wait(0.2)
        assert "lost" in conditions(robot)
        assert robot.state.name == "lost"

    assert len(names(play(script, monkeypatch))) == 1


def test_a_robot_whose_poses_end_while_nobody_looks_is_lost_later(
    monkeypatch,
):
    async def script(stage):
        robot = stage.robot
        robot.remove_modules()
        stage.link.open()
        robot.set_odometry_topic(stage.link, "/odom", type=ODOMETRY)
        audience._set(False)
        stage.publish("/odom", odometry(0.0, stamp=100.0))
        await stage.wait(LOST_AFTER - 0.1)
        assert "lost" not in conditions(robot)
        await stage.wait(0.2)
        assert "lost" in conditions(robot)
        audience._set(True)
        assert "lost" in conditions(robot)

    assert len(names(play(script, monkeypatch))) == 1


@pytest.mark.parametrize("why", ["nobody looks", "nobody drives"])
def test_no_robot_is_lost_when_fewer_poses_come_right_after_a_pose(monkeypatch, why):
    async def script(stage):
        robot = stage.robot
        robot.remove_modules()
        stage.link.open()
        robot.set_odometry_topic(stage.link, "/odom", type=ODOMETRY)
        if why == "nobody drives":
            audience._set(False)
            robot.pose_source.keep_on(True)
        stage.publish("/odom", odometry(0.0, stamp=100.0))
        await stage.wait(0.1)
        if why == "nobody drives":
            robot.pose_source.keep_on(False)
        else:
            audience._set(False)
        await stage.wait(4.8)
        assert "lost" not in conditions(robot)
        stage.publish("/odom", odometry(0.0, stamp=105.0))
        await stage.wait(LOST_AFTER - 0.1)
        assert "lost" not in conditions(robot)

    assert names(play(script, monkeypatch)) == []


def test_a_lost_robot_stays_lost_when_nobody_looks_any_more(monkeypatch):
    async def script(stage):
        robot = stage.robot
        robot.remove_modules()
        stage.link.open()
        robot.set_odometry_topic(stage.link, "/odom", type=ODOMETRY)
        stage.publish("/odom", odometry(0.0, stamp=100.0))
        await stage.wait(3.1)
        assert "lost" in conditions(robot)
        audience._set(False)
        await stage.wait(1.0)
        assert "lost" in conditions(robot)

    play(script, monkeypatch)


def test_a_moving_robot_with_few_poses_moves_between_them(monkeypatch):
    async def script(stage):
        robot = stage.robot
        robot.remove_modules()
        stage.link.open()
        robot.set_odometry_topic(stage.link, "/odom", type=ODOMETRY)
        audience._set(False)
        for number in range(3):
            stage.publish("/odom", odometry(2.0 * number, stamp=100.0 + 5 * number))
            await stage.wait(5.0)
            assert robot.pose_source.period == 5.0

    play(script, monkeypatch)


def test_paused_frames_are_no_problem_and_missing_ones_are_when_somebody_looks(
    monkeypatch,
):
    async def script(stage):
        robot = stage.robot
        robot.remove_modules()
        stage.link.open()
        robot.set_odometry_topic(stage.link, "/odom", type=ODOMETRY)
        robot.set_tf(stage.link)
        for number in range(50):
            stamp = 100.0 + number / 10
            stage.publish("/tf", transforms(transform("map", "odom", 1.0, stamp=stamp)))
            stage.publish("/odom", odometry(0.0, stamp=stamp))
            await stage.wait(0.1)
        audience._set(False)
        for number in range(6):
            stage.publish("/odom", odometry(0.0, stamp=105.0 + 5 * number))
            await stage.wait(5.0)
        assert robot.problems == {}
        assert robot.position.x == 1.0  # by the last frames
        audience._set(True)
        for number in range(20):
            stage.publish("/odom", odometry(0.0, stamp=135.0 + number / 10))
            await stage.wait(0.1)
        assert robot.problems == {}
        for number in range(20, 40):
            stage.publish("/odom", odometry(0.0, stamp=135.0 + number / 10))
            await stage.wait(0.1)
        assert "no new transform 'map' -> 'odom'" in robot.problems["tf"]

    play(script, monkeypatch)


def test_a_trail_stays_whole_while_nobody_looks(monkeypatch):
    async def script(stage):
        robot = stage.robot
        robot.remove_modules()
        trail = robot.add_module("Trail")
        stage.link.open()
        robot.set_odometry_topic(stage.link, "/odom", type=ODOMETRY)
        audience._set(False)
        for number in range(5):
            stage.publish("/odom", odometry(3.0 * number, stamp=100.0 + 2 * number))
            await stage.wait(2.0)
        assert len(trail.points) == 1
        audience._set(True)
        for number in range(2):
            place = 12.0 + 1.5 * number
            stage.publish("/odom", odometry(place, stamp=110.0 + number))
            await stage.wait(1.0)
        assert len(trail.points) == 2

    play(script, monkeypatch)


def test_few_poses_come_also_before_the_type_is_known():
    async def scenario():
        bridge = Bridge("ws://robot:9090")
        robot = Robot("Bob")
        robot.set_odometry_topic(bridge, "/odom")
        audience._set(False)
        robot.feed._listen_untyped()
        assert throttle(bridge) == RARELY
        robot.destroy()

    asyncio.run(scenario())


def test_who_begins_to_look_sees_the_trail_until_then(monkeypatch):
    async def script(stage):
        robot = stage.robot
        robot.remove_modules()
        trail = robot.add_module("Trail", length=4.0)
        stage.link.open()
        robot.set_odometry_topic(stage.link, "/odom", type=ODOMETRY)
        audience._set(False)
        for number in range(80):
            stage.publish("/odom", odometry(0.1 * number, stamp=100.0 + 2 * number))
            await stage.wait(2.0)
        audience._set(True)
        (line,), (points,) = trail.svg.children, trail.points
        assert len(line.get("points").split()) == len(points)

    play(script, monkeypatch)


def test_who_begins_to_look_gets_the_state_of_now(monkeypatch):
    async def script(stage):
        robot = stage.robot
        robot.remove_modules()
        stage.link.open()
        robot.set_odometry_topic(stage.link, "/odom", type=ODOMETRY)
        audience._set(False)
        stage.publish("/odom", odometry(0.0, stamp=100.0))
        await stage.wait(LOST_AFTER + 0.1)
        assert robot.state.name == "lost"
        assert robot.svg.get("data-state") == "watched"  # no page is open yet
        audience._set(True)
        assert robot.svg.get("data-state") == "lost"
        audience._set(False)
        stage.publish("/odom", odometry(0.0, stamp=113.5))
        await stage.wait(2.1)
        assert robot.svg.get("data-state") == "watched"

    play(script, monkeypatch)


def test_the_more_robots_there_are_the_fewer_poses_of_each_are_requested():
    bridge = Bridge("ws://robot:9090")
    robots = [Robot(str(number)) for number in range(21)]
    fixed = Robot("fixed")
    fixed.set_odometry_topic(bridge, "/fixed", 200, type="nav_msgs/Odometry")
    requested = []
    for robot in robots:
        robot.set_odometry_topic(bridge, f"/r{robot.name}", type="nav_msgs/Odometry")
        requested.append({each.feed.period for each in robots if each.feed})
    assert requested == [{0.016}] * 6 + [{0.033}] * 7 + [{0.05}] * 7 + [{0.1}]
    robots[0].unsubscribe_odometry_topic()
    assert {each.feed.period for each in robots if each.feed} == {0.05}
    assert fixed.feed.period == 0.2
    far = Robot("far")
    agent = Bridge("zenoh://router.example/agent")
    far.set_odometry_topic(agent, "/odom", type="nav_msgs/Odometry")
    assert far.feed.period == 0.1
    for robot in (*robots, fixed, far):
        robot.destroy()
