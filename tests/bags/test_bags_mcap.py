"""MCAP files of other writers, files that were cut off, and damaged ones."""

import signal
import struct
import subprocess
import sys
import tracemalloc
import zlib

import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Channel, Chunk, ChunkIndex, Footer, Header, Message, Schema

from equipment.bag_files import BEGIN, ODOMETRY, Made, types_of
from equipment.mcap_files import LOOSE, MCAPCompression, definition, odometry, write
from webmap.bags import mcap_file
from webmap.bags.mcap_file import MAGIC
from webmap.bags.recording import Recording
from webmap.base.errors import ConfigError


def opened(path, warnings=None):
    return Recording([path], warn=print if warnings is None else warnings.append)


def xs(recording):
    """Return the positions in all odometry messages."""
    messages = [recording.message(one) for one in recording.messages(recording.begin)]
    return [message["pose"]["pose"]["position"]["x"] for message in messages]


@pytest.mark.parametrize(
    ("dialect", "options"),
    [
        ("ros1", {"compression": MCAPCompression.Lz4}),
        ("ros1", LOOSE),
        ("ros2", {"compression": MCAPCompression.Lz4, "profile": "ros2"}),
        ("ros2", {"compression": MCAPCompression.Zstd}),
        ("ros2", {"compression": None}),
        ("ros2", {"chunk_size": 1}),
        ("ros2", LOOSE),
        ("ros2", {"emit_chunk_indexes": False, "emit_statistics": False}),
        ("ros2", {"emit_message_indexes": False}),
        ("ros2", {"repeat_channels": False, "repeat_schemas": False}),
    ],
    ids=str,
)
def test_a_file_of_another_writer_is_read(tmp_path, dialect, options):
    messages = [odometry(second, float(second), dialect=dialect) for second in range(4)]
    recording = opened(write(tmp_path / "other.mcap", *messages, **options))
    assert recording.dialect == dialect
    assert recording.topics["/odom"].type == ODOMETRY
    assert (recording.begin, recording.seconds) == (BEGIN, pytest.approx(3.0))
    assert xs(recording) == [0.0, 1.0, 2.0, 3.0]
    later = [one.time for one in recording.messages(BEGIN + 2 * 10**9)]
    assert later == [BEGIN + 2 * 10**9, BEGIN + 3 * 10**9]
    recording.close()


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_messages_in_json_with_a_definition_of_ros_are_read(tmp_path, dialect):
    message = odometry(0.5, 1.5, dialect=dialect, encoding="json")
    recording = opened(write(tmp_path / "json.mcap", message))
    (only,) = recording.messages(BEGIN)
    decoded = recording.message(only)
    assert decoded["pose"]["pose"]["position"]["x"] == 1.5
    assert decoded["header"]["stamp"] == Made(dialect).time(0.5)
    recording.close()


def test_a_definition_in_idl_is_read(tmp_path):
    text = b"module std_msgs { module msg { struct Float64 { double data; }; }; };"
    data = b"\x00\x01\x00\x00" + struct.pack("<d", 2.5)
    path = write(
        tmp_path / "idl.mcap",
        ("/x", ("cdr", "ros2idl"), "std_msgs/msg/Float64", text, 0.0, data),
    )
    recording = opened(path)
    (only,) = recording.messages(BEGIN)
    assert recording.message(only) == {"data": 2.5}
    recording.close()


def test_messages_are_read_in_the_order_of_their_times(tmp_path):
    moments = [3.0, 1.0, 2.0, 0.0]
    messages = [odometry(moment, moment) for moment in moments]
    for options in (LOOSE, {"chunk_size": 1}, {}):
        path = tmp_path / f"{len(options)}{options.get('chunk_size')}.mcap"
        recording = opened(write(path, *messages, **options))
        assert xs(recording) == sorted(moments)
        recording.close()


