"""Robots given on the command line also get the other topics of their namespaces."""

import asyncio

import pytest
from click.testing import CliRunner

import webmap
import webmap.console
from webmap import Bridge
from webmap.base.errors import ConfigError
from webmap.cli.view import view
from webmap.console import Console, make_robot
from webmap.discovery import FoundRobot, Guess, discover
from webmap.features.layers.on_maps import OnMaps
from webmap.fleet import search as found_fleet
from webmap.fleet.periodic_search import LayerSearch
from webmap.fleet.robot_options import (
    Candidate,
    drawable_topics,
    namespace_of,
    parse_robot,
    parse_robots,
    same_robot,
)
from webmap.fleet.search import FleetSearch, SearchResult
from webmap.fleet.view_robots import ViewRobot, ViewRobots

URL = "ws://bob:9090"
GRID = "nav_msgs/OccupancyGrid"
ONE = {
    "odom": "nav_msgs/Odometry",
    "ekf/odometry/filtered": "nav_msgs/Odometry",
    "cmd_vel": "geometry_msgs/Twist",
    "front/scan": "sensor_msgs/LaserScan",
    "rear/scan": "sensor_msgs/LaserScan",
    "local_costmap/costmap": GRID,
    "points": "sensor_msgs/PointCloud2",
    "plan": "nav_msgs/Path",
    "markers": "visualization_msgs/MarkerArray",
}
TOPICS = {f"/{name}/{topic}": type for name in "ab" for topic, type in ONE.items()}
TOPICS |= {"/map": GRID}
FRAMES = {"/tf": "tf2_msgs/TFMessage"}


@pytest.fixture
def bridge():
    return Bridge(URL)


def described(bridge, name="Bob", **topics):
    guesses = {role: (Guess(topic, "", ""),) for role, topic in topics.items()}
    return Candidate(bridge, FoundRobot(name, "", guesses))


def made(robot):
    return make_robot(robot.found.config(robot.bridge.url), [robot.bridge])


def drawn(bridge, topics, *given):
    """Draw the given robots of a bridge; return the console."""
    console = Console([made(about) for about in given])
    known = [
        ViewRobot(*about, robot, about.found.config(about.bridge.url))
        for about, robot in zip(given, console.given, strict=True)
    ]
    layers = LayerSearch(bridge, ViewRobots(console), given=known)
    asyncio.run(layers.take(topics))
    return console


def what_of(robot):
    made = []
    for module in robot.modules:
        if isinstance(module, OnMaps):
            made.append((module.module, module._arguments[0][1]))
        elif getattr(module, "topic", None):
            made.append((type(module).__name__, module.topic))
    return sorted(made)


def test_a_robot_option_gets_the_layers_of_its_namespace_but_only_its_given_scan(
    bridge,
):
    given = described(
        bridge, odometry="/a/odom", velocity="/a/cmd_vel", scan="/a/rear/scan"
    )
    console = drawn(bridge, TOPICS, given)
    (robot,) = console.given
    assert what_of(robot) == [
        ("LaserScanner", "/a/rear/scan"),
        ("Markers", "/a/markers"),
        ("OccupancyGrid", "/a/local_costmap/costmap"),
        ("Path", "/a/plan"),
        ("PointCloud", "/a/points"),
    ]
    assert [type(module).__name__ for module in robot.modules].count("Trail") == 1
    assert list(console.grids) == [(bridge, "/map")]
    assert robot.feed.topic == "/a/odom", "the given odometry is kept"
    robot.destroy()


@pytest.mark.parametrize(("said", "drawn_of"), [([], ["Bob"]), (["--only-given"], [])])
def test_only_given_draws_no_layers_besides_the_given_topics(
    monkeypatch, said, drawn_of
):
    asked = []

    def looking(bridge, shown, *, given, **options):
        asked.extend(each.robot.name for each in given)

    def open_console(bridges, given, **options):
        return Console([make_robot(config, bridges) for config in given])

    monkeypatch.setattr(webmap.console, "open_console", open_console)
    monkeypatch.setattr(webmap, "run", lambda **options: None)
    monkeypatch.setattr(found_fleet, "LayerSearch", looking)
    done = CliRunner().invoke(view, [URL, "--robot", "Bob:/a/odom", *said])
    assert (done.exit_code, asked) == (0, drawn_of)


def test_a_robot_option_with_odometry_is_drawn_in_the_map_frame(bridge):
    placed = described(bridge, odometry="/a/odom")
    nowhere = described(bridge, name="b", velocity="/b/cmd_vel")
    console = drawn(bridge, TOPICS | FRAMES, placed, nowhere)
    one, other = console.given
    assert (one.tf["map_frame"], one.tf["quiet"]) == ("map", True)
    assert other.tf is None, "a robot without odometry gets no frames"
    one.destroy()
    other.destroy()


def test_a_robot_option_unknown_to_discovery_gets_the_layers_of_its_namespace(bridge):
    topics = TOPICS | {"/c/where": "geometry_msgs/Pose", "/c/plan": "nav_msgs/Path"}
    given = described(bridge, odometry="/c/where")
    assert drawable_topics(given.found, topics, discover(topics)).found is None
    console = drawn(bridge, topics, given)
    assert what_of(console.given[0]) == [("Path", "/c/plan")]
    console.given[0].destroy()


