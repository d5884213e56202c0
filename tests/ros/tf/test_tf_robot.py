"""Robots that are drawn in the frame of the map."""

import asyncio
import math

import msgspec
import pytest

from equipment.waiting import until
from equipment.webmap_process import simulator
from webmap import Bridge, Robot
from webmap.base.errors import ConfigError
from webmap.base.scope import Removal
from webmap.poses.frames import frames_of


class Listening(Removal):
    """A subscription whose rate makes no difference."""

    def set_pace(self, throttle, unwatched):
        pass


class Link:
    """A bridge whose messages the test sends."""

    url, name = "ws://test:9090", "test"
    lag = 0.0
    state, replays = "open", False

    def __init__(self):
        self.subscribed = []

    def on_open(self, fn):
        return Removal(lambda: None)

    def subscribe(self, topic, callback, type=None, *, decode=None, **more):
        entry = (topic, callback, decode)
        self.subscribed.append(entry)
        return Listening(lambda: self.subscribed.remove(entry))

    def publish(self, topic, message):
        received = [entry for entry in self.subscribed if entry[0] == topic]
        assert received, f"{topic} has no subscriber"
        for _, callback, decode in received:
            callback(msgspec.convert(message, decode, strict=False))


def stamped(frame, stamp):
    secs = int(stamp)
    nsecs = round((stamp - secs) * 1e9)
    return {"frame_id": frame, "stamp": {"secs": secs, "nsecs": nsecs}}


def turn(yaw):
    return {"x": 0.0, "y": 0.0, "z": math.sin(yaw / 2), "w": math.cos(yaw / 2)}


def transform(parent, child, x, y=0.0, yaw=0.0, *, stamp=10.0):
    move = {"translation": {"x": x, "y": y, "z": 0.0}, "rotation": turn(yaw)}
    header = stamped(parent, stamp)
    return {"header": header, "child_frame_id": child, "transform": move}


def odometry(x, y=0.0, yaw=0.0, *, stamp=10.0, frame="odom"):
    still = {"linear": {"x": 0.0, "y": 0.0}, "angular": {"x": 0.0, "y": 0.0}}
    place = {"position": {"x": x, "y": y}, "orientation": turn(yaw)}
    return {
        "header": stamped(frame, stamp),
        "pose": {"pose": place},
        "twist": {"twist": still},
    }


@pytest.fixture(autouse=True)
def no_patience(monkeypatch):
    monkeypatch.setattr("webmap.poses.placing.PROBLEM_DELAY", 0.0)
    monkeypatch.setattr("webmap.poses.frames.GRACE", 0.0)


@pytest.fixture
def link():
    return Link()


@pytest.fixture
def bob(link):
    robot = Robot("Bob")
    robot.set_odometry_topic(link, "/odom", type="nav_msgs/Odometry")
    robot.set_tf(link)
    yield robot
    robot.destroy()


def where(robot):
    place = (robot.position.x, robot.position.y, robot.yaw)
    return pytest.approx(place, abs=1e-6)


def test_odometry_is_transformed_into_the_map_frame(link, bob):
    link.publish(
        "/tf", {"transforms": [transform("map", "odom", 10.0, 5.0, math.pi / 2)]}
    )
    link.publish("/odom", odometry(1.0))
    assert (10.0, 6.0, math.pi / 2) == where(bob)
    assert not bob.problems


def test_odometry_uses_the_frames_at_its_stamp_not_the_newest_frames(link, bob):
    for stamp, x in ((10.0, 0.0), (10.5, 50.0)):
        link.publish("/tf", {"transforms": [transform("map", "odom", x, stamp=stamp)]})
    link.publish("/odom", odometry(1.0, stamp=10.25))
    assert where(bob) == (26.0, 0.0, 0.0)


def test_a_pose_newer_than_the_frames_uses_the_newest_frames(link, bob):
    link.publish("/tf", {"transforms": [transform("map", "odom", 10.0)]})
    link.publish("/odom", odometry(1.0, stamp=10.3))
    assert where(bob) == (11.0, 0.0, 0.0)
    assert not bob.problems


def test_without_the_map_frame_a_robot_keeps_its_odometry_pose_and_a_problem(link, bob):
    link.publish("/odom", odometry(1.0))
    assert where(bob) == (1.0, 0.0, 0.0)
    assert "there is no frame 'map'" in bob.problems["tf"]
    link.publish("/tf", {"transforms": [transform("map", "odom", 10.0)]})
    link.publish("/odom", odometry(1.0, stamp=10.1))
    assert where(bob) == (11.0, 0.0, 0.0)
    assert not bob.problems


