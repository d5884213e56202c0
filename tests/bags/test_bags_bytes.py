"""The bytes of messages, compared with those of rosbags for every type."""

import random

import pytest
from rosbags.typesys import Stores, get_typestore

from webmap.bags.types import texts_of
from webmap.ros.definitions import FLOATS, INTEGERS, OCTETS, Definitions
from webmap.ros.rosbridge.server.encode import serialize


def filled(field, some):
    """Return a value that fits a field; each call returns another value."""
    if not field.is_array:
        return one(field, some)
    count = some.randrange(4) if field.size is None else field.size
    if field.type in OCTETS:
        return some.randbytes(count)
    return [one(field, some) for _ in range(count)]


def one(field, some):
    if field.fields is not None:
        return {each.name: filled(each, some) for each in field.fields}
    if field.type in INTEGERS:
        return some.randint(*INTEGERS[field.type])
    if field.type in FLOATS:
        return some.randrange(-1000, 1000) / 8
    if field.type == "string":
        return some.choice(["", "a", "Tür", "/robot_0/odom"])
    if field.type == "bool":
        return some.random() < 0.5
    return {"sec": some.randrange(2**31), "nanosec": some.randrange(10**9)}


@pytest.mark.parametrize("release", ["ROS1_NOETIC", "ROS2_HUMBLE", "ROS2_JAZZY"])
def test_rosbags_reads_and_writes_the_same_bytes_for_every_type(release):
    store, ros2 = get_typestore(Stores[release]), "ROS2" in release
    some = random.Random(release)
    read = store.deserialize_cdr if ros2 else store.deserialize_ros1
    write = store.serialize_cdr if ros2 else store.serialize_ros1
    for name in store.fielddefs:
        texts = texts_of(store, name)
        fields = Definitions(texts, ros2=ros2).definition(name).fields
        for _ in range(3):
            message = {field.name: filled(field, some) for field in fields}
            data = serialize(fields, message, ros2=ros2)
            assert bytes(write(read(data, name), name)) == data, name
