"""The readiness check of robots that somebody configured."""

import asyncio
from dataclasses import replace

import pytest
from faulty_site import site

from webmap.discovery import discover
from webmap.discovery.doctor import (
    ConfiguredRobot,
    Measurement,
    Observed,
    is_ready,
    judge,
)
from webmap.discovery.doctor.configured import merge_configured
from webmap.discovery.doctor.measure import observe
from webmap.discovery.doctor.observed import Clock, FramePath

SECONDS = 0.4
STAMPED = "geometry_msgs/msg/TwistStamped"
TOPICS = {
    f"/{name}/{topic}": type
    for name in ("a", "b")
    for topic, type in {
        "odom": "nav_msgs/Odometry",
        "ekf/odometry/filtered": "nav_msgs/Odometry",
        "cmd_vel": "geometry_msgs/Twist",
        "scan": "sensor_msgs/LaserScan",
    }.items()
}
DRIVEN = {
    "odometry": (("/a/odom", ""),),
    "velocity": (("/a/cmd_vel", ""),),
}


def laid(*configured, topics=TOPICS):
    return merge_configured(discover(topics), configured, topics)


def seen_of(*configured, topics=TOPICS, **more):
    """What is seen of configured robots, on a link without any trouble."""
    findings, by_name = laid(*configured, topics=topics)
    known = {one.found_as for one in by_name.values()}
    others = [one.name for one in discover(topics).robots if one.name not in known]
    seen = Observed(
        "ws://localhost:9090",
        types=topics,
        findings=findings,
        configured=by_name,
        others=tuple(others),
        clock=Clock(0.0, 0.004),
        publishers={"/a/cmd_vel": ()},
        measured={"/a/odom": Measurement(60, 3.0, 0.06)},
    )
    return replace(seen, **more)


def said(seen, words):
    """The only finding that says these words."""
    (found,) = [each for each in judge(seen) if words in each.text]
    return found


def test_what_was_said_is_measured_and_what_was_not_is_as_it_was_found():
    findings, _ = laid(
        ConfiguredRobot("Bob", {"odometry": (("/a/ekf/odometry/filtered", ""),)})
    )
    (bob,) = findings.robots
    assert bob.name == "Bob"
    assert bob.topic("odometry") == "/a/ekf/odometry/filtered"
    assert bob.topic("scan") == "/a/scan"


def test_a_robot_that_does_without_a_topic_is_not_measured_by_it():
    (bob,) = laid(ConfiguredRobot("Bob", {**DRIVEN, "scan": ()}))[0].robots
    assert "scan" not in bob.guesses


def test_a_relative_name_of_a_topic_is_the_one_that_is_behind_the_bridge():
    (bob,) = laid(ConfiguredRobot("Bob", {"odometry": (("a/odom/", ""),)}))[0].robots
    assert bob.first("odometry").topic == "/a/odom"
    assert bob.topic("velocity") == "/a/cmd_vel", "it is the robot that was found"


def test_topics_tell_which_robot_is_meant_before_any_name_does():
    turned = (
        ConfiguredRobot("b", {"odometry": (("/a/odom", ""),)}),
        ConfiguredRobot("a", {"velocity": (("/b/cmd_vel", ""),)}),
    )
    findings, configured = laid(*turned)
    assert [robot.topic("scan") for robot in findings.robots] == ["/a/scan", "/b/scan"]
    assert [one.found_as for one in configured.values()] == ["a", "b"]


def test_two_robots_of_one_name_are_told_apart():
    findings, configured = laid(ConfiguredRobot("Bob", DRIVEN), ConfiguredRobot("Bob"))
    assert [robot.name for robot in findings.robots] == ["Bob", "Bob 2"]
    assert list(configured) == ["Bob", "Bob 2"]


@pytest.mark.parametrize(
    ("takes", "sends", "level", "words"),
    [
        (
            "geometry_msgs/Twist",
            "geometry_msgs/msg/Twist",
            "good",
            "has the type Twist, and",
        ),
        ("geometry_msgs/Twist", "", "good", "has the type Twist, and"),
        (STAMPED, "", "good", "has the type TwistStamped, and"),
        (
            "geometry_msgs/Twist",
            STAMPED,
            "wrong",
            "has the type Twist, but WebMap is configured to send TwistStamped: the "
            "robot would neither move nor stop",
        ),
        (
            "std_msgs/String",
            "",
            "wrong",
            "has the type String, but WebMap is configured to send Twist:",
        ),
    ],
)
def test_the_type_that_is_sent_is_held_against_the_one_that_the_base_takes(
    takes, sends, level, words
):
    topics = TOPICS | {"/a/cmd_vel": takes}
    bob = ConfiguredRobot("Bob", {**DRIVEN, "velocity": (("/a/cmd_vel", sends),)})
    found = said(seen_of(bob, topics=topics), words)
    assert found.level == level
    assert ("twist.type" in found.advice) is (level == "wrong")


