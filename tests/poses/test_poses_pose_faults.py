"""A failure while poses and frames arrive leaves no wrong state."""

import math

import pytest
from pose_script import ODOMETRY, header, odometry, play, transform, transforms

from webmap import RobotLayer, layer
from webmap.core.registry import robot_modules
from webmap.poses.frames import frame_faults


def tilted(parent, child, roll, stamp):
    """Return a frame that is turned about the x axis of its parent."""
    found = transform(parent, child, 0.2, stamp=stamp)
    half = roll / 2
    turn = {"x": math.sin(half), "y": 0.0, "z": 0.0, "w": math.cos(half)}
    found["transform"]["rotation"] = turn
    return found


@pytest.fixture
def fussy(monkeypatch):
    """A layer whose drawing fails while the test sets ``fails``."""
    robot_modules.names()  # a module that is first imported later would be lost
    monkeypatch.setattr(robot_modules, "_registered", dict(robot_modules._registered))

    @layer("geometry_msgs/PointStamped")
    class Fussy(RobotLayer):
        frame = "robot"
        fails = False

        def draw(self, found, at):
            if Fussy.fails:
                raise ValueError("no such tilt")

    return Fussy


def test_a_failed_redraw_keeps_the_old_drawing_and_its_problem_is_cleared(
    fussy, monkeypatch
):
    async def script(stage):
        robot = stage.robot
        stage.link.open()
        robot.set_odometry_topic(stage.link, "/odom", type=ODOMETRY)
        robot.set_tf(stage.link)
        drawn = robot.add_module("Fussy", stage.link, "/point")

        async def go(count, roll=None):
            for _ in range(count):
                now = stage.loop.now
                moved = [
                    transform("map", "odom", 50.0, stamp=now),
                    transform("odom", "base_link", 1.0, stamp=now),
                ]
                if roll is not None:
                    moved.append(tilted("base_link", "camera", roll, now))
                stage.publish("/tf", transforms(*moved))
                stage.publish("/odom", odometry(1.0, stamp=now))
                await stage.wait(0.1)

        def point(stamp):
            place = {"x": 1.0, "y": 0.0, "z": 0.0}
            stage.publish("/point", {"header": header("camera", stamp), "point": place})

        def failed():
            return any("no such tilt" in words for words in robot.problems.values())

        await go(60)
        point(stage.loop.now + 2.0)  # newer than the frames, so it is drawn again
        await go(14, roll=0.5)
        assert drawn.placed._on_robot
        fussy.fails = True
        await go(25, roll=1.0)
        assert failed()
        assert drawn.placed._on_robot, "it stays where it was drawn"
        fussy.fails = False
        point(stage.loop.now + 0.15)
        assert not failed()
        await go(3, roll=1.0)
        point(stage.loop.now + 0.15)
        fussy.fails = True
        await go(3, roll=0.5)
        assert failed()
        fussy.fails = False
        await go(2, roll=0.5)
        point(stage.loop.now - 0.05)
        assert robot.problems == {}

    play(script, monkeypatch)


def test_no_jump_is_reported_after_a_listener_removed_the_pose_source(monkeypatch):
    class Ends:
        def __init__(self, robot):
            self.robot = robot

        def on_odometry_update(self):
            if self.robot.position.x > 50:
                self.robot.unsubscribe_odometry_topic()

    async def script(stage):
        stage.link.open()
        stage.robot.add_module(Ends)
        stage.robot.set_odometry_topic(stage.link, "/odom", type=ODOMETRY)
        stage.publish("/odom", odometry(0.0, stamp=100.0))
        await stage.wait(0.1)
        stage.publish("/odom", odometry(100.0, stamp=100.1))
        await stage.wait(60)
        assert stage.robot.feed is None
        assert stage.robot.problems == {}

    play(script, monkeypatch)


def zeros(parent, child):
    """Return a transform with a quaternion of zeros, as of a message nobody filled."""
    found = transform(parent, child, 0.0, stamp=0.0)
    found["transform"]["rotation"] = dict.fromkeys("xyzw", 0.0)
    return found


@pytest.mark.parametrize("by", ["a valid transform", "a new connection"])
def test_a_fault_of_static_frames_is_shown_until_its_correction(monkeypatch, by):
    async def script(stage):
        robot, link = stage.robot, stage.link
        link.open()
        robot.set_tf(link)
        await stage.wait(0.5)
        wrong = transform("base_link", "laser", math.nan, stamp=0.0)
        stage.publish("/tf_static", transforms(wrong))
        await stage.wait(30)  # it is sent once
        text = robot.problems["frames"]
        assert "'base_link' -> 'laser': its position or rotation is not finite" in text
        assert frame_faults(link) == [text]
        if by == "a new connection":
            link.close()
            link.open()
        else:
            right = transform("base_link", "laser", 0.2, stamp=0.0)
            stage.publish("/tf_static", transforms(right))
        await stage.wait(11)
        assert "frames" not in robot.problems
        assert frame_faults(link) == []

    play(script, monkeypatch)


def test_a_fault_of_moving_frames_ends_though_nothing_comes_any_more(monkeypatch):
    async def script(stage):
        stage.link.open()
        stage.robot.set_tf(stage.link)
        await stage.wait(0.5)
        loop = [("map", "base_link"), ("base_link", "map")]
        moves = [transform(*names, 0.0, stamp=1.0) for names in loop]
        stage.publish("/tf", transforms(*moves, zeros("arm", "hand")))
        await stage.wait(5)
        problem = stage.robot.problems["frames"]
        assert "would close a loop: 'map' -> 'base_link' -> 'map'" in problem
        _, of_no_robot = frame_faults(stage.link)
        assert "'arm' -> 'hand': the rotation has a norm of 0 (it is all" in of_no_robot
        await stage.wait(16)
        assert "frames" not in stage.robot.problems
        assert frame_faults(stage.link) == []

    play(script, monkeypatch)
