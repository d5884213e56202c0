"""Robots that publish only their frames."""

import asyncio
import subprocess
import sys
from itertools import pairwise

import pytest
from frames_only import publishing

from equipment.waiting import until
from webmap import Bridge, Robot
from webmap.base.geometry import Pose
from webmap.config.robot import TfConfig
from webmap.discovery import discover
from webmap.discovery.frames import frame_topics, receive_frames
from webmap.discovery.tf_robots import MOST_FRAMES, Trees, bases
from webmap.poses.frames import frames_of

pytestmark = pytest.mark.slow

ODOM, TWIST = "nav_msgs/Odometry", "geometry_msgs/Twist"
TF = "tf2_msgs/TFMessage"


def trees(**received) -> Trees:
    """Trees from chains such as ``"map odom base_link"``, by namespace."""
    found = Trees()
    for namespace, chains in received.items():
        for chain in chains:
            frames = chain.split()
            for parent, child in pairwise(frames):
                found.take(namespace and f"/{namespace}", parent, child)
    return found


def shared(*chains) -> Trees:
    return trees(**{"": chains})


def found(topics, frames):
    return {
        robot.name: (robot.namespace, robot.base_frame, robot.root_frame)
        for robot in discover(topics, "bob", frames).robots
    }


def test_a_frame_tree_from_map_to_base_link_is_a_robot():
    topics = {"/tf": TF, "/scan": "sensor_msgs/LaserScan"}
    findings = discover(topics, "bob", shared("map odom base_link laser"))
    (robot,) = findings.robots
    assert (robot.name, robot.namespace) == ("bob", "")
    assert (robot.base_frame, robot.root_frame) == ("base_link", "map")
    assert robot.tf_alone
    assert robot.topic("scan") == "/scan"
    assert robot.tf == TfConfig(base_frame="base_link", map_frame="map")
    assert "its pose comes from its frames, base_link in map" in robot.notes[0]


def test_each_frame_prefix_is_a_robot():
    frames = shared(
        "map r1/odom r1/base_link r1/arm_base_link",
        "map r2/odom r2/base_footprint r2/base_link",
        "map tb3_odom tb3_base_link",
    )
    topics = {"/tf": TF, "/r1/cmd_vel": TWIST}
    assert found(topics, frames) == {
        "r1": ("/r1", "r1/base_link", "map"),
        "r2": ("/r2", "r2/base_footprint", "map"),
        "tb3": ("/tb3", "tb3_base_link", "map"),
    }


def test_a_robot_with_odometry_keeps_its_odometry_and_gets_its_base_frame():
    topics = {"/tf": TF, "/Bob/odom": ODOM, "/Bob/cmd_vel": TWIST}
    (robot,) = discover(topics, "host", shared("bob/odom bob/base_footprint")).robots
    assert robot.topic("odometry") == "/Bob/odom"
    assert not robot.tf_alone
    assert robot.tf == TfConfig(quiet=True, base_frame="bob/base_footprint")


def test_robots_with_maps_in_one_world_frame_are_drawn_in_the_world_frame():
    """Several ROS 1 robots may each have a map of their own."""
    trees = shared(
        "world bob/map bob/odom bob/base_link", "world ann/map ann/odom ann/base_link"
    )
    topics = {"/tf": TF, "/bob/odom": ODOM, "/ann/odom": ODOM}
    for robot in discover(topics, "host", trees).robots:
        assert robot.tf.map_frame == "world"
        assert robot.map_frame == "world"


def test_the_frame_named_map_is_used_even_below_another_frame():
    topics = {"/tf": TF, "/odom": ODOM}
    trees = shared("earth map odom base_link")
    (robot,) = discover(topics, "host", trees).robots
    assert robot.tf.map_frame == robot.map_frame == "map"


def test_a_robot_without_a_map_frame_is_drawn_in_its_odom_frame():
    (robot,) = discover({"/tf": TF}, "bob", shared("odom base_link")).robots
    assert robot.tf.map_frame == "odom"


def test_a_namespace_with_its_own_tf_is_a_robot_even_before_any_message():
    topics = {"/a/tf": TF, "/b/tf": TF, "/b/odom": ODOM, "/b/camera/tf": TF}
    robots = discover(topics).robots
    assert [(robot.name, robot.tf_alone) for robot in robots] == [
        ("a", True),
        ("b", False),
    ]
    assert robots[0].tf == TfConfig(namespace="/a")


@pytest.mark.parametrize(
    "chains",
    [
        ("base_link laser",),
        ("torso arm_base_link gripper",),
        ("map marker",),
        ("a b", "b a"),
    ],
)
def test_frames_without_a_base_below_odom_or_map_are_no_robot(chains):
    assert discover({"/tf": TF}, "bob", shared(*chains)).robots == ()


def test_unprefixed_frames_that_several_robots_share_belong_to_no_robot():
    topics = {"/a/odom": ODOM, "/b/odom": ODOM, "/tf": TF}
    names = found(topics, shared("map odom base_link"))
    assert names == {"a": ("/a", "", ""), "b": ("/b", "", "")}