def test_a_quiet_robot_does_not_report_a_missing_map_frame(link, bob):
    bob.set_tf(link, quiet=True)
    link.publish("/odom", odometry(1.0))
    assert not bob.problems


def test_a_pose_in_the_map_frame_is_unchanged(link, bob):
    link.publish("/odom", odometry(3.0, frame="map"))
    assert where(bob) == (3.0, 0.0, 0.0)
    assert not bob.problems


def test_a_robot_without_odometry_has_the_pose_of_its_base_frame(link):
    bob = Robot("Bob", base_link="base_footprint")
    bob.set_tf(link)
    chain = [transform("map", "odom", 10.0), transform("odom", "base_footprint", 2.0)]
    link.publish("/tf", {"transforms": chain})
    assert where(bob) == (12.0, 0.0, 0.0)
    stamp = bob.pose_stamp
    bob.pose_stamp -= 1.0
    link.publish("/tf", {"transforms": [transform("map", "other", 1.0, stamp=20.0)]})
    assert bob.pose_stamp == stamp - 1.0, (
        "frames of other robots do not update this robot"
    )
    bob.destroy()


def test_frames_of_different_namespaces_are_kept_apart(link):
    robots = [Robot(name) for name in ("ann", "bob")]
    for number, robot in enumerate(robots):
        space = f"/{robot.name}"
        robot.set_odometry_topic(link, f"{space}/odom", type="nav_msgs/Odometry")
        robot.set_tf(link, namespace=space)
        link.publish(f"{space}/tf", {"transforms": [transform("map", "odom", number)]})
        link.publish(f"{space}/odom", odometry(0.5))
    assert where(robots[0]) == (0.5, 0.0, 0.0)
    assert where(robots[1]) == (1.5, 0.0, 0.0)
    for robot in robots:
        robot.destroy()


def test_robots_of_one_bridge_share_tf_until_the_last_robot_is_destroyed(link):
    robots = [Robot("Ann"), Robot("Bob")]
    for robot in robots:
        robot.set_tf(link)
    assert [topic for topic, _, _ in link.subscribed] == ["/tf", "/tf_static"]
    assert frames_of(link) is frames_of(link)
    robots[0].unset_tf()
    assert len(link.subscribed) == 2
    robots[1].destroy()
    assert link.subscribed == []


def test_an_invalid_transform_is_logged_once_and_the_others_are_used(link, bob, caplog):
    bad = transform("odom", "base_link", math.nan)
    for _ in range(3):
        link.publish("/tf", {"transforms": [bad, transform("map", "odom", 10.0)]})
    link.publish("/odom", odometry(1.0))
    assert where(bob) == (11.0, 0.0, 0.0)
    lines = [line for line in caplog.messages if line.startswith("test: a transform")]
    assert len(lines) == 1
    assert "not finite" in lines[0]
    assert bob.problems["frames"] == lines[0].removeprefix("test: ")


def test_the_tf_settings_survive_the_conversion_to_plain_data():
    bridge = Bridge("ws://bob:9090")
    bob = Robot("Bob")
    bob.set_tf(bridge, namespace="bob", quiet=True)
    data = bob.to_dict()
    assert data["tf"] == {
        "bridge": "ws://bob:9090",
        "base_frame": "bob/base_link",
        "namespace": "/bob",
        "quiet": True,
    }
    again = Robot.from_dict(data, {bridge.url: bridge})
    assert again.tf == bob.tf
    with pytest.raises(ConfigError, match="tf"):
        Robot.from_dict({"name": "Bob", "tf": {"topic": "/tf"}})
    for robot in (bob, again):
        robot.destroy()


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_a_simulated_robot_has_the_pose_of_its_frames(dialect):
    options = ("--wander", "--drift", "0.3", "--dialect", dialect)
    with simulator(*options) as url:
        asyncio.run(follow(url))


async def follow(url):
    bridge = Bridge(url)
    robot = Robot("robot_0")
    bridge.start(asyncio.get_running_loop())
    try:
        robot.set_odometry_topic(bridge, "/robot_0/odom", 0)
        robot.set_tf(bridge)
        buffer = frames_of(bridge).buffer

        def is_placed():
            if not robot.valid or not wanted <= set(buffer.frames):
                return False
            truth = buffer.lookup("map", "robot_0/base_link").planar
            off = math.dist((truth.x, truth.y), (robot.position.x, robot.position.y))
            return off < 0.1 and not robot.problems

        wanted = {"map", "robot_0/base_link"}
        state = lambda: f"the pose: {robot.problems}, {buffer.frames}"  # noqa: E731
        await until(is_placed, state)
    finally:
        robot.destroy()
        await bridge.stop()
