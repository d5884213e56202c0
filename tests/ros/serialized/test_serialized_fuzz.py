"""Random messages are read as they were written; other bytes are refused."""

import contextlib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from serialized_messages import LANGUAGES, TYPES, messages

from webmap.base.errors import ProtocolError
from webmap.ros.decoding import convert
from webmap.ros.definitions import shipped
from webmap.ros.messages import (
    LaserScanMsg,
    OccupancyGridMsg,
    OdometryMsg,
    PathMsg,
    TFMessage,
)
from webmap.ros.serialized.reader import make_reader
from webmap.ros.serialized.schemas import CODES, read_schema
from webmap.ros.serialized.writer import make_writer

pytestmark = pytest.mark.slow

VIEWS = {
    "nav_msgs/Odometry": OdometryMsg,
    "sensor_msgs/LaserScan": LaserScanMsg,
    "nav_msgs/OccupancyGrid": OccupancyGridMsg,
    "nav_msgs/Path": PathMsg,
    "tf2_msgs/TFMessage": TFMessage,
    "diagnostic_msgs/DiagnosticArray": None,
    "sensor_msgs/JointState": None,
    "visualization_msgs/MarkerArray": None,
}
CUT = [(encoding, name) for encoding in LANGUAGES for name in VIEWS]


def tools(encoding, name, view=None):
    schema = read_schema(name, LANGUAGES[encoding])
    return make_reader(schema, view, encoding), make_writer(schema, encoding)


def drawn(data, encoding, name):
    fields = shipped(encoding == "cdr").definition(name).fields
    return data.draw(messages(fields, encoding))


@pytest.mark.parametrize(("encoding", "name"), TYPES)
@settings(max_examples=2)
@given(data=st.data())
def test_a_message_of_an_included_type_is_read_as_it_was_written(encoding, name, data):
    read, write = tools(encoding, name)
    message = drawn(data, encoding, name)
    written = write(message)
    assert read(written) == message
    assert read(memoryview(bytes(9) + written)[9:]) == message
    assert read(bytearray(written)) == message


def outcome(read, data):
    """Return the transforms in a message as text, or None if it is refused."""
    with contextlib.suppress(ProtocolError):
        message = read(data)
        if isinstance(message, dict):
            message = convert(message, TFMessage)
        return repr(message.rows)
    return None


@pytest.mark.parametrize("encoding", LANGUAGES)
@settings(max_examples=50)
@given(data=st.data())
def test_the_transforms_of_a_view_are_those_of_the_plain_message(encoding, data):
    name = "tf2_msgs/TFMessage"
    view, write = tools(encoding, name, TFMessage)
    plain, _ = tools(encoding, name)
    message = drawn(data, encoding, name)
    store = get_typestore(Stores.ROS2_HUMBLE)
    for _ in range(3):  # other counts and names, and others in the same bytes
        order = data.draw(st.permutations(message["transforms"]))
        more = data.draw(st.sampled_from([[], order[:1], order]))
        written = bytearray(write({"transforms": [*order, *more]}))
        if encoding == "cdr" and data.draw(st.booleans()):
            theirs = store.deserialize_cdr(written, "tf2_msgs/msg/TFMessage")
            written = bytearray(
                store.serialize_cdr(
                    theirs, "tf2_msgs/msg/TFMessage", little_endian=False
                )
            )
        found = outcome(view, bytes(written))
        assert found is not None
        assert found == outcome(plain, bytes(written))
        for _ in range(data.draw(st.integers(1, 4))):
            at = data.draw(st.integers(0, len(written) - 1))
            written[at : at + 4] = data.draw(st.binary(min_size=1, max_size=6))
            assert outcome(view, bytes(written)) == outcome(plain, bytes(written))


NUMBERS = [each for each in CODES if each != "byte"]  # rosbags reads it with a sign


@st.composite
def texts(draw):
    """Draw a definition of a few types, of which each may hold the next ones."""
    count, parts = draw(st.integers(1, 4)), []
    for number in range(count):
        inner = [f"a/T{each}" for each in range(number + 1, count)]
        types = st.sampled_from([*NUMBERS, "string", *inner, *inner])
        arrays = st.sampled_from(["", "", "", "[]", "[1]", "[2]", "[<=3]"])
        fields = draw(st.lists(st.tuples(types, arrays), max_size=5))
        lines = [f"{kind}{array} f{n}" for n, (kind, array) in enumerate(fields)]
        parts.append("\n".join([*lines, ""]))
    return parts


@settings(max_examples=50)
@given(data=st.data(), parts=texts())
def test_messages_of_random_types_are_read_as_by_rosbags(data, parts):
    for encoding, language in LANGUAGES.items():
        if encoding == "ros1":
            parts = [part.replace("[<=3]", "[]") for part in parts]
        store, text = get_typestore(Stores.EMPTY), parts[0]
        for number, part in enumerate(parts):
            store.register(get_types_from_msg(part, f"a/msg/T{number}"))
            text += f"{'=' * 80}\nMSG: a/T{number}\n{part}"
        schema = read_schema("a/T0", language, text)
        read, write = make_reader(schema, None, encoding), make_writer(schema, encoding)
        message = data.draw(messages(schema.fields, encoding))
        written = write(message)
        assert read(written) == read(written) == message
        if encoding == "ros1":
            theirs = store.deserialize_ros1(written, "a/msg/T0")
            assert bytes(store.serialize_ros1(theirs, "a/msg/T0")) == written
            continue
        theirs = store.deserialize_cdr(written, "a/msg/T0")
        for little in (True, False):
            found = store.serialize_cdr(theirs, "a/msg/T0", little_endian=little)
            assert not little or bytes(found) == written
            assert read(found) == message


@pytest.mark.parametrize(("encoding", "name"), CUT)
@settings(max_examples=2)
@given(data=st.data())
def test_a_message_is_refused_that_is_shorter_or_longer_than_its_fields(
    encoding, name, data
):
    read, write = tools(encoding, name, VIEWS[name])
    written = write(drawn(data, encoding, name))
    message = read(written)
    for size in range(len(written)):
        with pytest.raises(ProtocolError):
            read(written[:size])
    for more in range(1, 9):
        if encoding == "cdr" and more < 4:
            assert str(read(written + bytes(more))) == str(message)
        else:
            with pytest.raises(ProtocolError, match=f"{more} bytes after its last"):
                read(written + bytes(more))


@pytest.mark.parametrize(("encoding", "name"), CUT)
@settings(max_examples=10)
@given(data=st.data())
def test_other_bytes_raise_only_errors_of_the_protocol(encoding, name, data):
    read, write = tools(encoding, name, VIEWS[name])
    written = bytearray(write(drawn(data, encoding, name)))
    for _ in range(data.draw(st.integers(0, 4))):
        at = data.draw(st.integers(0, len(written) - 1))
        written[at : at + 4] = data.draw(st.binary(min_size=1, max_size=6))
    for bad in (bytes(written), data.draw(st.binary(max_size=300))):
        for head in (b"", b"\0\1\0\0", b"\0\0\0\0"):
            with contextlib.suppress(ProtocolError):
                read(head + bad)
