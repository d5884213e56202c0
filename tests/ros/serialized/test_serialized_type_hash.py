"""The hashes by which the definitions of a robot are compared with WebMap's."""

import json

import pytest
from rosbags.typesys import Stores, get_typestore

from webmap.base.errors import ConfigError, ProtocolError
from webmap.ros.definitions import shipped
from webmap.ros.foxglove.messages import TYPE_HASH, Format
from webmap.ros.serialized.type_hash import NO_HASH, check_hash, type_hash

# The example of docs/design.md of rmw_zenoh, and that of the package std_msgs.
STRING = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
CHAR = "RIHS01_3ad2d04dd29ba19d04b16659afa3ccaedd691914b02a64e82e252f2fa6a586a9"


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
    ("type", "hash"), [("std_msgs/Char", CHAR), ("std_msgs/String", STRING)]
)
def test_the_hash_of_ros(type, hash):
    assert type_hash(type) == hash
    check_hash(type, hash)


@pytest.mark.parametrize(
    ("type", "hash", "why"),
    [
        ("nav_msgs/msg/Odometry", STRING, "differs from WebMap's: the hash is RIH"),
        ("my_msgs/msg/Dock", STRING, "of my_msgs/Dock is not included in WebMap"),
        ("nav_msgs/msg/Odometry", NO_HASH, "ROS 2 Humble; .* Kilted and later"),
        ("nav_msgs/msg/Odometry", "", "the hash is , expected RIHS01_"),
        ("not a type", STRING, "is not the name of a type"),
    ],
)
def test_a_refusal_is_in_words(type, hash, why):
    with pytest.raises(ConfigError, match=why):
        check_hash(type, hash)


def test_a_long_hash_is_cut_and_on_one_line():
    with pytest.raises(ConfigError) as refused:
        check_hash("nav_msgs/msg/Odometry", json.dumps(["x\n"] * 9999) + "\n")
    assert len(str(refused.value)) < 1000
    assert "\n" not in str(refused.value)


def test_a_schema_that_is_a_hash_is_the_included_one_if_both_agree():
    good = Format("std_msgs/msg/String", "cdr", TYPE_HASH, STRING)
    assert good.has_schema
    assert good.read(b"\0\1\0\0\3\0\0\0hi\0") == {"data": "hi"}
    assert "std_msgs/String" in good.definitions
    bad = Format("std_msgs/msg/String", "cdr", TYPE_HASH, CHAR)
    assert not bad.has_schema
    with pytest.raises(ProtocolError, match="differs from WebMap's"):
        bad.read(b"\0\1\0\0\3\0\0\0hi\0")
