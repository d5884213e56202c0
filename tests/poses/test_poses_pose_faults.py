"""A failure while poses and frames arrive leaves no wrong state."""

import math

import pytest
from pose_script import ODOMETRY, header, odometry, play, transform, transforms

from webmap import RobotLayer, layer
from webmap.core.registry import robot_modules


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