def test_only_the_first_robot_option_in_a_namespace_gets_its_layers(bridge):
    first = described(bridge, name="Al", odometry="/a/odom")
    second = described(bridge, name="Bo", odometry="/a/ekf/odometry/filtered")
    console = drawn(bridge, TOPICS, first, second)
    assert [len(what_of(robot)) for robot in console.given] == [4, 0]
    made = [[type(module).__name__ for module in r.modules] for r in console.given]
    assert [names.count("Trail") for names in made] == [1, 1], (
        "each robot has its own trail"
    )
    behind = {bridge: SearchResult(URL, "bob", discover(TOPICS), topics=TOPICS)}
    fleet = FleetSearch([first, second], behind=behind)
    assert fleet.table(grid=True, only_given=False).count("/a/points") == 1
    for robot in console.given:
        robot.destroy()


def test_a_robot_option_on_another_bridge_gets_no_layers(bridge):
    elsewhere = described(Bridge("ws://al:9090"), odometry="/a/odom")
    console = drawn(bridge, TOPICS, elsewhere)
    assert what_of(console.given[0]) == []
    assert console.grids == {}
    console.given[0].destroy()


@pytest.mark.parametrize(
    ("given", "namespace"),
    [
        ({"odometry": "/a/ekf/odometry/filtered"}, "/a"),  # not the best odometry
        ({"odometry": "a/odom/"}, "/a"),
        ({"velocity": "/b/cmd_vel"}, "/b"),
        ({"name": "b", "scan": "/scan"}, "/b"),
        ({"scan": "/a/front/scan"}, None),
        ({"odometry": "/none of a topic"}, None),
    ],
)
def test_a_robot_option_matches_a_discovered_robot_by_topics_and_then_by_name(
    bridge, given, namespace
):
    found = same_robot(described(bridge, **given).found, discover(TOPICS).robots)
    assert (None if found is None else found.namespace) == namespace


@pytest.mark.parametrize(
    ("given", "namespace"),
    [
        ({"odometry": "/c/odom", "velocity": "/c/cmd_vel", "scan": "/c/scan"}, "/c"),
        ({"odometry": "/c/base/odom", "velocity": "/c/cmd_vel"}, "/c"),
        ({"odometry": "/c/platform/odom"}, "/c"),
        ({"odometry": "/c/odom", "velocity": "/d/cmd_vel"}, ""),
        ({"odometry": "/odom", "velocity": "/c/cmd_vel"}, ""),
    ],
)
def test_the_namespace_of_a_robot_option_is_the_common_prefix_of_its_topics(
    bridge, given, namespace
):
    assert namespace_of(described(bridge, **given).found) == namespace


@pytest.mark.parametrize(
    ("texts", "expected"),
    [
        (
            ["Bob:/odom", "bob:/odom2"],
            "robot 'bob:/odom2': another robot is called 'Bob'",
        ),
        (["Bob:/a b"], "robot 'Bob:/a b': '/a b' is not the name of a topic: expected"),
        (["B\nob:/a"], "a name is one line of at most 100 characters"),
        (["b" * 101 + ":/a"], "a name is one line of at most 100 characters"),
        (["Bob:/a:/c", "Al:/b:c/"], "c/ already drives 'Bob'; expected another topic"),
    ],
)
def test_an_invalid_robot_option_is_refused_with_its_text(bridge, texts, expected):
    with pytest.raises(ConfigError) as refused:
        parse_robots(texts, [bridge])
    assert expected in str(refused.value)


def test_two_robots_with_equal_topics_on_different_bridges_are_accepted(bridge):
    bridges = [bridge, Bridge("ws://al:9090")]
    given = parse_robots(["Bob:/odom:/cmd_vel", "2@Al:/odom:/cmd_vel"], bridges)
    assert [robot.found.name for robot in given] == ["Bob", "Al"]
    assert parse_robots(["Bob:/a", "Al:/b"], [bridge])[1].found.topic("velocity") == ""


@pytest.mark.parametrize("number", ["nan", "inf", "-1", "x"])
@pytest.mark.parametrize("option", ["--wait", "--stops-within"])
def test_wait_and_stops_within_accept_only_finite_seconds(option, number):
    done = CliRunner().invoke(view, [URL, option, number])
    assert done.exit_code == 2
    assert f"Invalid value for '{option}'" in done.output


@pytest.fixture
def bridges():
    return [Bridge("ws://localhost:9090"), Bridge("ws://localhost:9091")]


def test_a_robot_option_is_a_name_and_three_topics(bridges):
    given = parse_robot("Bob:/odom:/cmd_vel:/scan", bridges)
    assert given == described(
        bridges[0], odometry="/odom", velocity="/cmd_vel", scan="/scan"
    )


def test_topics_of_a_robot_option_may_be_empty_or_left_out(bridges):
    given = parse_robot("Bob:/odom::/scan", bridges)
    assert given == described(bridges[0], odometry="/odom", scan="/scan")
    given = parse_robot("Bob:/odom", bridges)
    assert given == described(bridges[0], odometry="/odom")


def test_a_number_in_a_robot_option_selects_the_bridge(bridges):
    assert parse_robot("2@Bob:/odom", bridges).bridge is bridges[1]


def test_an_at_sign_in_a_topic_does_not_select_a_bridge(bridges):
    assert parse_robot("Bob:/a@b", bridges).found.topic("odometry") == "/a@b"


@pytest.mark.parametrize(
    "text", ["", "Bob", ":/odom", "Bob:::", "Bob:/a:/b:/c:/d", "  :/odom"]
)
def test_a_malformed_robot_option_is_refused_with_the_correct_form(bridges, text):
    with pytest.raises(ConfigError, match="NAME:ODOM:CMD_VEL:SCAN"):
        parse_robot(text, bridges)


@pytest.mark.parametrize("number", ["0", "3", "-1", "x", "", "²"])
def test_an_invalid_bridge_number_is_refused(bridges, number):
    with pytest.raises(ConfigError, match="expected 1 to 2"):
        parse_robot(f"{number}@Bob:/odom", bridges)
