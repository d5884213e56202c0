"""Robots and topics that appear later."""

from webmap.discovery import discover
from webmap.discovery.newcomers import Newcomers

ODOM = {"/a/odom": "nav_msgs/Odometry"}
BOTH = ODOM | {"/a/cmd_vel": "geometry_msgs/Twist"}


def looks(newcomers, *topics):
    """The names of what each look tells, with the roles that are new."""
    return [
        [(news.robot.name, *news.roles) for news in newcomers.look(discover(each))]
        for each in topics
    ]


def test_a_robot_is_told_once_when_two_looks_say_the_same():
    assert looks(Newcomers(), BOTH, BOTH, BOTH) == [[], [("a",)], []]


def test_a_robot_whose_topics_still_come_is_waited_for():
    newcomers = Newcomers()
    assert looks(newcomers, ODOM, BOTH) == [[], []]
    (news,) = newcomers.look(discover(BOTH))
    assert news.robot.topic("velocity") == "/a/cmd_vel"


def test_a_known_robot_is_never_told_even_when_it_was_away():
    newcomers = Newcomers(discover(BOTH).robots)
    assert looks(newcomers, BOTH, {}, BOTH, BOTH) == [[], [], [], []]


def test_what_a_known_robot_has_more_is_told_once():
    newcomers = Newcomers(discover(ODOM).robots)
    assert looks(newcomers, BOTH, BOTH, BOTH) == [[], [("a", "velocity")], []]


def test_a_topic_that_goes_and_comes_back_is_no_news():
    newcomers = Newcomers(discover(BOTH).robots)
    assert looks(newcomers, ODOM, ODOM, BOTH, BOTH) == [[], [], [], []]
