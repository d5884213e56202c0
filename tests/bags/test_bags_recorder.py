"""Received messages are written; messages that are not written are reported."""

from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader
from rosbags.interfaces import QosDurability

from equipment.bag_files import BEGIN, FRAMES, GRID, ODOMETRY, Made, types_of
from webmap.bags.recorder import Recorder, new_bag
from webmap.base.errors import ConfigError

RANGE = "sensor_msgs/msg/Range"


@pytest.fixture
def recording(made, tmp_path):
    """A recorder, its bag, and its reports."""
    bag, reported = new_bag(tmp_path / "office", made.dialect), []
    return Recorder(bag, types_of(made.dialect), reported.append), bag, reported


def test_a_recorded_bag_is_readable_with_rosbags(made, recording):
    recorder, bag, reported = recording
    assert recorder.add("/odom", made.schema.dialect.spell(ODOMETRY))
    recorder.take("/odom", made.odometry(0.0, 1.25), BEGIN)
    bag.close()
    with AnyReader([bag.path]) as reader:
        ((connection, time, data),) = reader.messages()
        odometry = reader.deserialize(data, connection.msgtype)
    assert (connection.topic, time) == ("/odom", BEGIN)
    assert odometry.pose.pose.position.x == 1.25
    assert odometry.header.frame_id == "odom"
    assert (recorder.messages, recorder.topics, recorder.dropped) == (1, 1, 0)
    assert reported == []


def test_a_ros_2_bag_is_compressed(tmp_path):
    made = Made("ros2")
    bag = new_bag(tmp_path / "office", "ros2")
    recorder = Recorder(bag, types_of("ros2"), print)
    recorder.add("/odom", ODOMETRY)
    for number in range(2000):
        moment = number / 50
        recorder.take("/odom", made.odometry(moment, moment), BEGIN + number)
    bag.close()
    size = (bag.path / "office.mcap").stat().st_size
    assert size < recorder.size / 4


def test_maps_and_static_frames_are_recorded_as_latched(made, recording):
    recorder, bag, _ = recording
    messages = {
        "/map": (GRID, made.grid([0])),
        "/tf_static": (FRAMES, made.frame("laser")),
        "/odom": (ODOMETRY, made.odometry(0.0, 0.0)),
    }
    for topic, (type_name, message) in messages.items():
        recorder.add(topic, type_name)
        recorder.take(topic, message, BEGIN)
    bag.close()
    with AnyReader([bag.path]) as reader:
        kept = {c.topic for c in reader.connections if is_kept(c.ext)}
    assert kept == {"/map", "/tf_static"}


def is_kept(ext):
    if hasattr(ext, "latching"):
        return ext.latching == 1
    durable = QosDurability.TRANSIENT_LOCAL
    return any(qos.durability == durable for qos in ext.offered_qos_profiles)


def test_a_topic_with_an_unknown_type_is_not_recorded(recording):
    recorder, bag, _ = recording
    assert not recorder.add("/arm", "acme_msgs/Arm")
    bag.close()


def test_messages_that_do_not_fit_their_type_are_counted_and_reported_once(
    made, recording
):
    recorder, bag, reported = recording
    recorder.add("/odom", ODOMETRY)
    recorder.take("/odom", {"pose": 3}, BEGIN)
    recorder.take("/odom", made.odometry(0.0, 1.0) | {"twist": 3}, BEGIN)
    recorder.take("/odom", made.odometry(0.0, 1.0), BEGIN)
    bag.close()
    assert (recorder.messages, recorder.dropped) == (1, 2)
    (sentence,) = reported
    assert "/odom: messages that do not fit the type" in sentence


@pytest.mark.parametrize("fields", [{}, {"variance": 0.5}])
def test_a_message_is_written_with_the_type_version_that_fits_its_fields(
    tmp_path, fields
):
    """Since Jazzy a Range has a variance, and before it had none."""
    bag, reported = new_bag(tmp_path / "office", "ros2"), []
    recorder = Recorder(bag, types_of("ros2"), reported.append)
    sonar = Made("ros2").message("sensor_msgs/Range", range=1.5)
    del sonar["variance"]
    sonar |= fields
    assert recorder.add("/sonar", RANGE)
    recorder.take("/sonar", sonar, BEGIN)
    bag.close()
    assert reported == []
    with AnyReader([bag.path]) as reader:
        ((connection, _, data),) = reader.messages()
        read = reader.deserialize(data, connection.msgtype)
    assert read.range == 1.5
    assert getattr(read, "variance", None) == fields.get("variance")


def test_an_existing_bag_is_not_overwritten(made, tmp_path):
    first = new_bag(tmp_path / "office", made.dialect)
    first.close()
    with pytest.raises(ConfigError, match="exists already, and nothing is overwritten"):
        new_bag(tmp_path / "office", made.dialect)


def test_a_bag_that_rosbags_cannot_create_is_an_error(made, tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "exists", lambda _: False)  # made meanwhile
    (tmp_path / "office").mkdir()
    (tmp_path / "office.bag").touch()
    with pytest.raises(ConfigError, match=r"cannot be created: .* exists already"):
        new_bag(tmp_path / "office", made.dialect)


def test_a_ros_1_bag_file_gets_the_suffix_bag(tmp_path):
    bag = new_bag(tmp_path / "office.today", "ros1")
    bag.close()
    assert bag.path.name == "office.today.bag"


def test_a_ros_2_bag_with_a_file_suffix_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="a bag of ROS 2 is a folder"):
        new_bag(tmp_path / "office.bag", "ros2")
