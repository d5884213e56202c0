"""Several odometry topics of one robot make one robot."""

import asyncio
import tomllib
from pathlib import Path

import pytest
from frames_only import TF, publishing

from equipment.command_line import run_inside
from webmap.base.geometry import Pose
from webmap.discovery import discover
from webmap.discovery.frames import odometry_topics, receive_frames
from webmap.discovery.newcomers import Newcomers
from webmap.discovery.tf_robots import Trees

LISTS = Path(__file__).parent / "topic_lists"
NOWHERE = "ws://127.0.0.1:1"

ODOM, TWIST = "nav_msgs/Odometry", "geometry_msgs/Twist"
POSE, CLOUD = "geometry_msgs/PoseStamped", "sensor_msgs/PointCloud2"


def robots(topics, frames=(), **odometry):
    """The topics of odometry of each robot, the one in use first, by namespace.

    Args:
        topics: Names of topics with odometry, or a mapping with types.
        frames: Pairs of a parent frame and a child frame.
        odometry: The ``child_frame_id`` by topic, with ``__`` for a slash.

    """
    trees = Trees()
    for parent, child in frames:
        trees.take("", parent, child)
    for topic, child in odometry.items():
        trees.odometry[topic.replace("__", "/")] = child
    return {
        robot.namespace: [each.topic for each in robot.guesses.get("odometry", ())]
        for robot in discover(topics, "bob", trees).robots
    }


@pytest.mark.parametrize(
    ("file", "odometry", "velocity", "others"),
    [
        (
            "two_sensors.txt",
            "/odometry/filtered",
            "/cmd_vel",
            {
                "/wheel/odometry": "no topic in /wheel takes a velocity",
                "/zed/zed_node/odom": "no topic in /zed/zed_node takes a velocity",
            },
        ),
        (
            "mavros.txt",
            "/mavros/local_position/odom",
            "/mavros/setpoint_velocity/cmd_vel_unstamped",
            {
                "/mavros/global_position/local": "the position by GPS",
                "/mavros/odometry/in": "to or from an autopilot",
                "/mavros/odometry/out": "to or from an autopilot",
            },
        ),
    ],
)
def test_the_discover_command_finds_one_robot_and_a_reason_for_each_other_odometry(
    file, odometry, velocity, others
):
    found = run_inside("discover", NOWHERE, "--topics", LISTS / file)
    lines = [" ".join(line.split()) for line in found.stdout.splitlines()]
    assert lines[0].endswith(", 1 robot")
    for topic, reason in others.items():
        (line,) = [line for line in lines if line.startswith(topic)]
        assert reason in line
        assert line.endswith(", not used")
    kept = run_inside("discover", NOWHERE, "--topics", LISTS / file, "--toml").stdout
    (robot,) = tomllib.loads(kept)["robots"]
    assert robot["odometry"]["topic"] == odometry
    assert robot["twist"]["topic"] == velocity


@pytest.mark.parametrize("outer", ["", "/uav1"])
@pytest.mark.parametrize("node", ["/mavros", "/drone"])
def test_every_plugin_of_mavros_belongs_to_the_vehicle(outer, node):
    space = outer + node
    topics = dict.fromkeys(
        ["local_position/odom", "global_position/local", "wheel_odometry/odom"], ODOM
    )
    topics |= dict.fromkeys(
        [
            "local_position/pose",
            "vision_pose/pose",
            "mocap/pose",
            "landing_target/pose",
        ],
        POSE,
    )
    for more in ({}, {"setpoint_velocity/cmd_vel": TWIST}):
        every = {f"{space}/{name}": type for name, type in (topics | more).items()}
        (robot,) = discover(every).robots
        assert robot.namespace == (outer if node == "/mavros" else space)
        assert robot.topic("odometry") == f"{space}/local_position/odom"
        assert robot.topic("pose") == f"{space}/local_position/pose"
        assert bool(robot.topic("velocity")) == bool(more)


def test_a_filter_in_a_part_of_the_robot_is_used_before_the_wheels_and_a_camera():
    topics = {"/cmd_vel": TWIST, "/odom": ODOM, "/fusion/odometry/filtered": ODOM}
    (used, *_) = robots(topics | {"/zed/zed_node/odom": ODOM})[""]
    assert used == "/fusion/odometry/filtered"
    topics = {"/bob/cmd_vel": TWIST, "/bob/wheel/odometry": ODOM, "/bob/zed/odom": ODOM}
    frames = {"__bob__wheel__odometry": "base_link", "__bob__zed__odom": "base_link"}
    order = ["/bob/wheel/odometry", "/bob/zed/odom"]
    assert robots(topics, **frames) == {"/bob": order}


SENSORS = {"/wheel/odometry": ODOM, "/zed/zed_node/odom": ODOM}
BOTH = ["/wheel/odometry", "/zed/zed_node/odom"]
ONE_BODY = [("odom", "base_link"), ("base_link", "zed_camera_link")]


@pytest.mark.parametrize("velocity", [{}, {"/cmd_vel": TWIST}])
@pytest.mark.parametrize(
    ("frames", "camera"), [((), "base_link"), (ONE_BODY, "zed_camera_link")]
)
def test_sensors_with_one_child_frame_or_one_tree_of_frames_are_one_robot(
    velocity, frames, camera
):
    heard = {"__wheel__odometry": "base_link", "__zed__zed_node__odom": camera}
    assert robots(SENSORS | velocity, frames, **heard) == {"": BOTH}