def test_a_base_link_below_another_base_link_is_no_second_robot():
    assert [base.frame for base in bases({"base_link": "odom", "base": "base_link"})]
    (base,) = bases({"base_link": "odom", "arm/base_link": "base_link"})
    assert base.frame == "base_link"


def test_a_loop_of_frames_does_not_hang_the_search():
    assert list(bases({"map": "base_link", "base_link": "odom", "odom": "map"}))


def test_a_flood_of_frames_does_not_displace_the_frames_of_robots():
    received = shared("map odom base_link laser", "map bob/odom bob/base_link")
    for number in range(3 * MOST_FRAMES):
        received.take("", "map", f"object_{number}")
    assert len(received.parents[""]) <= MOST_FRAMES
    assert f"object_{3 * MOST_FRAMES - 1}" in received.parents[""]
    assert [(base.space, base.above) for base in received.bases()] == [
        ("", ("odom", "map")),
        ("/bob", ("bob/odom", "map")),
    ]


def test_the_number_of_stored_base_frames_is_limited():
    received = Trees()
    for number in range(2 * MOST_FRAMES):
        received.take("", "map", f"r{number}/base_link")
    assert len(received.parents[""]) <= MOST_FRAMES
    assert f"r{2 * MOST_FRAMES - 1}/base_link" in received.parents[""]


def test_only_tf_topics_are_subscribed():
    topics = {"/tf": TF, "/a/tf": "tf2_msgs/msg/TFMessage", "/b/tf": "odd", "/c": TF}
    assert frame_topics(topics) == ["/a/tf_static", "/a/tf", "/tf_static", "/tf"]


def test_an_unreachable_bridge_gives_no_frames():
    seen = asyncio.run(receive_frames("ws://127.0.0.1:1", {"/tf": TF}))
    assert seen.bases() == ()


MAP_TO_BASE = [
    ("map", "bob/odom", Pose(5.0, 1.0, 0.0)),
    ("bob/odom", "bob/base_link", Pose(2.0, 0.0, 0.0)),
]


def test_the_discover_command_shows_a_robot_from_frames_and_writes_a_valid_file(
    tmp_path,
):
    with publishing({"/tf": MAP_TO_BASE}, "ros2") as url:
        shown, kept = (
            subprocess.run(
                [sys.executable, "-m", "webmap", "discover", url, *option],
                capture_output=True,
                text=True,
                check=True,
            ).stdout
            for option in ([], ["--toml"])
        )
    assert "bob (in /bob)" in shown
    assert "frames      bob/base_link in map" in shown
    assert "its pose comes from its frames, bob/base_link in map" in shown
    assert 'tf.base_frame = "bob/base_link"' in kept
    assert "tf.quiet = false # its pose comes from its frames" in kept
    file = tmp_path / "fleet.toml"
    file.write_text(kept)
    checked = subprocess.run(
        [sys.executable, "-m", "webmap", "check", str(file)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert "1 robot behind 1 bridge, no mistakes" in checked.stdout, checked


def test_a_robot_found_by_frames_has_the_pose_from_its_frames():
    with publishing({"/tf": MAP_TO_BASE}) as url:

        async def scenario() -> None:
            seen = await receive_frames(url, {"/tf": TF})
            (found,) = discover({"/tf": TF}, "host", seen).robots
            bridge = Bridge(url)
            robot = Robot.from_config(found.config(url), {url: bridge})
            bridge.start(asyncio.get_running_loop())
            try:
                await until(lambda: robot.valid)
                assert (robot.position.x, robot.position.y) == (7.0, 1.0)
                assert robot.problems == {}
            finally:
                robot.destroy()
                await bridge.stop()

        asyncio.run(scenario())


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_ten_namespaces_with_their_own_tf_on_one_bridge_are_ten_robots(dialect):
    received = {
        f"/r{n}/tf": [
            ("map", "odom", Pose(10.0 * n, 0.0, 0.0)),
            ("odom", "base_link", Pose(1.0, 0.1 * n, 0.0)),
        ]
        for n in range(10)
    }
    with publishing(received, dialect) as url:

        async def scenario() -> None:
            bridge = Bridge(url)
            bridge.start(asyncio.get_running_loop())
            robots = []
            try:
                await until(lambda: bridge.state == "open")
                topics = await bridge.topics()
                findings = discover(topics, "host", await receive_frames(url, topics))
                assert [each.name for each in findings.robots] == [
                    f"r{n}" for n in range(10)
                ]
                for each in findings.robots:
                    config = each.config(url)
                    robots.append(Robot.from_config(config, {url: bridge}))
                await until(lambda: all(robot.valid for robot in robots))
                for n, robot in enumerate(robots):
                    place = (robot.position.x, robot.position.y)
                    assert place == pytest.approx((10.0 * n + 1.0, 0.1 * n))
                    assert robot.problems == {}
                    frames = frames_of(bridge, f"/r{n}").buffer.frames
                    assert frames == ["map", f"r{n}/base_link", f"r{n}/odom"]
            finally:
                for robot in robots:
                    robot.destroy()
                await bridge.stop()

        asyncio.run(scenario())
