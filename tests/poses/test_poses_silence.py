"""The log reports a robot that sends no poses over an open link, and its return."""

import asyncio
import logging
import re
import time

import msgspec
import pytest

from equipment.waiting import until
from webmap import Robot
from webmap.base.scope import Removal
from webmap.poses import silence
from webmap.poses.silence import AGAIN, LIMIT, Silence
from webmap.ros.bridge import BridgeStats


@pytest.fixture
def received():
    """The silence of a robot whose last pose arrived at 100 s."""
    received = Silence()
    received.record(100.0)
    return received


def test_a_silence_is_reported_after_the_limit(received):
    assert received.look(100.0 + LIMIT - 0.1, linked=True) is None
    assert received.look(100.0 + LIMIT, linked=True) == LIMIT


def test_the_first_pose_after_a_reported_silence_gives_the_length_of_silence(received):
    assert received.record(102.0) is None
    received.look(106.0, linked=True)
    assert received.record(114.0) == 12.0
    assert received.record(115.0) is None


def test_no_silence_is_reported_during_a_link_loss_and_shortly_after(
    received,
):
    assert received.look(110.0, linked=False) is None
    assert received.look(112.0, linked=True) is None
    assert received.look(113.0, linked=True) == 13.0


def test_repeated_silences_are_reported_at_most_once_per_minute():
    flickering, reported, again = Silence(), [], []
    for start in range(0, 600, 5):
        if flickering.record(float(start)) is not None:
            again.append(start)
        if flickering.look(start + LIMIT + 1.0, linked=True) is not None:
            reported.append(start)
    assert reported == [AGAIN * n for n in range(10)]
    assert again == [start + 5 for start in reported]


def test_a_second_lasting_silence_is_reported_one_minute_after_the_first(received):
    received.look(103.0, linked=True)
    received.record(104.0)
    assert received.look(110.0, linked=True) is None
    assert received.due == 103.0 + AGAIN
    assert received.look(103.0 + AGAIN, linked=True) == AGAIN - 1.0


def test_the_silence_limit_can_be_longer_for_a_slow_topic(received):
    received.limit = 25.0
    assert received.look(124.0, linked=True) is None
    assert received.look(125.0, linked=True) == 25.0


class Link:
    """An open bridge whose messages the test publishes."""

    url = "ws://test:9090"
    name = "hall"
    state = "open"
    lag = 0.0

    def __init__(self) -> None:
        self.stats = BridgeStats(links=1)
        self.listeners: dict[str, tuple] = {}

    def on_open(self, fn):
        return Removal(lambda: None)

    def subscribe(self, topic, callback, type=None, *, decode=None, **options):
        self.listeners[topic] = (callback, decode)
        return Removal(lambda: self.listeners.pop(topic))

    def protect(self, topic, carries):
        """Do nothing: no program publishes here."""

    def publish(self, topic, message):
        callback, decode = self.listeners[topic]
        callback(msgspec.convert(message, decode, strict=False))


ZERO = {"x": 0.0, "y": 0.0, "z": 0.0}
HEADER = {"seq": 1, "stamp": {"secs": 5, "nsecs": 0}, "frame_id": "map"}
POSE = {"pose": {"position": ZERO, "orientation": {**ZERO, "w": 1.0}}}
ODOM = {
    "header": HEADER,
    "child_frame_id": "base_link",
    "pose": {**POSE, "covariance": [0.0] * 36},
    "twist": {"twist": {"linear": ZERO, "angular": ZERO}, "covariance": [0.0] * 36},
}


@pytest.fixture
def link():
    return Link()


@pytest.fixture
def robots():
    robots = [Robot("Ann"), Robot("Bob")]
    yield robots
    for robot in robots:
        robot.destroy()


@pytest.fixture
def log(caplog, monkeypatch):
    """The log lines about robots, with a silence limit of a twentieth of a second."""
    monkeypatch.setattr(silence, "LIMIT", 0.05)
    caplog.set_level(logging.INFO, "webmap.robot")
    return caplog


async def lines_of(log, count: int) -> None:
    """Wait for a number of lines."""
    await until(lambda: len(log.messages) >= count)


def follow(robot, link, topic="/odom", type="nav_msgs/Odometry"):
    robot.set_odometry_topic(link, topic, throttle=0, type=type)


def test_the_end_and_the_return_of_odometry_are_each_logged_once(robots, link, log):
    async def scenario() -> None:
        follow(robots[1], link)
        link.publish("/odom", ODOM)
        await lines_of(log, 1)
        link.publish("/odom", ODOM)

    asyncio.run(scenario())
    lines = [re.sub(r"\d+ s", "N s", message) for message in log.messages]
    assert [line.levelname for line in log.records] == ["WARNING", "INFO"]
    assert lines == [
        "Bob: no pose for N s from /odom on hall, although the connection is open",
        "Bob: poses again, after N s",
    ]


def test_a_blocked_process_reports_no_robot_as_silent(robots, link, log, monkeypatch):
    monkeypatch.setattr(silence, "LATE", 0.1)

    async def scenario() -> None:
        follow(robots[1], link)
        link.publish("/odom", ODOM)
        time.sleep(0.2)  # the loop is blocked
        for _ in range(3):  # timers run before received messages
            await asyncio.sleep(0)
        link.publish("/odom", ODOM)

    asyncio.run(scenario())
    assert log.messages == []


def test_a_destroyed_robot_or_a_replaced_topic_is_not_reported_as_silent(
    robots, link, log
):
    ann, bob = robots
    gone = Robot("Cid")

    async def scenario() -> None:
        for robot in (gone, bob, ann):
            follow(robot, link, f"/{robot.name}")
            link.publish(f"/{robot.name}", ODOM)
        gone.destroy()
        follow(bob, link, "/other")
        await lines_of(log, 1)

    asyncio.run(scenario())
    (line,) = log.messages
    assert line.startswith("Ann: no pose")


def test_an_amcl_pose_topic_is_not_reported_as_silent(robots, link, log):
    ann, bob = robots

    async def scenario() -> None:
        follow(bob, link, "/amcl_pose", "geometry_msgs/PoseWithCovarianceStamped")
        link.publish("/amcl_pose", {"header": HEADER, "pose": POSE})
        follow(ann, link)
        link.publish("/odom", ODOM)
        await lines_of(log, 1)

    asyncio.run(scenario())
    assert bob.valid
    (line,) = log.messages
    assert line.startswith("Ann: no pose")


def test_a_robot_without_odometry_is_reported_when_its_frames_fall_silent(
    robots, link, log
):
    bob = robots[1]
    transform = {
        "header": HEADER,
        "child_frame_id": "base_link",
        "transform": {"translation": ZERO, "rotation": {**ZERO, "w": 1.0}},
    }

    async def scenario() -> None:
        bob.set_tf(link, namespace="/bob")
        link.publish("/bob/tf", {"transforms": [transform]})
        await lines_of(log, 1)

    asyncio.run(scenario())
    assert "from /bob/tf on hall" in log.messages[0]
