"""A reading, frames and the time become a pose and its problems."""

import math
from types import SimpleNamespace

import pytest

from webmap import Robot
from webmap.base.geometry import Pose, Quaternion, Vector3
from webmap.poses.frames import FrameFaults
from webmap.poses.pipeline import PosePipeline
from webmap.poses.placing import Placing, PoseReading
from webmap.ros.tf import Buffer, NotKnownThen, Transform


@pytest.fixture
def frames():
    buffer = Buffer()
    return SimpleNamespace(
        buffer=buffer, namespace="", faults=FrameFaults(buffer), complete_from=0.0
    )


@pytest.fixture
def pipeline(frames):
    """A robot with a pose topic; frames place its poses on the map."""
    pipeline = PosePipeline()
    pipeline.placing = Placing(frames.buffer, frames.namespace, "map", "base_link")
    pipeline.restart(0.1)
    return pipeline


def reading(x, stamp, frame="odom"):
    return PoseReading(Vector3(x), Quaternion(), None, frame, stamp)


def at(x):
    return Transform(Vector3(x))


def test_a_pose_is_transformed_into_the_map_frame_without_problems(pipeline, frames):
    frames.buffer.add("map", "odom", at(10.0), 5.0)
    step = pipeline.step(reading(1.0, 5.0), frames, 100.0)
    assert step.pose == reading(11.0, 5.0, "map")
    assert (dict(step.problems), step.look_again) == ({}, None)


def test_an_alignment_moves_a_pose_to_the_common_map(pipeline, frames):
    frames.buffer.add("map", "odom", at(10.0), 5.0)
    pipeline.alignment = Pose(0.0, 3.0, math.pi / 2)
    place = pipeline.step(reading(1.0, 5.0), frames, 100.0).pose.position
    assert (place.x, place.y) == pytest.approx((0.0, 14.0))
    assert pipeline.newest == reading(11.0, 5.0, "map")


def test_problems_stay_the_same_object_until_a_problem_changes(pipeline, frames):
    steps = [
        pipeline.step(reading(0.0, 5.0 + n / 10), frames, 100.0 + n / 10)
        for n in range(12)
    ]
    first, later = steps[0].problems, steps[-1].problems
    assert first == {}
    assert all(step.problems is first for step in steps[:10])
    assert "there is no frame 'map'" in later["tf"].text
    assert pipeline.step(reading(0.0, 6.2), frames, 101.2).problems is later


def test_a_new_problem_is_checked_again_before_the_report(pipeline, frames):
    frames.complete_from = 103.0
    assert pipeline.step(reading(0.0, 5.0), frames, 100.0).look_again == 103.0
    step = pipeline.step(None, frames, 103.0)
    assert step.pose is None
    assert step.look_again is None
    assert step.problems.keys() == {"tf"}


def test_without_a_topic_the_pose_comes_from_the_base_frame(pipeline, frames):
    pipeline.restart(None)
    frames.buffer.add("map", "base_link", at(3.0), 5.0)
    assert pipeline.step(None, frames, 100.0).pose == reading(3.0, 5.0, "map")
    assert pipeline.step(None, frames, 100.1).pose is None, (
        "the same reading is no new pose"
    )


def test_a_restart_of_the_pipeline_clears_the_pose_history(pipeline):
    pipeline.placing = None
    for n in range(3):
        pipeline.step(reading(n, 5.0 + n / 10), None, 100.0 + n / 10)
    assert pipeline.at(5.15).translation.x == pytest.approx(1.5)
    pipeline.restart(0.1)
    assert pipeline.newest is None
    with pytest.raises(NotKnownThen):
        pipeline.at(5.15)


def test_the_problems_of_a_robot_are_set_only_when_they_change(monkeypatch):
    class Link:
        url = name = "test"
        state, lag = "open", 0.0

        def subscribe(self, topic, callback, type=None, **options):
            return SimpleNamespace(remove=lambda: None)

    robot, calls = Robot("Bob"), []
    robot.set_odometry_topic(Link(), "/odom", type="geometry_msgs/PoseStamped")
    monkeypatch.setattr(robot, "set_problem", lambda about, _: calls.append(about))
    monkeypatch.setattr(robot, "clear_problem", lambda about: calls.append(about))
    for n in range(5):
        robot.pose_source.feed._listener(reading(0.0, 5.0 + n / 10))
    assert calls == []
    for n in range(5, 10):
        robot.pose_source.feed._listener(reading(90.0, 5.0 + n / 10))
    assert calls == ["jumps"]
    robot.destroy()
