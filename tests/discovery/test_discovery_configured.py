"""The readiness check of configured robots."""

import asyncio
from dataclasses import replace

import pytest
from faulty_site import site

from webmap.discovery import discover
from webmap.discovery.doctor import (
    BridgeFacts,
    ConfiguredRobot,
    Measurement,
    is_ready,
    judge,
)
from webmap.discovery.doctor.facts import Clock, FramePath, merge_configured
from webmap.discovery.doctor.measure import observe

pytestmark = pytest.mark.slow

SECONDS = 0.4
"""How long a site is listened to, in tests that run among those of time."""
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
    """What the check sees of configured robots on a link without faults."""
    findings, by_name = laid(*configured, topics=topics)
    known = {one.found_as for one in by_name.values()}
    others = [one.name for one in discover(topics).robots if one.name not in known]
    seen = BridgeFacts(
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


def finding_with(seen, words):
    """The only finding with this text."""
    (found,) = [each for each in judge(seen) if words in each.text]
    return found


def test_configured_topics_are_used_and_missing_topics_come_from_discovery():
    findings, _ = laid(
        ConfiguredRobot("Bob", {"odometry": (("/a/ekf/odometry/filtered", ""),)})
    )
    (bob,) = findings.robots
    assert bob.name == "Bob"
    assert bob.topic("odometry") == "/a/ekf/odometry/filtered"
    assert bob.topic("scan") == "/a/scan"


def test_a_topic_that_is_configured_off_is_not_measured():
    (bob,) = laid(ConfiguredRobot("Bob", {**DRIVEN, "scan": ()}))[0].robots
    assert "scan" not in bob.guesses


def test_a_relative_topic_name_matches_the_topic_of_the_bridge():
    (bob,) = laid(ConfiguredRobot("Bob", {"odometry": (("a/odom/", ""),)}))[0].robots
    assert bob.first("odometry").topic == "/a/odom"
    assert bob.topic("velocity") == "/a/cmd_vel", "the found robot is used"


def test_a_configured_robot_is_matched_by_its_topics_before_its_name():
    turned = (
        ConfiguredRobot("b", {"odometry": (("/a/odom", ""),)}),
        ConfiguredRobot("a", {"velocity": (("/b/cmd_vel", ""),)}),
    )
    findings, configured = laid(*turned)
    assert [robot.topic("scan") for robot in findings.robots] == ["/a/scan", "/b/scan"]
    assert [one.found_as for one in configured.values()] == ["a", "b"]


def test_two_configured_robots_with_one_name_get_different_names():
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
def test_the_configured_velocity_type_is_compared_with_the_type_of_the_base(
    takes, sends, level, words
):
    topics = TOPICS | {"/a/cmd_vel": takes}
    bob = ConfiguredRobot("Bob", {**DRIVEN, "velocity": (("/a/cmd_vel", sends),)})
    found = finding_with(seen_of(bob, topics=topics), words)
    assert found.level == level
    assert ("twist.type" in found.advice) is (level == "wrong")


def test_a_configured_type_that_the_bridge_does_not_confirm_is_only_a_note():
    bob = ConfiguredRobot("Bob", {**DRIVEN, "velocity": (("/a/other", STAMPED),)})
    assert (
        finding_with(seen_of(bob), "/a/other has the stated type TwistStamped").level
        == "note"
    )


def test_a_robot_configured_without_velocity_is_a_note_and_no_mistake():
    seen = seen_of(ConfiguredRobot("Bob", {**DRIVEN, "velocity": ()}))
    assert (
        finding_with(
            seen, "without a velocity topic: it can be seen but not driven"
        ).level
        == "note"
    )
    assert is_ready(judge(seen))


def test_robots_that_are_not_configured_are_named_but_not_checked():
    seen = seen_of(ConfiguredRobot("Bob", DRIVEN))
    assert finding_with(seen, "they were not checked: b.").level == "note"
    assert finding_with(seen, "robots checked: Bob.").level == "good"
    assert {each.about for each in judge(seen)} == {"bridge", "Bob"}


def test_the_stop_test_advice_uses_the_discovered_name_of_the_robot():
    words = "This check does not find out whether the base stops by itself"
    advice = finding_with(seen_of(ConfiguredRobot("Bob", DRIVEN)), words).advice
    assert "--stop-test a, or the button on its card" in advice
    strange = {"odometry": (("/x/odom", ""),), "velocity": (("/x/cmd", ""),)}
    advice = finding_with(seen_of(ConfiguredRobot("Eve", strange)), words).advice
    assert "--stop-test" not in advice
    assert "the button on its card" in advice


def test_topics_of_another_bridge_are_not_reported_as_missing():
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
@pytest.mark.serial
def test_a_configured_robot_is_measured_by_its_configured_topics(dialect):
    seen = looked_at(site(dialect), ConfiguredRobot("Bob", BOB))
    assert (
        finding_with(seen, "/robot_0/cmd_vel has the type Twist, but WebMap is").level
        == "wrong"
    )
    assert seen.measured["/robot_0/odom"].count > 0
    assert not [
        topic for topic in seen.measured if "scan" in topic or "camera" in topic
    ]


@pytest.mark.serial
def test_configured_robots_are_measured_without_rosapi():
    seen = looked_at(site(rosapi=False), ConfiguredRobot("Bob", BOB))
    assert [robot.name for robot in seen.findings.robots] == ["Bob"]
    assert seen.measured["/robot_0/odom"].count > 0
    sent = finding_with(seen, "/robot_0/cmd_vel has the stated type TwistStamped, and")
    assert sent.level == "note"
    assert (
        finding_with(seen, "not known whether a service that hangs blocks").level
        == "note"
    )


@pytest.mark.serial
def test_a_configured_topic_without_messages_is_wrong():
    seen = looked_at(
        site(), ConfiguredRobot("Bob", {**BOB, "odometry": (("/odometer", ""),)})
    )
    assert finding_with(seen, "No message was received on /odometer").level == "wrong"


@pytest.mark.serial
def test_without_configured_robots_all_discovered_robots_are_measured():
    seen = looked_at(site())
    assert [robot.name for robot in seen.findings.robots] == ["robot_0"]
    assert seen.configured == {}
    assert finding_with(seen, "robots found: robot_0.").level == "good"


@pytest.mark.serial
def test_the_frame_path_starts_at_the_configured_map_frame():
    received = {**BOB, "tf": (("/tf", ""),)}
    seen = looked_at(site(), ConfiguredRobot("Bob", received, map_frame="site"))
    assert seen.frame_paths["Bob"].start == "site"
    assert "site" in seen.frame_paths["Bob"].missing
    seen = looked_at(site(), ConfiguredRobot("Bob", received, map_frame="map"))
    assert seen.frame_paths["Bob"] == FramePath(
        "robot_0/odom", base="robot_0/base_link"
    )
