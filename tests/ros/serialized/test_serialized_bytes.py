"""Messages read and written here, compared with rosbags for every type it has."""

import random
from array import array

import pytest
from rosbags.typesys import Stores, get_typestore

from webmap.bags.types import texts_of
from webmap.ros.definitions import FLOATS, INTEGERS, OCTETS, Definitions
from webmap.ros.serialized.reader import make_reader
from webmap.ros.serialized.schemas import read_schema
from webmap.ros.serialized.writer import make_writer

TIMES = {"secs": "sec", "nsecs": "nanosec"}
RELEASES = ["ROS1_NOETIC", "ROS2_HUMBLE", "ROS2_JAZZY"]
EXAMPLES = 3


def filled(field, some):
    """Return a value that fits a field, as the reader returns it."""
    if not field.is_array:
        return one(field, some)
    most = 3 if field.most is None else min(field.most, 3)
    count = some.randint(0, most) if field.size is None else field.size
    values = [one(field, some) for _ in range(count)]
    if field.type in OCTETS:
        return bytes(values)
    code = CODES.get(field.type)
    return values if code is None else array(code, values)


CODES = {
    **{"int8": "b", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I"},
    **{"int64": "q", "uint64": "Q", "float32": "f", "float64": "d"},
}


def one(field, some):
    if field.fields is not None:
        return message_of(field.fields, some)
    if field.type == "byte":  # rosbags reads one with a sign
        return some.randint(0, 127)
    if field.type in INTEGERS:
        return some.randint(*INTEGERS[field.type])
    if field.type in FLOATS:
        return some.randrange(-1000, 1000) / 8
    if field.type == "string":
        return some.choice(["", "a", "Tür", "/robot_0/odom"])
    if field.type == "bool":
        return some.random() < 0.5
    seconds, rest = some.randrange(2**31), some.randrange(10**9)
    if some.ros2:
        return {"sec": seconds, "nanosec": rest}
    return {"secs": seconds, "nsecs": rest}


def message_of(fields, some):
    return {field.name: filled(field, some) for field in fields}


class Some(random.Random):
    """Random values, the same in each run."""

    def __init__(self, name, ros2):
        super().__init__(name)
        self.ros2 = ros2


def same(ours, theirs):
    """Compare a message of the reader with one of rosbags."""
    if isinstance(ours, dict):
        names = {name: TIMES.get(name, name) for name in ours}
        return all(
            same(each, getattr(theirs, names[name], getattr(theirs, f"{name}_", None)))
            for name, each in ours.items()
        )
    if isinstance(ours, list | bytes | array):
        return len(ours) == len(theirs) and all(map(same, ours, theirs))
    return ours == theirs


def types(release):
    """Return each type of a release with its schema, and with its definition."""
    store, ros2 = get_typestore(Stores[release]), "ROS2" in release
    for name in store.fielddefs:
        texts = texts_of(store, name)
        known = Definitions(texts, ros2=ros2).definition(name)
        first = texts.pop(known.name)
        rest = (f"{'=' * 80}\nMSG: {each}\n{text}" for each, text in texts.items())
        text = "\n".join([first, *rest])
        yield name, read_schema(name, "ros2msg" if ros2 else "ros1msg", text), known


@pytest.mark.parametrize("release", RELEASES)
def test_every_type_is_read_and_written_as_by_rosbags(release):
    store, ros2 = get_typestore(Stores[release]), "ROS2" in release
    some, encoding = Some(release, ros2), "cdr" if ros2 else "ros1"
    count = 0
    for name, schema, known in types(release):
        count += 1
        read, write = make_reader(schema, None, encoding), make_writer(schema, encoding)
        for _ in range(EXAMPLES):
            message = message_of(known.fields, some)
            data = write(message)
            assert read(data) == message, name
            if ros2:
                theirs = store.deserialize_cdr(data, name)
                for little in (True, False):
                    their_data = store.serialize_cdr(theirs, name, little_endian=little)
                    assert read(their_data) == message, name
                    assert not little or bytes(their_data) == data
            else:
                theirs = store.deserialize_ros1(data, name)
                assert bytes(store.serialize_ros1(theirs, name)) == data, name
            assert same(message, theirs), name
    assert count > 100