def test_a_type_that_only_a_person_says_is_no_good_news():
    bob = ConfiguredRobot("Bob", {**DRIVEN, "velocity": (("/a/other", STAMPED),)})
    assert (
        said(seen_of(bob), "/a/other has the stated type TwistStamped").level == "note"
    )


def test_a_robot_that_was_given_no_velocity_is_no_mistake():
    seen = seen_of(ConfiguredRobot("Bob", {**DRIVEN, "velocity": ()}))
    assert (
        said(seen, "without a velocity topic: it can be seen but not driven").level
        == "note"
    )
    assert is_ready(judge(seen))


def test_robots_that_nobody_meant_are_named_and_not_measured():
    seen = seen_of(ConfiguredRobot("Bob", DRIVEN))
    assert said(seen, "they were not checked: b.").level == "note"
    assert said(seen, "robots checked: Bob.").level == "good"
    assert {each.about for each in judge(seen)} == {"bridge", "Bob"}


def test_the_stop_test_is_told_by_the_name_that_the_command_finds():
    words = "This check does not find out whether the base stops by itself"
    advice = said(seen_of(ConfiguredRobot("Bob", DRIVEN)), words).advice
    assert "--stop-test a, or the button on its card" in advice
    strange = {"odometry": (("/x/odom", ""),), "velocity": (("/x/cmd", ""),)}
    advice = said(seen_of(ConfiguredRobot("Eve", strange)), words).advice
    assert "--stop-test" not in advice
    assert "the button on its card" in advice


def test_what_goes_over_another_bridge_is_not_missed_at_this_one():
    bob = ConfiguredRobot(
        "Bob",
        {"odometry": (), "pose": (), "velocity": (), "tf": ()},
        elsewhere=frozenset({"odometry", "velocity"}),
        found_as="a",
    )
    about_bob = [each.text for each in judge(seen_of(bob)) if each.about == "Bob"]
    assert about_bob == []


def looked_at(system, *configured):
    """Observe a system with configured robots."""

    async def run():
        async with system as there:
            seen = await observe(
                there.url, seconds=SECONDS, configured=lambda _: configured
            )
            assert there.graph.advertised == [], "something was published"
            return seen

    return asyncio.run(run())


BOB = {
    "odometry": (("/robot_0/odom", ""),),
    "velocity": (("/robot_0/cmd_vel", "geometry_msgs/TwistStamped"),),
    "scan": (),
    "camera": (),
}


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_a_robot_is_measured_by_the_topics_that_it_was_given(dialect):
    seen = looked_at(site(dialect), ConfiguredRobot("Bob", BOB))
    assert (
        said(seen, "/robot_0/cmd_vel has the type Twist, but WebMap is").level
        == "wrong"
    )
    assert seen.measured["/robot_0/odom"].count > 0
    assert not [
        topic for topic in seen.measured if "scan" in topic or "camera" in topic
    ]


def test_without_rosapi_the_robots_that_were_given_are_measured():
    seen = looked_at(site(rosapi=False), ConfiguredRobot("Bob", BOB))
    assert [robot.name for robot in seen.findings.robots] == ["Bob"]
    assert seen.measured["/robot_0/odom"].count > 0
    sent = said(seen, "/robot_0/cmd_vel has the stated type TwistStamped, and")
    assert sent.level == "note"
    assert said(seen, "blocks its socket is not known").level == "note"


def test_a_topic_that_is_not_there_is_wrong():
    seen = looked_at(
        site(), ConfiguredRobot("Bob", {**BOB, "odometry": (("/odometer", ""),)})
    )
    assert said(seen, "No message was received on /odometer").level == "wrong"


def test_where_nobody_said_anything_all_that_is_found_is_measured():
    seen = looked_at(site())
    assert [robot.name for robot in seen.findings.robots] == ["robot_0"]
    assert seen.configured == {}
    assert said(seen, "robots found: robot_0.").level == "good"


def test_the_frames_are_followed_from_the_frame_that_was_said():
    received = {**BOB, "tf": (("/tf", ""),)}
    seen = looked_at(site(), ConfiguredRobot("Bob", received, map_frame="site"))
    assert seen.frame_paths["Bob"].start == "site"
    assert "site" in seen.frame_paths["Bob"].missing
    seen = looked_at(site(), ConfiguredRobot("Bob", received, map_frame="map"))
    assert seen.frame_paths["Bob"] == FramePath(
        "robot_0/odom", base="robot_0/base_link"
    )
