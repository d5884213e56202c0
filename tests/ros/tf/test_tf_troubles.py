"""Problems with frames and poses are reported, and cleared when they end."""

import math
import time

import pytest
from test_tf_robot import Link, odometry, transform

from webmap import Robot
from webmap.base.geometry import Quaternion, Vector3
from webmap.poses.frames import FrameFaults, ProblemDelay, delayed_problem
from webmap.poses.pipeline import Jumps
from webmap.poses.placing import PoseReading
from webmap.ros.tf import Buffer


class Clock:
    """A clock that a test sets."""

    def __init__(self):
        self.now = 1000.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    clock = Clock()
    monkeypatch.setattr(time, "monotonic", clock)
    return clock


@pytest.fixture
def link():
    return Link()


@pytest.fixture
def bob(link, clock):
    robot = Robot("Bob")
    robot.set_odometry_topic(link, "/odom", type="nav_msgs/Odometry")
    robot.set_tf(link)
    yield robot
    robot.destroy()


@pytest.fixture
def ready(link, bob, clock):
    """A robot whose pose comes from its frames."""

    def go(seconds, *transforms, x=0.0):
        clock.now = 990.0 + seconds
        chain = [
            transform("map", "odom", 1.0, stamp=seconds),
            transform("odom", "base_link", x, stamp=seconds),
        ]
        link.publish("/tf", {"transforms": [*chain, *transforms]})
        link.publish("/odom", odometry(x, stamp=seconds))

    go(10.0)
    assert bob.problems == {}
    return go


def test_a_lasting_missing_map_frame_is_reported_and_then_cleared(link, bob, clock):
    link.publish("/odom", odometry(1.0))
    assert bob.problems == {}, "frames arrive one after another"
    clock.now += 2.5
    link.publish("/odom", odometry(1.0, stamp=12.5))
    assert bob.problems == {}, "some frames arrive some time after the link opens"
    clock.now += 1.0
    link.publish("/odom", odometry(1.0, stamp=13.5))
    assert "there is no frame 'map'; there are: none" in bob.problems["tf"]
    link.publish("/tf", {"transforms": [transform("map", "odom", 1.0, stamp=13.5)]})
    link.publish("/odom", odometry(1.0, stamp=13.6))
    assert bob.problems == {}


def test_unconnected_frame_trees_are_reported_with_their_roots(link, bob, clock):
    chain = [transform("map", "other", 1.0), transform("odom", "base_link", 1.0)]
    for _ in range(3):
        link.publish("/tf", {"transforms": chain})
        link.publish("/odom", odometry(1.0))
        clock.now += 1.5
    assert "'odom' is in the tree of 'odom', 'map' in the" in bob.problems["tf"]


def test_a_frame_loop_is_reported_completely_and_other_frames_stay_valid(ready, bob):
    ready(10.1, transform("base_link", "map", 0.0, stamp=10.1))
    problem = bob.problems["frames"]
    assert "would close a loop" in problem
    assert "'map' -> 'odom' -> 'base_link' -> 'map'" in problem
    assert bob.position.x == pytest.approx(1.0)
    ready(15.0)
    assert "frames" in bob.problems
    ready(21.0)
    assert bob.problems == {}


def test_a_backward_time_jump_is_reported_and_the_pose_still_updates(ready, bob):
    ready(50.0)
    ready(20.0, x=0.4)
    assert "time jumped back by 30.000 s" in bob.problems["frames"]
    assert bob.position.x == pytest.approx(1.4)


def test_two_publishers_of_one_frame_are_reported(ready, bob):
    ready(10.1, transform("world", "base_link", 5.0, stamp=10.1))
    assert "two nodes publish it" in bob.problems["frames"]


def test_a_frame_fault_of_another_robot_is_not_reported_for_this_robot(
    ready, bob, caplog
):
    ready(10.1, transform("r2/odom", "r2/base_link", math.nan, stamp=10.1))
    assert bob.problems == {}
    assert "test: a transform was left out: 'r2/odom' -> 'r2/base_link'" in caplog.text


def test_silent_localisation_is_reported_and_then_cleared(link, ready, bob, clock):
    for seconds in (11.0, 12.5):
        clock.now = 990.0 + seconds
        link.publish("/odom", odometry(0.0, stamp=seconds))
    assert bob.problems == {}, "the transform is not late yet"
    for seconds in (13.0, 14.5):
        clock.now = 990.0 + seconds
        link.publish("/odom", odometry(0.0, stamp=seconds))
    problem = bob.problems["tf"]
    assert "no new transform 'map' -> 'odom' for more than 2 s" in problem
    ready(15.0)
    assert bob.problems == {}


def test_stopped_frames_of_a_robot_without_odometry_are_reported(link, clock):
    robot = Robot("Bob")
    robot.set_tf(link)
    chain = [transform("map", "odom", 1.0), transform("odom", "base_link", 1.0)]
    link.publish("/tf", {"transforms": chain})
    assert robot.valid
    for _ in range(4):
        clock.now += 1.1
        link.publish("/tf", {"transforms": [transform("map", "other", 1.0)]})
    assert "'map' -> 'base_link'" in robot.problems["tf"]
    later = [transform("map", "odom", 1.0, stamp=15.0)]
    later.append(transform("odom", "base_link", 1.0, stamp=15.0))
    link.publish("/tf", {"transforms": later})
    assert robot.problems == {}
    robot.destroy()


