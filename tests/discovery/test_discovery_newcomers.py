"""Robots that appear later."""

from webmap.discovery import discover
from webmap.discovery.newcomers import Newcomers

ODOM = {"/a/odom": "nav_msgs/Odometry"}
BOTH = ODOM | {"/a/cmd_vel": "geometry_msgs/Twist"}


def looks(newcomers, *topics):
    return [[r.name for r in newcomers.look(discover(each))] for each in topics]


def test_a_robot_is_told_once_when_two_looks_say_the_same():
    assert looks(Newcomers(), BOTH, BOTH, BOTH) == [[], ["a"], []]


def test_a_robot_whose_topics_still_come_is_waited_for():
    newcomers = Newcomers()
    assert looks(newcomers, ODOM, BOTH) == [[], []]
    (robot,) = newcomers.look(discover(BOTH))
    assert robot.topic("velocity") == "/a/cmd_vel"


def test_a_known_robot_is_never_told_even_when_it_was_away():
    assert looks(Newcomers(["/a"]), BOTH, {}, BOTH, BOTH) == [[], [], [], []]
