"""Robots, topics and frames that appear later."""

from itertools import pairwise

import pytest

from webmap.discovery import discover
from webmap.discovery.newcomers import Newcomers
from webmap.discovery.tf_robots import Trees

ODOM = {"/a/odom": "nav_msgs/Odometry"}
BOTH = ODOM | {"/a/cmd_vel": "geometry_msgs/Twist"}


def looks(newcomers, *topics):
    """The robots that each look reports: their names and new roles."""
    return [
        [(news.robot.name, *news.roles) for news in newcomers.look(discover(each))]
        for each in topics
    ]


def test_a_new_robot_is_reported_once_after_two_equal_looks():
    assert looks(Newcomers(), BOTH, BOTH, BOTH) == [[], [("a",)], []]


def test_a_new_robot_is_not_reported_while_its_topics_change():
    newcomers = Newcomers()
    assert looks(newcomers, ODOM, BOTH) == [[], []]
    (news,) = newcomers.look(discover(BOTH))
    assert news.robot.topic("velocity") == "/a/cmd_vel"


def test_a_known_robot_that_was_away_is_not_reported():
    newcomers = Newcomers(discover(BOTH).robots)
    assert looks(newcomers, BOTH, {}, BOTH, BOTH) == [[], [], [], []]


def test_a_new_topic_of_a_known_robot_is_reported_once():
    newcomers = Newcomers(discover(ODOM).robots)
    assert looks(newcomers, BOTH, BOTH, BOTH) == [[], [("a", "velocity")], []]


def test_a_topic_that_disappears_and_returns_is_not_reported():
    newcomers = Newcomers(discover(BOTH).robots)
    assert looks(newcomers, ODOM, ODOM, BOTH, BOTH) == [[], [], [], []]


TF = ODOM | {"/a/tf": "tf2_msgs/TFMessage"}


def with_frames(*chain):
    """A robot with a chain of frames, the root first."""
    trees = Trees()
    for parent, child in pairwise(chain):
        trees.take("/a", parent, child)
    return discover(TF, trees=trees)


@pytest.mark.parametrize(
    ("first", "then", "moved"),
    [
        (("odom", "base_link"), ("map", "odom", "base_link"), True),
        (("map", "odom", "base_link"), ("world", "map", "odom", "base_link"), False),
        (("a/map", "odom", "base_link"), ("world", "a/map", "odom", "base_link"), True),
        ((), ("odom", "base_link"), True),
        (("map", "odom", "base_link"), ("odom", "base_link"), False),
        (("map", "odom", "base_link"), (), False),
        (("world", "odom", "base_link"), ("world", "map", "odom", "base_link"), False),
        (("odom", "base_link"), ("map", "base_link"), False),
    ],
)
def test_new_frames_are_reported_once_if_they_give_a_higher_map_frame(
    first, then, moved
):
    newcomers = Newcomers(with_frames(*first).robots)
    later = with_frames(*then)
    received = [[news.moved for news in newcomers.look(later)] for _ in range(3)]
    assert received == [[], [True] if moved else [], []]


def test_a_report_of_new_topics_keeps_the_known_frames_of_the_robot():
    newcomers = Newcomers(with_frames("world", "odom", "base_link").robots)
    more = discover(TF | BOTH)
    newcomers.look(more)
    (news,) = newcomers.look(more)
    assert (news.robot.map_frame, news.moved) == ("world", False)
