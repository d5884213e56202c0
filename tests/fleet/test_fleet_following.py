"""Robots whose frames, places and topics appear while the console runs."""

import asyncio
from itertools import pairwise

import pytest

from webmap import Bridge
from webmap.console import Console, make_robot
from webmap.discovery import FoundRobot, Guess, discover
from webmap.discovery.frames import frame_collector
from webmap.discovery.newcomers import Newcomers
from webmap.discovery.tf_robots import Trees
from webmap.fleet.overrides import Overrides, parse_setting
from webmap.fleet.periodic_search import LayerSearch
from webmap.fleet.robot_options import Candidate
from webmap.fleet.view_robots import ViewRobot, ViewRobots

TF = {"/tf": "tf2_msgs/TFMessage"}
ODOM = {"/bob/odom": "nav_msgs/Odometry"}
DRIVEN = {"/bob/cmd_vel": "geometry_msgs/Twist"}
GOALS = {
    "/bob/goal_pose": "geometry_msgs/PoseStamped",
    "/bob/initialpose": "geometry_msgs/PoseWithCovarianceStamped",
}
AT_FIRST = "bob/odom bob/base_link"
LATER = f"bob/map {AT_FIRST}"


def candidate(bridge, **topics):
    guesses = {role: (Guess(topic, "", ""),) for role, topic in topics.items()}
    return Candidate(bridge, FoundRobot("Al", "", guesses))


def trees(chain):
    found = Trees()
    for parent, child in pairwise(chain.split()):
        found.take("", parent, child)
    return found


class Watched:
    """A console that looks repeatedly at the topics and frames of a test."""

    def __init__(self, bridge, *settings, given=()):
        self.bridge = bridge
        overrides = Overrides([parse_setting(text) for text in settings])
        self.late = ViewRobots(Console(), overrides, given=given)
        self.newcomers = Newcomers()

    def look(self, topics, chain=""):
        """Look until discovery reports the changes, and once more."""
        for _ in range(3):
            findings = discover(topics, "host", trees(chain))
            for news in self.newcomers.look(findings):
                self.late.show_news(news, self.bridge)

    @property
    def robot(self):
        (robot,) = self.late.robots
        return robot


@pytest.fixture
def bridge():
    return Bridge("ws://bob:9090")


@pytest.fixture
def watched(bridge):
    made = Watched(bridge)
    yield made
    for robot in made.late.robots:
        robot.destroy()


def test_a_robot_with_only_frames_is_drawn_in_the_map_frame_when_the_frame_appears(
    watched, capsys
):
    watched.look(TF, "odom base_link")
    assert watched.robot.tf["map_frame"] == "odom"
    capsys.readouterr()
    watched.look(TF, "map odom base_link")
    assert watched.robot.tf["map_frame"] == "map"
    printed = capsys.readouterr().err.splitlines()
    assert printed == ["host now is drawn by base_link in map"]


def test_goals_use_a_map_frame_that_appears_later(watched, capsys):
    watched.look(TF | ODOM | GOALS, AT_FIRST)
    assert watched.robot.motion.spec().goal_frame == "map"
    capsys.readouterr()
    watched.look(TF | ODOM | GOALS, LATER)
    assert watched.robot.tf["map_frame"] == "bob/map"
    assert watched.robot.motion.spec().goal_frame == "bob/map"
    assert capsys.readouterr().err.splitlines() == [
        "bob now is drawn by bob/base_link in bob/map and takes goals and its initial "
        "pose in the frame bob/map"
    ]


def test_the_initial_pose_uses_a_map_frame_that_appears_later(watched):
    place = {name: type for name, type in GOALS.items() if "initial" in name}
    watched.look(TF | ODOM | place, AT_FIRST)
    watched.look(TF | ODOM | place, LATER)
    assert watched.robot.motion.spec().goal_frame == "bob/map"


def test_goal_topics_that_appear_without_frames_use_the_known_map_frame(watched):
    watched.look(TF | ODOM, LATER)
    watched.look(TF | ODOM | GOALS)
    assert watched.robot.motion.spec().goal_frame == "bob/map"


@pytest.mark.parametrize("later", ["", AT_FIRST, "bob/map bob/base_link"])
def test_a_robot_keeps_its_map_frame_when_the_frame_disappears(watched, later, capsys):
    watched.look(TF | ODOM, LATER)
    capsys.readouterr()
    watched.look(TF | ODOM, later)
    assert watched.robot.tf["map_frame"] == "bob/map"
    assert capsys.readouterr().err == ""


def test_frames_that_the_user_set_do_not_change(bridge, capsys):
    watched = Watched(bridge, "bob.tf=/tf")
    watched.look(TF | ODOM | GOALS, AT_FIRST)
    capsys.readouterr()
    watched.look(TF | ODOM | GOALS, LATER)
    assert watched.robot.tf["map_frame"] == "map"
    assert watched.robot.motion.spec().goal_frame == "map"
    assert capsys.readouterr().err == ""
    watched.robot.destroy()