def test_a_pose_jump_is_reported_for_some_seconds(ready, bob):
    ready(10.1, x=0.1)
    ready(10.2, x=12.0)
    assert "the pose jumped by 11.9 m within 0.10 s" in bob.problems["jumps"]
    assert bob.position.x == pytest.approx(13.0)
    for seconds in (15.0, 21.0):
        ready(seconds, x=12.0)
    assert bob.problems == {}


# The rules without a robot.


def reading(x, stamp, frame="map"):
    return PoseReading(Vector3(x), Quaternion(), None, frame, stamp)


def test_repeated_pose_jumps_are_reported_as_two_publishers():
    jumps = Jumps()
    for step in range(5):
        jumps.look(reading(20.0 * (step % 2), 10.0 + step / 10), step / 10)
    assert "two nodes seem to publish different poses" in jumps.problem


@pytest.mark.parametrize(
    "poses",
    [
        [(0.0, 10.0), (0.4, 10.01)],  # a correction
        [(0.0, 10.0), (20.0, 14.5)],  # the robot drove
        [(0.0, 10.0), (50.0, 30.0)],  # no pose for a long time
        [(0.0, 0.0), (50.0, 0.0)],  # no stamps
        [(0.0, 10.0), (50.0, 9.0)],  # the stamp goes back
    ],
)
def test_a_plausible_or_untimed_movement_is_no_pose_jump(poses):
    jumps = Jumps()
    for x, stamp in poses:
        jumps.look(reading(x, stamp), stamp)
    assert jumps.problem is None


@pytest.mark.parametrize(
    ("stamp", "passed", "leapt"),
    [
        (13600.0, 0.1, "+3600.0"),
        (6400.0, 0.1, "-3600.0"),
        (10020.0, 30.0, None),  # no pose for a while
        (10009.0, 0.1, None),  # a stalled link loses messages
        (9999.5, 0.1, None),  # messages arrived out of order
    ],
)
def test_a_jump_of_the_pose_clock_is_reported_with_its_size(stamp, passed, leapt):
    jumps = Jumps()
    jumps.look(reading(0.0, 10000.0), 5.0)
    jumps.look(reading(0.0, stamp), 5.0 + passed)
    if leapt is None:
        assert jumps.problem is None
    else:
        assert f"the clock of its poses jumped by {leapt} s" in jumps.problem


def test_a_time_jump_of_a_robot_without_odometry_is_reported_once(link, clock):
    robot = Robot("Bob")
    robot.set_tf(link)
    for stamp in (5000.0, 1400.0):
        clock.now += 1.0
        chain = [transform("map", "base_link", 1.0, stamp=stamp)]
        link.publish("/tf", {"transforms": chain})
    (problem,) = robot.problems.values()
    assert "time jumped back by 3600.000 s" in problem
    robot.destroy()


@pytest.mark.parametrize(
    ("ahead", "difference"), [(3600, "3600.0 s later"), (-3600, "3600.0 s earlier")]
)
@pytest.mark.parametrize("quiet", [False, True])
def test_a_clock_difference_of_odometry_and_frames_is_reported_with_its_size(
    link, bob, clock, ahead, difference, quiet
):
    bob.set_tf(link, quiet=quiet)
    for seconds in (0.0, 1.5, 3.0, 4.5):
        clock.now = 1000.0 + seconds
        stamp = 9000.0 + seconds
        chain = [transform("map", "odom", 1.0, stamp=stamp)]
        link.publish("/tf", {"transforms": chain})
        link.publish("/odom", odometry(0.4, stamp=stamp + ahead))
    (problem,) = bob.problems.values()
    assert f"its odometry is stamped {difference} than the newest of 'map'" in problem
    assert bob.position.x == pytest.approx(1.4)
    link.publish("/odom", odometry(0.4, stamp=9004.6))
    assert "tf" not in bob.problems


def test_a_change_of_the_frame_is_no_pose_jump():
    jumps = Jumps()
    jumps.look(reading(0.0, 10.0, "odom"), 0.0)
    jumps.look(reading(50.0, 10.1, "map"), 0.1)
    assert jumps.problem is None


def test_the_number_of_frames_with_stored_faults_is_limited():
    faults = FrameFaults(Buffer())
    noted = [faults.note("map", f"f{n}", "wrong", 0.0) for n in range(60)]
    assert sum(noted) == 50
    assert not faults.note("map", "f0", "wrong again", 1.0)


def test_a_fault_of_a_frame_with_the_robots_prefix_concerns_the_robot():
    faults = FrameFaults(Buffer())
    faults.note("r1/odom", "r1/laser", "it is none", 0.0)
    assert faults.of("r1/base_link", 1.0) == "it is none"
    assert faults.of("r2/base_link", 1.0) is None
    assert faults.of("r1/base_link", 11.0) is None
    assert not faults.any


def test_only_lasting_problems_are_reported(clock):
    waits = ProblemDelay()
    for _ in range(10):
        assert delayed_problem(waits, "late") == ""
        clock.now += 0.6
        assert delayed_problem(waits, "") == ""
    assert delayed_problem(waits, "late") == ""
    clock.now += 1.0
    assert delayed_problem(waits, "late") == "late"
