"""``webmap record`` and ``webmap play``: recorded messages are published again."""

import contextlib
import json
import re
import signal
import subprocess
import sys
import threading
import time

import pytest
from rosbags.highlevel import AnyReader
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from equipment.command_line import run_inside
from equipment.waiting import wait_for
from equipment.webmap_process import simulator
from webmap.cli.play import replay

pytestmark = pytest.mark.slow

COMMAND = [sys.executable, "-m", "webmap", "record"]


class Subscriber:
    """Subscribes to topics of a bridge like any client, in a separate thread."""

    def __init__(self, socket, *topics):
        self.received = {topic: [] for topic in topics}
        self._socket = socket
        for topic in topics:
            socket.send(json.dumps({"op": "subscribe", "topic": topic}))
        threading.Thread(target=self._receive, daemon=True).start()

    def _receive(self):
        with contextlib.suppress(ConnectionClosed):
            for frame in self._socket:
                operation = json.loads(frame)
                if operation["op"] == "publish":
                    self.received[operation["topic"]].append(operation["msg"])

    def wait_for(self, topic, number):
        received = self.received[topic]
        wait_for(lambda: len(received) >= number, f"{number} messages of {topic}")
        return received


@contextlib.contextmanager
def subscribed(url, *topics):
    with connect(url, proxy=None, max_size=None) as socket:
        yield Subscriber(socket, *topics)


def without_times(message):
    """Return a message without its time stamp and without the sequence of ROS 1."""
    header = {"frame_id": message["header"]["frame_id"]}
    return json.dumps(message | {"header": header})


def age(message):
    """Return the age of a message by its time stamp, in seconds."""
    whole, rest = (
        message["header"]["stamp"].get(ros1, message["header"]["stamp"].get(ros2))
        for ros1, ros2 in (("secs", "sec"), ("nsecs", "nanosec"))
    )
    return time.time() - whole - rest / 1e9


@pytest.mark.slow
@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_a_played_recording_repeats_the_messages_of_the_robot(tmp_path, dialect):
    odom, scan = "/robot_0/odom", "/robot_0/base_scan"
    received = ("--robots", "1", "--wander", "--dialect", dialect)
    bag = tmp_path / ("drive.bag" if dialect == "ros1" else "drive")
    with simulator(*received) as url, subscribed(url, odom, scan) as subscriber:
        subscriber.wait_for(scan, 1)
        done = run(url, "--out", bag, "--duration", "2")
        assert done.returncode == 0, done.stderr
        subscriber.wait_for(scan, len(subscriber.received[scan]) + 2)
        published = {
            topic: {*map(without_times, subscriber.received[topic])}
            for topic in subscriber.received
        }
    lasted = r"Recorded \d+ messages of \d+ topics in [2-9]\.\d s to "
    assert re.search(lasted, done.stderr)
    assert done.stdout == f"Recording {url} to {bag}\n"
    kept = ("/map", "/tf_static")
    with (
        replay("--loop", bag) as (played, _),
        subscribed(played, odom, scan, "/tf", *kept) as again,
    ):
        for message in again.wait_for(odom, 5):
            assert without_times(message) in published[odom]
        for message in again.wait_for(scan, 3):
            assert without_times(message) in published[scan]
        assert 0 <= age(again.wait_for(odom, 6)[-1]) < 2
        assert len(again.wait_for("/map", 1)[0]["data"]) > 1000
        assert again.wait_for("/tf_static", 1)
        assert again.wait_for("/tf", 2)


@contextlib.contextmanager
def killed(process):
    try:
        yield
    finally:
        process.kill()


def test_record_stores_only_the_named_topics_until_a_signal(ros2, tmp_path):
    bag = tmp_path / "office"
    with (
        subprocess.Popen(
            [*COMMAND, ros2, "--topic", "/odom", "--topic", "/later", "--out", bag],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        ) as process,
        killed(process),
    ):
        assert process.stdout.readline() == f"Recording {ros2} to {bag}\n"
        assert "Waiting for: /later" in process.stderr.readline()
        with subscribed(ros2, "/odom") as subscriber:
            subscriber.wait_for("/odom", 40)  # the recorder may subscribe later
        process.send_signal(signal.SIGINT)
        printed = process.stderr.read()
        assert process.wait(15) == 0, printed
    with AnyReader([bag]) as reader:
        assert {c.topic for c in reader.connections} == {"/odom"}
        assert reader.message_count > 3
    assert re.search(r"Recorded \d+ messages of 1 topic in \d+\.\d s to ", printed)


def run(*arguments):
    return subprocess.run(
        [*COMMAND, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )


def test_a_named_topic_without_a_known_type_is_refused(tmp_path):
    listed = tmp_path / "topics"
    listed.write_text("/odom nav_msgs/Odometry\n")
    named = ("--topic", "/odom", "--topic", "/x")
    done = run("ws://127.0.0.1:1", "--topics", listed, *named, "--duration", "1")
    assert_refused(done, "the type of /x is unknown: give it with --type")


def assert_refused(done, message):
    assert done.returncode == 2, done.stderr
    assert message in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_record_does_not_overwrite_an_existing_bag(ros1, tmp_path):
    bag = tmp_path / "office.bag"
    bag.write_text("mine")
    assert_refused(run(ros1, "--out", bag, "--duration", "1"), "nothing is overwritten")
    assert bag.read_text() == "mine"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("ws://127.0.0.1:1", "--wait", "0"), "cannot reach the rosbridge"),
        (("http://robot:9090",), "ws://"),
        (("ws://robot:9090", "--duration", "0"), "--duration"),
        (("ws://robot:9090", "--type", "nav_msgs/Odometry"), "1 types for 0 topics"),
        (
            ("ws://robot:9090", "--topic", "/odom", "--type", "nonsense"),
            "'nonsense' is not the name of a type",
        ),
        (("ws://robot:9090", "--topic", "a b"), "'a b' is not the name of a topic"),
    ],
)
def test_an_invalid_argument_of_record_is_refused_and_no_bag_is_created(
    arguments, message, tmp_path
):
    done = run_inside("record", *arguments, "--out", tmp_path / "bag")
    assert_refused(done, message)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("dialect", ["ros1", "ros2"])
def test_compressed_images_received_in_cbor_are_recorded_completely(tmp_path, dialect):
    topic = "/robot_0/camera/image_raw/compressed"
    bag = tmp_path / ("camera.bag" if dialect == "ros1" else "camera")
    with simulator("--robots", "1", "--dialect", dialect) as url:
        done = run(url, "--topic", topic, "--out", bag, "--duration", "2")
    assert done.returncode == 0, done.stderr
    with AnyReader([bag]) as reader:
        pictures = [
            reader.deserialize(raw, connection.msgtype)
            for connection, _, raw in reader.messages()
        ]
    assert pictures
    assert bytes(pictures[0].data).startswith(b"\xff\xd8\xff"), "the data is a JPEG"