def test_each_topic_that_cannot_be_decoded_is_left_out_with_a_sentence(tmp_path):
    unreadable = [
        ("/scene", ("protobuf", "protobuf"), "foxglove.Scene", b"x", 0.0, b"1"),
        ("/log", ("json", "jsonschema"), "nav_msgs/msg/Odometry", b"{}", 0.0, b"{}"),
        ("/flat", ("flatbuffer", "flatbuffer"), "Flat", b"x", 0.0, b"1"),
        ("/bad", ("cdr", "ros2msg"), "acme_msgs/msg/Bad", b"no (definition", 0.0, b"1"),
        ("/type", ("cdr", "ros2msg"), "no type", b"int8 x", 0.0, b"1"),
        odometry(0.0, 1.0, dialect="ros1", topic="/old"),
    ]
    warnings = []
    path = write(tmp_path / "mixed.mcap", *unreadable, odometry(1.0, 2.0))
    recording = opened(path, warnings)
    assert list(recording.topics) == ["/odom"]
    assert xs(recording) == [2.0]
    assert len(warnings) == len(unreadable)
    found = {warning.split()[1]: warning for warning in warnings}
    assert found["/scene"] == (
        "mixed.mcap: /scene (foxglove.Scene) is left out: its messages are encoded as "
        "protobuf and its type as protobuf; WebMap reads messages as cdr, ros1 or "
        "json, with a type of ROS"
    )
    assert "as json and its type as jsonschema" in found["/log"]
    assert "its definition is not valid" in found["/bad"]
    assert "it is of ROS 1, and other topics are of ROS 2" in found["/old"]
    recording.close()


@pytest.mark.parametrize("options", [LOOSE, {"chunk_size": 1}], ids=str)
@pytest.mark.parametrize("share", [0.5, 0.9])
def test_a_file_that_was_cut_off_is_read_up_to_there(tmp_path, options, share):
    messages = [odometry(number, float(number)) for number in range(40)]
    whole = write(tmp_path / "whole.mcap", *messages, **options)
    short = tmp_path / "short.mcap"
    # The half of the messages is in less than the half of the file.
    data = whole.read_bytes().partition(b"\x0f\x04\0\0\0\0\0\0\0")[0]
    short.write_bytes(data[: int(len(data) * share)])
    warnings = []
    recording = opened(short, warnings)
    read = xs(recording)
    assert read == [float(number) for number in range(len(read))]
    assert 40 * share - 8 < len(read) < 40
    assert recording.seconds == pytest.approx(len(read) - 1)
    (warning,) = warnings
    assert warning.startswith("short.mcap is played only up to where it can be read")
    assert "`mcap recover`" in warning
    recording.close()


def test_of_a_recorder_that_was_killed_all_but_the_last_chunk_is_read(tmp_path):
    made, version = Made("ros2"), next(types_of("ros2").versions(ODOMETRY))
    data = version.bytes_of(made.odometry(0.0, 1.0))
    number = 2 * (1 << 20) // len(data) + 100
    script = (
        "import os, sys\n"
        "from pathlib import Path\n"
        "from webmap.bags.recorder import new_bag\n"
        "from webmap.bags.types import Types\n"
        "version = next(Types('ros2').versions('nav_msgs/Odometry'))\n"
        "bag = new_bag(Path(sys.argv[1]), 'ros2')\n"
        "channel = bag.add('/odom', version)\n"
        "data = bytes.fromhex(sys.argv[2])\n"
        "for number in range(int(sys.argv[3])):\n"
        "    bag.write(channel, 10**18 + number, data)\n"
        "bag._writer.storage.bio.flush()\n"  # as the system does after a while
        "os.kill(os.getpid(), 9)\n"
    )
    command = [sys.executable, "-c", script, tmp_path / "bag", data.hex(), str(number)]
    assert subprocess.run(command, check=False).returncode == -signal.SIGKILL
    warnings = []
    recording = opened(tmp_path / "bag" / "bag.mcap", warnings)
    read = sum(1 for _ in recording.messages(0))
    assert number - (1 << 20) // len(data) - 100 < read < number
    assert "it was not closed; `mcap recover`" in warnings[0]
    recording.close()