def test_layers_in_the_old_map_frame_move_to_the_new_map_frame(watched, bridge):
    watched.look(TF | ODOM, AT_FIRST)
    robot = watched.robot
    old = {"map_frame": "map", "palette": "costmap"}
    robot.add_module("OnMaps", "OccupancyGrid", bridge, "/bob/costmap", **old)
    robot.add_module("OnMaps", "OccupancyGrid", bridge, "/bob/as_it_comes")
    watched.look(TF | ODOM, LATER)
    made = {
        args[2]: options for name, args, options in robot.module_arguments() if args[2:]
    }
    assert made == {
        "/bob/costmap": {"map_frame": "bob/map", "palette": "costmap"},
        "/bob/as_it_comes": {},
    }


def test_a_robot_that_already_uses_the_frame_map_does_not_change_when_map_appears(
    watched, capsys
):
    watched.look(TF | ODOM, AT_FIRST)
    before = watched.robot.tf
    capsys.readouterr()
    watched.look(TF | ODOM, f"map {AT_FIRST}")
    assert watched.robot.tf == before
    assert capsys.readouterr().err == ""


POSE = {"/bob/robot_pose": "geometry_msgs/PoseStamped"}


def test_a_robot_without_a_pose_uses_a_pose_topic_that_appears_later(watched, capsys):
    watched.look(DRIVEN)
    assert watched.robot.feed is None
    watched.look(DRIVEN | POSE)
    assert watched.robot.feed.topic == "/bob/robot_pose"
    printed = capsys.readouterr().err.splitlines()[1:]
    assert printed == ["bob has new topics: pose /bob/robot_pose"]


def test_a_pose_topic_that_appears_later_does_not_replace_odometry(watched, capsys):
    watched.look(DRIVEN | ODOM)
    capsys.readouterr()
    watched.look(DRIVEN | ODOM | POSE)
    assert watched.robot.feed.topic == "/bob/odom"
    assert capsys.readouterr().err == ""


def test_a_pose_topic_that_appears_later_does_not_replace_frames(watched):
    watched.look(TF | DRIVEN, LATER)
    watched.look(TF | DRIVEN | POSE, LATER)
    assert watched.robot.feed is None


def test_a_robot_with_odometry_set_to_nothing_does_not_use_a_later_pose_topic(bridge):
    watched = Watched(bridge, "bob.odometry=")
    watched.look(DRIVEN)
    watched.look(DRIVEN | POSE)
    assert watched.robot.feed is None
    watched.robot.destroy()


@pytest.mark.parametrize(
    ("said", "shown"),
    [
        ({"odometry": "/bob/odom"}, []),
        ({"velocity": "/bob/cmd_vel"}, []),
        ({"odometry": "/al/odom"}, ["bob"]),
    ],
)
def test_a_robot_option_replaces_a_discovered_robot_with_the_same_topics(
    bridge, said, shown, capsys
):
    given = candidate(bridge, **said)
    watched = Watched(bridge, given=[given])
    watched.look(DRIVEN | ODOM)
    watched.look(DRIVEN | ODOM | POSE | TF, LATER)
    assert [robot.name for robot in watched.late.robots] == shown
    assert ("A robot appeared" in capsys.readouterr().err) == bool(shown)
    for robot in watched.late.robots:
        robot.destroy()


def test_a_robot_option_is_drawn_in_a_map_frame_that_appears_later(
    bridge, monkeypatch, capsys
):
    about = candidate(bridge, odometry="/bob/odom", goal="/bob/goal_pose")
    config = about.found.config(bridge.url)
    robot = make_robot(config, [bridge])
    given = [ViewRobot(*about, robot, config)]
    drawing = LayerSearch(bridge, ViewRobots(Console()), given=given)
    frames = frame_collector(bridge)
    received = []

    async def listen(topics):
        received.append(topics)
        return frames.trees

    monkeypatch.setattr(frames, "listen", listen)
    frames.trees = trees(AT_FIRST)
    asyncio.run(drawing.take(TF | ODOM))
    assert robot.tf["map_frame"] == "map"
    for chain in (LATER, AT_FIRST):
        frames.trees = trees(chain)
        asyncio.run(drawing.take(TF | ODOM))
        assert robot.tf["map_frame"] == "bob/map"
        assert robot.motion.spec().goal_frame == "bob/map"
    assert len(received) == 3, "the pose is also set when frames replace odometry"
    assert (
        capsys.readouterr().err.count("Al now is drawn by bob/base_link in bob/map")
        == 1
    )
    robot.destroy()
