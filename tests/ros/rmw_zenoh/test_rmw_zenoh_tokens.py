"""Liveliness tokens and type hashes, without a router."""

import asyncio
import json

import pytest
from rosbags.typesys import Stores, get_typestore

from webmap.base.errors import ProtocolError, ServiceError
from webmap.ros.definitions import shipped
from webmap.ros.rmw_zenoh import graph as graphs
from webmap.ros.rmw_zenoh.graph import RmwZenohGraph, read_token
from webmap.ros.rmw_zenoh.messages import refusal_of, type_hash

# The examples of docs/design.md of rmw_zenoh.
STRING = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
CHAR = "RIHS01_3ad2d04dd29ba19d04b16659afa3ccaedd691914b02a64e82e252f2fa6a586a9"
HEAD = "@ros2_lv/0/8b20917502ee955ac4476e0266340d5c/0/10"
TALKER = (
    f"{HEAD}/MP/%/%/talker/%chatter/std_msgs::msg::dds_::String_/{STRING}/::,7:,:,:,,"
)
LISTENER = "@ros2_lv/0/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener"


def odometry(i, kind="MP", topic="%odom"):
    type = "nav_msgs::msg::dds_::Odometry_"
    return f"@ros2_lv/0/a/0/{i}/{kind}/%/%/n{i}/{topic}/{type}/h/::,7:,:,:,,"


async def nothing():
    return []


@pytest.fixture
def graph():
    return RmwZenohGraph("zenoh-ros2://robot", nothing)


def test_the_examples_of_the_design_of_rmw_zenoh_are_read():
    talker = read_token(TALKER)
    assert talker.kind == "publishers"
    assert (talker.node, talker.name) == ("/talker", "/chatter")
    assert (talker.type, talker.hash) == ("std_msgs/msg/String", STRING)
    assert talker.key == f"chatter/std_msgs::msg::dds_::String_/{STRING}"
    assert not talker.latched
    assert refusal_of(talker.type, talker.hash) is None
    assert read_token(LISTENER) is None


def test_a_namespace_and_transient_local_are_read():
    token = TALKER.replace("%/%/talker/%chatter", "%/%one%arm/talker/%one%arm%map")
    latched = read_token(token.replace("::,7", ":1:,7"))
    assert (latched.node, latched.name) == ("/one/arm/talker", "/one/arm/map")
    assert latched.latched
    assert latched.key.startswith("one/arm/map/")
    assert read_token(token + "/cuda:0").name == "/one/arm/map"  # of a later release


@pytest.mark.parametrize(
    "token",
    [
        "",
        "@ros2_lv/0",
        "@ros2_lv/0/a/0/1/MP/%/%/node",
        "other/0/a/0/1/NN/%/%/node",
        TALKER.replace("MP", "XX"),
        TALKER.replace("std_msgs::msg::dds_::String_", "std_msgs::msg::String"),
        TALKER.replace("dds_::String_", "dds_::9String_"),
        TALKER.replace("%chatter", "chatter"),
        TALKER.replace("%chatter", "%chat ter"),
        TALKER.replace("%chatter", "%%chatter"),
        TALKER.replace("%chatter", "%" + "long" * 100),
    ],
)
def test_a_lying_token_is_refused_in_words(token):
    with pytest.raises(ProtocolError, match="which no rmw_zenoh makes") as refused:
        read_token(token)
    assert len(str(refused.value)) < 400


def test_a_token_with_control_characters_is_shown_on_one_line():
    with pytest.raises(ProtocolError) as refused:
        read_token(TALKER.replace("%chatter", "%\x1b[31m\nchatter"))
    assert "\n" not in str(refused.value)
    assert "\x1b" not in str(refused.value)


def test_ten_thousand_tokens_come_and_go(graph):
    tokens = [odometry(i, topic=f"%odom{i % 100}") for i in range(10_000)]
    changed = {graph.add(token) for token in tokens}
    assert len(changed) == 100
    assert graph.known("/odom7") == "nav_msgs/msg/Odometry"
    assert len(graph.endpoints("publishers", "/odom7")) == 100
    for token in tokens:
        graph.remove(token)
        graph.remove(token)
    assert graph.known("/odom7") is None
    assert not graph._all
    assert not graph._named


def test_more_tokens_than_the_limit_are_left_out(graph, monkeypatch):
    monkeypatch.setattr(graphs, "MOST_ENDPOINTS", 3)
    for i in range(3):
        graph.add(odometry(i))
    with pytest.raises(ProtocolError, match="more than 3 publishers"):
        graph.add(odometry(3))
    graph.remove(odometry(0))
    assert graph.add(odometry(3)) == "/odom"


def test_the_graph_answers_by_its_tokens():
    tokens = [
        odometry(1),
        odometry(2, "MS"),
        odometry(3, "MS", "%goal"),
        odometry(4, "SS", "%start").replace(
            "nav_msgs::msg::dds_::Odometry_", "std_srvs::srv::dds_::Trigger_"
        ),
        "nonsense",
    ]

    async def ask():
        return tokens

    async def scenario():
        graph = RmwZenohGraph("zenoh-ros2://robot", ask)
        odom = "nav_msgs/msg/Odometry"
        assert await graph.topics() == {"/odom": odom, "/goal": odom}
        assert await graph.topic_type("/goal") == odom
        assert await graph.topic_type("/nothing") is None
        for token in tokens[:-1]:
            graph.add(token)
        assert await graph.nodes("publishers", "/odom") == ["/n1"]
        assert await graph.nodes("subscribers", "/odom") == ["/n2"]
        assert await graph.service_type("/start") == "std_srvs/srv/Trigger"
        assert await graph.service_type("/odom") is None
        assert await graph.time() is None
        assert "nav_msgs/Odometry" in await graph.definitions(odom, "msg")
        with pytest.raises(ServiceError, match="only reads"):
            await graph.set_parameter("gain", 1, 1.0)

    asyncio.run(scenario())


@pytest.mark.parametrize("release", [Stores.ROS2_KILTED, Stores.ROS2_LYRICAL])
def test_the_hashes_of_included_definitions_are_those_of_rosbags(release):
    store = get_typestore(release)
    compared = 0
    for name in shipped(ros2=True):
        spelled = name.replace("/", "/msg/")
        # rosbags hashes a char otherwise than ROS 2: see the next test.
        if spelled in store.fielddefs and name != "std_msgs/Char":
            compared += 1
            assert type_hash(name) == store.hash_rihs01(spelled), name
    assert compared > 70


@pytest.mark.parametrize(
    ("type", "hash"),
    [  # As the packages of ROS 2 Kilted state them.
        ("std_msgs/Char", CHAR),
        ("std_msgs/String", STRING),
    ],
)
def test_the_hash_of_ros(type, hash):
    assert type_hash(type) == hash


def test_the_reasons_for_a_refusal_are_in_words():
    assert "another one than WebMap's" in refusal_of("nav_msgs/msg/Odometry", STRING)
    assert "my_msgs/Dock is not included" in refusal_of("my_msgs/msg/Dock", STRING)
    humble = refusal_of("nav_msgs/msg/Odometry", "TypeHashNotSupported")
    assert "ROS 2 Humble" in humble
    assert "Kilted and later" in humble
    long = refusal_of("nav_msgs/msg/Odometry", json.dumps(["x\n"] * 9999))
    assert len(long) < 1000
    assert "\n" not in long