def test_the_file_in_the_folder_of_a_bag_is_read_with_the_same_checks(tmp_path):
    made = Made("ros2")
    bag = made.bag(tmp_path / "bag", ("/odom", ODOMETRY, 0.0, made.odometry(0.0, 1.0)))
    file = bag / "bag.mcap"
    data = bytearray(file.read_bytes())
    at = data.index(b"zstd") + 100
    data[at : at + 50] = bytes(50)
    file.write_bytes(data)
    recording = opened(bag)
    with pytest.raises(
        ConfigError, match=r"bag cannot be read.*: the chunk at byte \d+"
    ):
        list(recording.messages(BEGIN))
    recording.close()


def record(*records):
    """Return the bytes of records."""
    builder = RecordBuilder()
    for each in records:
        each.write(builder)
    return builder.end()


HEAD = MAGIC + record(Header("", "test"))
SCHEMA = Schema(
    data=definition("ros2"), encoding="ros2msg", id=1, name="nav_msgs/msg/Odometry"
)
CHANNEL = Channel(id=1, topic="/odom", message_encoding="cdr", metadata={}, schema_id=1)
DATA = odometry(0.0, 7.0)[-1]
WHOLE = [SCHEMA, CHANNEL, Message(1, BEGIN, DATA, BEGIN, 0)]


def chunk(content, **changes):
    """Return a chunk."""
    fields = {
        "compression": "",
        "data": content,
        "message_end_time": BEGIN,
        "message_start_time": BEGIN,
        "uncompressed_crc": zlib.crc32(content),
        "uncompressed_size": len(content),
    }
    return Chunk(**fields | changes)


GOOD = record(*WHOLE)


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        (record(chunk(GOOD, uncompressed_crc=1)), "its check sum is wrong"),
        (record(chunk(GOOD, uncompressed_size=9)), "it has not the 9 bytes"),
        (record(chunk(GOOD, compression="zip")), "unknown compression zip"),
        (record(chunk(GOOD, compression="zstd")), "the chunk at byte"),
        (record(chunk(GOOD, compression="lz4")), "the chunk at byte"),
        (record(chunk(GOOD[:-1])), "is cut off or damaged"),
        (record(chunk(GOOD, uncompressed_size=2**63)), "expected at most 268435456"),
        (b"\x06" + struct.pack("<Q", 2**64 - 1) + GOOD, "cut off or damaged"),
        (b"\x05" + struct.pack("<Q", 3) + bytes(3), "cut off or damaged"),
        (b"\x03" + struct.pack("<Q", 6) + bytes(2) + b"\xff" * 4, "is damaged"),
        (b"", "it was not closed"),
        (b"\x00" * 5000, "cut off or damaged"),
    ],
    ids=range(12),
)
def test_a_damaged_file_is_read_up_to_the_damage(tmp_path, body, reason):
    path, warnings = tmp_path / "bad.mcap", []
    path.write_bytes(HEAD + body)
    with pytest.raises(ConfigError) as refused:
        opened(path)
    words = str(refused.value)
    assert words.startswith("bad.mcap cannot be read as a recording: no message in it")
    assert reason in words
    path.write_bytes(HEAD + record(chunk(GOOD)) + body)
    recording = opened(path, warnings)
    assert xs(recording) == [7.0]
    assert len(warnings) == 1
    assert reason in warnings[0]
    recording.close()


def test_a_chunk_that_grows_without_end_takes_no_memory(tmp_path):
    bomb = zstandard.ZstdCompressor().compress(bytes(256 << 20))
    path = tmp_path / "bomb.mcap"
    stated = chunk(bomb, compression="zstd", uncompressed_size=1000)
    path.write_bytes(HEAD + record(stated))
    tracemalloc.start()
    with pytest.raises(ConfigError, match="it has not the 1000 bytes"):
        opened(path)
    assert tracemalloc.get_traced_memory()[1] < 20 << 20
    tracemalloc.stop()