def test_a_sensor_outside_the_namespace_of_its_robot_is_found_by_its_frames():
    topics = {"/bob/odom": ODOM, "/bob/cmd_vel": TWIST, "/zed/odom": ODOM}
    topics |= {"/eve/odom": ODOM, "/eve/cmd_vel": TWIST, "/odometry/filtered": ODOM}
    frames = [
        *(("map", "bob/odom"), ("bob/odom", "bob/base_link"), ("bob/base_link", "zed")),
        *(("map", "eve/odom"), ("eve/odom", "eve/base_link")),
    ]
    heard = {"__bob__odom": "bob/base_link", "__eve__odom": "eve/base_link"}
    heard |= {"__zed__odom": "zed", "__odometry__filtered": "eve/base_link"}
    assert robots(topics, frames, **heard) == {
        "/bob": ["/bob/odom", "/zed/odom"],
        "/eve": ["/odometry/filtered", "/eve/odom"],
    }
    trees = Trees({"": {child: parent for parent, child in frames}})
    trees.odometry["/bob/odom"], trees.odometry["/zed/odom"] = "bob/base_link", "zed"
    found = discover(topics | {"/zed/points": CLOUD}, "host", trees)
    (bob,) = [robot for robot in found.robots if robot.name == "bob"]
    reason = bob.guesses["odometry"][1].rule
    assert reason.endswith("its child_frame_id is a frame of this robot")
    assert [each.topic for each in found.layers["/bob"].drawn] == ["/zed/points"]


def test_a_base_whose_prefix_is_not_the_namespace_belongs_to_the_driven_robot():
    topics = {"/robot1/odom": ODOM, "/robot1/cmd_vel": TWIST}
    topics |= {"/eve/odom": ODOM, "/eve/cmd_vel": TWIST}
    frames = [("rb1/odom", "rb1/base_link"), ("eve/odom", "eve/base_link")]
    found = robots(topics, frames, __robot1__odom="rb1/base_link")
    assert list(found) == ["/eve", "/robot1"]


def test_driven_robots_with_equal_frames_stay_apart():
    topics = {
        f"/{name}/{tail}": type
        for name in "ab"
        for tail, type in (("odom", ODOM), ("cmd_vel", TWIST))
    }
    heard = {"__a__odom": "base_link", "__b__odom": "base_link"}
    assert list(robots(topics, **heard)) == ["/a", "/b"]
    heard["__zed__odom"] = "base_link"
    assert list(robots(topics | {"/zed/odom": ODOM}, **heard)) == ["/a", "/b", "/zed"]


def test_observed_robots_with_frames_of_their_own_stay_apart():
    observed = {"/a/odom": ODOM, "/b/odom": ODOM}
    own = {"/a/tf": TF, "/b/tf": TF}
    heard = {"__a__odom": "base_link", "__b__odom": "base_link"}
    assert list(robots(observed | own, **heard)) == ["/a", "/b"]
    leader = {"/odom": ODOM, "/cmd_vel": TWIST}
    heard = {"__a__odom": "a/base_link", "__b__odom": "b_base_link"}
    assert list(robots(observed | leader, **heard)) == ["", "/a", "/b"]


def test_namespaces_that_name_each_other_as_their_base_are_one_robot():
    topics = {"/x/odom": ODOM, "/y/odom": ODOM}
    heard = {"__x__odom": "y/base_link", "__y__odom": "x/base_link"}
    assert len(robots(topics, **heard)) == 1


def test_a_sensor_is_no_new_robot_while_its_frames_are_not_received_again():
    topics = {"/bob/odom": ODOM, "/bob/cmd_vel": TWIST, "/zed/odom": ODOM}
    trees = Trees()
    trees.odometry |= {"/bob/odom": "base_link", "/zed/odom": "base_link"}
    newcomers = Newcomers(discover(topics, "host", trees).robots)
    more = topics | {"/eve/odom": ODOM}
    seen = [newcomers.look(discover(more)) for _ in range(3)]
    assert [news.robot.name for look in seen for news in look] == ["eve"]


def test_odometry_is_listened_to_only_if_some_may_belong_to_one_robot():
    fleet = {"/a/odom": ODOM, "/a/cmd_vel": TWIST, "/b/odom": ODOM, "/b/cmd_vel": TWIST}
    assert odometry_topics(fleet) == []
    assert odometry_topics({"/odom": ODOM, "/cmd_vel": TWIST}) == []
    more = fleet | {"/zed/odom": "nav_msgs/msg/Odometry"}
    assert odometry_topics(more) == ["/a/odom", "/b/odom", "/zed/odom"]


@pytest.mark.slow
@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_the_child_frames_of_odometry_are_received_from_a_bridge(dialect):
    chain = [("odom", "base_link", Pose()), ("base_link", "zed", Pose())]
    moved = {"/wheel/odometry": "/base_link", "/zed/zed_node/odom": "zed"}
    with publishing({"/tf": chain}, dialect, odometry=moved) as url:
        topics = {**SENSORS, "/tf": TF}
        trees = asyncio.run(receive_frames(url, topics))
    assert trees.odometry == {
        "/wheel/odometry": "base_link",
        "/zed/zed_node/odom": "zed",
    }
    (robot,) = discover(topics, "bob", trees).robots
    assert (robot.name, robot.base_frame) == ("bob", "base_link")
    assert robot.topic("odometry") == "/wheel/odometry"