def closed(path, *indexes):
    """Write a file of two chunks with an index."""
    data = HEAD + record(chunk(GOOD), chunk(GOOD))
    index = record(SCHEMA, CHANNEL, *indexes)
    footer = record(Footer(len(data), 0, 0))
    path.write_bytes(data + index + footer + MAGIC)
    return path


def index_of(begin, length, channel=1):
    """Return the entry of a chunk in the index."""
    return ChunkIndex(
        chunk_length=length,
        chunk_start_offset=begin,
        compression="",
        compressed_size=len(GOOD),
        message_end_time=BEGIN,
        message_index_length=0,
        message_index_offsets={channel: 0},
        message_start_time=BEGIN,
        uncompressed_size=len(GOOD),
    )


SIZE = len(record(chunk(GOOD)))


@pytest.mark.parametrize(
    "indexes",
    [
        [index_of(len(HEAD), SIZE)] * 2,
        [index_of(2**63, SIZE)],
        [index_of(len(HEAD), SIZE, channel=9)],
        [],
    ],
    ids=["twice", "beyond the end", "unknown channel", "empty"],
)
def test_an_index_that_does_not_fit_the_file_is_not_used(tmp_path, indexes):
    warnings = []
    recording = opened(closed(tmp_path / "index.mcap", *indexes), warnings)
    assert xs(recording) == [7.0, 7.0]
    assert warnings == []
    recording.close()


def test_an_index_that_lists_no_chunk_is_an_error_when_it_is_played(tmp_path):
    path = closed(tmp_path / "index.mcap", index_of(0, 5))
    recording = opened(path)
    with pytest.raises(ConfigError, match=r"index\.mcap cannot be read as a recording"):
        xs(recording)
    recording.close()


def test_a_chunk_that_is_damaged_in_the_middle_ends_the_messages(tmp_path):
    path = closed(
        tmp_path / "middle.mcap",
        index_of(len(HEAD), SIZE),
        index_of(len(HEAD) + SIZE, SIZE),
    )
    data = bytearray(path.read_bytes())
    data[len(HEAD) + 2 * SIZE - 10] ^= 255
    path.write_bytes(data)
    recording = opened(path)
    messages = recording.messages(BEGIN)
    assert next(messages).topic == "/odom"
    with pytest.raises(ConfigError, match="its check sum is wrong"):
        next(messages)
    recording.close()


def test_messages_whose_times_overlap_too_much_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(mcap_file, "HELD", 3000)
    moments = [9.0, *range(8), 10.0]
    messages = [odometry(moment, 0.0) for moment in moments]
    recording = opened(write(tmp_path / "overlap.mcap", *messages, chunk_size=10**6))
    with pytest.raises(ConfigError, match="not in the order of their times"):
        list(recording.messages(BEGIN))
    recording.close()


@pytest.mark.parametrize("qos", ["- [", "text", "- history: 3"])
def test_a_topic_with_an_invalid_quality_of_service_is_read(tmp_path, qos):
    path = tmp_path / "qos.mcap"
    metadata = {"offered_qos_profiles": qos}
    channel = Channel(
        id=1, topic="/odom", message_encoding="cdr", metadata=metadata, schema_id=1
    )
    records = record(SCHEMA, channel, WHOLE[2], Footer(0, 0, 0))
    path.write_bytes(HEAD + records + MAGIC)
    recording = opened(path)
    assert xs(recording) == [7.0]
    recording.close()


def test_a_file_without_any_definition_is_refused(tmp_path):
    path = tmp_path / "bare.mcap"
    path.write_bytes(
        HEAD
        + record(
            Channel(id=1, topic="/x", message_encoding="", metadata={}, schema_id=5),
            Message(1, BEGIN, b"x", BEGIN, 0),
        )
        + record(Footer(0, 0, 0))
        + MAGIC
    )
    warnings = []
    with pytest.raises(ConfigError, match="none of its topics can be played"):
        opened(path, warnings)
    (warning,) = warnings
    assert "the file has no definition of its type" in warning
